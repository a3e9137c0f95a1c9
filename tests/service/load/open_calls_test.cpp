#include "server/base/open_calls.h"

#include <gtest/gtest.h>

namespace helio::test {
namespace {

TEST(OpenCalls, EndThoseThatHaveTheirPlaceOnce) {
  OpenCalls calls;
  int first = 0, second = 0, third = 0;
  const OpenCalls::Place kept = calls.add([&] { ++first; });
  OpenCalls::Place given_up = calls.add([&] { ++second; });
  given_up.reset();
  calls.end_all();
  EXPECT_EQ(first, 1);
  EXPECT_EQ(second, 0);
  // One that comes too late is ended by the one who adds it.
  const OpenCalls::Place late = calls.add([&] { ++third; });
  EXPECT_EQ(third, 1);
  calls.end_all();
  EXPECT_EQ(first, 1);
  EXPECT_EQ(third, 1);
}

TEST(OpenCalls, ForgetThoseThatAreOver) {
  OpenCalls calls;
  int ended = 0;
  for (int i = 0; i < 10'000; ++i) OpenCalls::Place over = calls.add([&] { ++ended; });
  std::vector<OpenCalls::Place> kept;
  for (int i = 0; i < 1000; ++i) kept.push_back(calls.add([&] { ++ended; }));
  calls.end_all();
  EXPECT_EQ(ended, 1000);
}

// A call may end others, or begin one, while it is told.
TEST(OpenCalls, MayBeUsedWhileTheyEnd) {
  OpenCalls calls;
  OpenCalls::Place other, newer;
  int ended = 0;
  const OpenCalls::Place first = calls.add([&] {
    other.reset();
    newer = calls.add([&] { ended += 10; });
  });
  other = calls.add([&] { ++ended; });
  calls.end_all();
  EXPECT_EQ(ended, 10);
}

}  // namespace
}  // namespace helio::test
