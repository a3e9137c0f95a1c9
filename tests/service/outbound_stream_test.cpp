#include "server/stream/outbound_stream.h"

#include <gtest/gtest.h>

#include <new>

#include "server/rpc/call_hold.h"

namespace helio {
namespace {

struct RecordedCall final : OutboundStream::Call {
  int writes = 0;
  std::optional<grpc::Status> end;
  void start_write(const grpc::ByteBuffer*) override { ++writes; }
  void finish(const grpc::Status& status) override {
    EXPECT_FALSE(end);
    end = status;
  }
};

TEST(CallHold, IsRefusedOnceTheCallIsFinished) {
  const grpc::Status gone(grpc::StatusCode::CANCELLED, "gone");
  CallHold finished_before;
  EXPECT_FALSE(finished_before.defer(gone));
  EXPECT_FALSE(finished_before.begin());

  CallHold finished_meanwhile;
  ASSERT_TRUE(finished_meanwhile.begin());
  EXPECT_TRUE(finished_meanwhile.defer(gone));
  bool went_on = false;
  const auto status = finished_meanwhile.end([&] { went_on = true; });
  EXPECT_FALSE(went_on);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_FALSE(finished_meanwhile.begin());
}

grpc::ByteBuffer some_bytes() {
  const grpc::Slice slice("message");
  return grpc::ByteBuffer(&slice, 1);
}

// A client must not wait for the end of a frame that was lost on its way out.
TEST(OutboundStream, AMessageThatCannotBeEncodedEndsTheCall) {
  TimerQueue timers;
  RecordedCall call;
  bool out_of_memory = false;
  const auto stream = std::make_shared<OutboundStream>(
      call,
      [&](Outbound) {
        if (out_of_memory) throw std::bad_alloc();
        return some_bytes();
      },
      timers);
  stream->push(Greeting{"hello"});
  EXPECT_EQ(call.writes, 1);
  stream->write_done(true);
  out_of_memory = true;
  stream->push(Notice{});
  ASSERT_TRUE(call.end);
  EXPECT_EQ(call.end->error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(stream->finished());
  out_of_memory = false;
  stream->push(Greeting{"again"});
  EXPECT_EQ(call.writes, 1);
}

}  // namespace
}  // namespace helio
