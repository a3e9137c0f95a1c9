// The sender against a viewer that is there, absent, gone, or reads nothing.
#include "client/tev/tev_sender.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <memory>
#include <thread>

#include "process.h"
#include "renderer/base/clock.h"
#include "service_fixture.h"
#include "tests/support/tev_receiver.h"

namespace helio::test {
namespace {

const TevImage kImage{"box s-1", 64, 32, {"R", "samples"}};
constexpr PixelRect kLeft{0, 0, 32, 32}, kRight{32, 0, 64, 32};
// As the program's, but quicker where a test would have to wait.
constexpr TevTiming kQuick{0.05, 0.1, 1, 0.3, 1};

class Warnings {
 public:
  std::function<void(const std::string&)> take() {
    return [this](const std::string& text) {
      const std::lock_guard lock(mutex_);
      texts_.push_back(text);
    };
  }
  std::vector<std::string> texts() const {
    const std::lock_guard lock(mutex_);
    return texts_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> texts_;
};

TevAddress address_of(const TevReceiver& receiver) {
  return resolve_tev_address(receiver.address()).value();
}

// The tile has this value in its first channel, and twice that in the second.
Status show(TevSender& sender, const PixelRect& window, float value) {
  return sender.update(window, [window, value](std::vector<float>& planes) {
    planes.assign(std::size_t(window.area()), value);
    planes.resize(2 * planes.size(), 2 * value);
    return ok_status();
  });
}

// Whether the tile, whole, has that value.
bool shows(const TevReceiver::Images& images, const PixelRect& window, float value) {
  const auto image = images.find(kImage.name);
  if (image == images.end() || image->second.height < window.y1) return false;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t at = std::size_t(y) * std::size_t(kImage.width) + std::size_t(x);
      if (image->second.planes[0][at] != value || image->second.planes[1][at] != 2 * value) return false;
    }
  }
  return true;
}

// A port of this machine at which nobody listens.
int free_port() {
  return TevReceiver().port();
}

TEST(TevSender, ShowsTilesTheirNewestStateAndTheBordersOfTheLastUpdate) {
  for (const bool over_tcp : {true, false}) {
    const TemporaryFolder folder;
    const auto receiver = over_tcp ? std::make_unique<TevReceiver>() : std::make_unique<TevReceiver>(folder / "tev");
    Warnings warnings;
    TevSender sender(address_of(*receiver), warnings.take(), kQuick);
    ASSERT_TRUE(sender.begin(kImage));
    ASSERT_TRUE(show(sender, kLeft, 1));
    ASSERT_TRUE(show(sender, kRight, 2));
    ASSERT_TRUE(receiver->wait_for([](const auto& i) { return shows(i, kLeft, 1) && shows(i, kRight, 2); }));
    ASSERT_TRUE(show(sender, kRight, 3));
    ASSERT_TRUE(receiver->wait_for([](const auto& i) {
      return shows(i, kRight, 3) && i.at(kImage.name).drawn.size() == 4 &&
             i.at(kImage.name).drawn[1].numbers == std::vector<float>{32, 0, 32, 32};
    }));
    EXPECT_TRUE(receiver->images().at(kImage.name).grabbed);
    EXPECT_EQ(receiver->images().at(kImage.name).created, 1);
    ASSERT_TRUE(show(sender, kLeft, 4));
    sender.finish();
    ASSERT_TRUE(receiver->wait_for([](const auto& i) { return i.at(kImage.name).drawn.empty(); }));
    EXPECT_TRUE(shows(receiver->images(), kLeft, 4));
    EXPECT_EQ(receiver->errors(), std::vector<std::string>{});
    EXPECT_EQ(warnings.texts(), std::vector<std::string>{});
    const TevReport report = sender.report();
    EXPECT_EQ(report.connections, 1u);
    EXPECT_EQ(report.tiles, 4u);
    EXPECT_EQ(report.warning, "");
  }
}

TEST(TevSender, SendsAtMostAsManyUpdatesASecondAsItIsToldAndSkipsOlderStates) {
  TevReceiver receiver;
  TevTiming timing = kQuick;
  timing.interval_s = 0.1;
  TevSender sender(address_of(receiver), {}, timing);
  ASSERT_TRUE(sender.begin(kImage));
  const double begun_s = now_s();
  float value = 0;
  while (now_s() < begun_s + 1) {
    ASSERT_TRUE(show(sender, kLeft, ++value));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  const double ended_s = now_s();
  sender.finish();
  ASSERT_TRUE(receiver.wait_for([&](const auto& i) { return shows(i, kLeft, value); }));
  EXPECT_GT(value, 20);
  const auto report = sender.report();
  EXPECT_LE(report.updates, 2 + std::uint64_t((ended_s - begun_s) / timing.interval_s));
  EXPECT_GE(report.updates, 3u);
  EXPECT_EQ(report.tiles, report.updates);
}

TEST(TevSender, KeepsAPicturesWorthOfTilesWhateverTheirWindows) {
  auto held = std::make_shared<int>();
  TevSender sender(resolve_tev_address("127.0.0.1:" + std::to_string(free_port())).value(), {}, kQuick);
  ASSERT_TRUE(sender.begin(kImage));
  for (int i = 0; i < 1000; ++i) {
    const int x = i % 33, y = i % 17;
    ASSERT_TRUE(sender.update({x, y, x + 16, y + 8}, [held](std::vector<float>&) { return ok_status(); }));
  }
  // Disjoint windows of 16x8 in 64x32 pixels; and this one.
  EXPECT_LE(held.use_count(), 16 + 1);
}

TEST(TevSender, TilesThatOverlapReplaceOneAnotherAndOthersAreRefused) {
  TevReceiver receiver;
  TevSender sender(address_of(receiver), {}, kQuick);
  EXPECT_FALSE(show(sender, kLeft, 1));  // no image yet
  EXPECT_FALSE(sender.begin({"a", 4, 4, {"0"}}));
  ASSERT_TRUE(sender.begin(kImage));
  EXPECT_FALSE(show(sender, {32, 0, 65, 32}, 1));
  EXPECT_FALSE(show(sender, {3, 3, 3, 4}, 1));
  ASSERT_TRUE(show(sender, {0, 0, 64, 32}, 1));
  ASSERT_TRUE(receiver.wait_for([](const auto& i) { return shows(i, {0, 0, 64, 32}, 1); }));
  ASSERT_TRUE(show(sender, kRight, 2));
  ASSERT_TRUE(receiver.wait_for([](const auto& i) { return shows(i, kLeft, 1) && shows(i, kRight, 2); }));
  // A tile without pixels is left out, and nothing else.
  ASSERT_TRUE(sender.update(kLeft, [](std::vector<float>&) { return Status(Error{ErrorCode::internal, "gone", {}}); }));
  ASSERT_TRUE(show(sender, kRight, 5));
  ASSERT_TRUE(receiver.wait_for([](const auto& i) { return shows(i, kLeft, 1) && shows(i, kRight, 5); }));
  // Another size: the image is made anew.
  TevImage larger = kImage;
  larger.height = 40;
  ASSERT_TRUE(sender.begin(larger));
  ASSERT_TRUE(show(sender, {0, 32, 64, 40}, 6));
  ASSERT_TRUE(receiver.wait_for([](const auto& i) { return shows(i, {0, 32, 64, 40}, 6); }));
  EXPECT_EQ(receiver.images().at(kImage.name).height, 40);
  EXPECT_EQ(receiver.errors(), std::vector<std::string>{});
}

TEST(TevSender, AViewerThatComesLaterGetsAllOfIt) {
  const int port = free_port();
  Warnings warnings;
  TevSender sender(resolve_tev_address("127.0.0.1:" + std::to_string(port)).value(), warnings.take(), kQuick);
  ASSERT_TRUE(sender.begin(kImage));
  ASSERT_TRUE(show(sender, kLeft, 1));
  ASSERT_TRUE(eventually([&] { return warnings.texts().size() == 1; }));
  EXPECT_NE(warnings.texts()[0].find("does not answer (Connection refused); rendering goes on"), std::string::npos)
      << warnings.texts()[0];
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // three tries
  TevReceiver receiver(port);
  ASSERT_TRUE(show(sender, kRight, 2));
  ASSERT_TRUE(receiver.wait_for([](const auto& i) { return shows(i, kLeft, 1) && shows(i, kRight, 2); }));
  sender.finish();
  EXPECT_EQ(warnings.texts().size(), 1u);
  EXPECT_EQ(sender.report().warning, warnings.texts()[0]);
}

TEST(TevSender, AViewerThatGoesAndComesBackGetsAllOfItAgain) {
  auto first = std::make_unique<TevReceiver>();
  const int port = first->port();
  Warnings warnings;
  TevSender sender(address_of(*first), warnings.take(), kQuick);
  ASSERT_TRUE(sender.begin(kImage));
  ASSERT_TRUE(show(sender, kLeft, 1));
  ASSERT_TRUE(first->wait_for([](const auto& i) { return shows(i, kLeft, 1); }));
  first.reset();
  // It is noticed without anything to send.
  ASSERT_TRUE(eventually([&] { return warnings.texts().size() == 1; }));
  EXPECT_NE(warnings.texts()[0].find("has closed the connection; rendering goes on"), std::string::npos)
      << warnings.texts()[0];
  TevReceiver second(port);
  ASSERT_TRUE(show(sender, kRight, 2));
  ASSERT_TRUE(second.wait_for([](const auto& i) { return shows(i, kLeft, 1) && shows(i, kRight, 2); }));
  EXPECT_FALSE(second.images().at(kImage.name).grabbed);  // the focus was taken once
  // Connections that are cut in the middle of what is sent, again and again.
  for (float value = 3; value < 8; ++value) {
    second.cut();
    ASSERT_TRUE(show(sender, kLeft, value));
    ASSERT_TRUE(second.wait_for([&](const auto& i) { return shows(i, kLeft, value) && shows(i, kRight, 2); }));
  }
  EXPECT_EQ(second.errors(), std::vector<std::string>{});
  EXPECT_EQ(warnings.texts().size(), 1u);
  EXPECT_GE(sender.report().connections, 7u);
}

// 16 MiB a picture: more than a connection takes without a reader.
const TevImage kLarge{"large", 2048, 1024, {"R", "G"}};

TEST(TevSender, AViewerThatReadsNothingHoldsNobodyBackAndGetsTheNewestStateInTheEnd) {
  TevReceiver receiver(0, 1 << 16);
  receiver.read(false);
  Warnings warnings;
  TevTiming timing = kQuick;
  timing.finish_s = 20;
  TevSender sender(address_of(receiver), warnings.take(), timing);
  ASSERT_TRUE(sender.begin(kLarge));
  const auto show_large = [&](float value) {
    for (int x = 0; x < kLarge.width; x += 256) ASSERT_TRUE(show(sender, {x, 0, x + 256, kLarge.height}, value));
  };
  double longest_s = 0;
  float value = 0;
  while (warnings.texts().empty()) {
    const double begun_s = now_s();
    show_large(++value);
    longest_s = std::max(longest_s, now_s() - begun_s);
    ASSERT_LT(value, 10000);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_LT(longest_s, 0.25 * kPatience);
  EXPECT_NE(warnings.texts()[0].find("has read nothing for 0.3 s; rendering goes on"), std::string::npos)
      << warnings.texts()[0];
  show_large(++value);
  receiver.read(true);
  sender.finish();
  ASSERT_TRUE(receiver.wait_for([&](const auto& images) {
    const auto found = images.find(kLarge.name);
    if (found == images.end()) return false;
    const auto& plane = found->second.planes[0];
    return std::all_of(plane.begin(), plane.end(), [&](float x) { return x == value; });
  }));
  EXPECT_EQ(receiver.errors(), std::vector<std::string>{});
  EXPECT_EQ(warnings.texts().size(), 1u);
  EXPECT_EQ(sender.report().connections, 1u);
}

// Connections to it are neither taken nor refused.
class FullListener {
 public:
  FullListener() : descriptor_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof name;
    EXPECT_EQ(bind(descriptor_, reinterpret_cast<const sockaddr*>(&name), size), 0);
    EXPECT_EQ(listen(descriptor_, 0), 0);
    EXPECT_EQ(getsockname(descriptor_, reinterpret_cast<sockaddr*>(&name), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(name.sin_port));
    for (int i = 0; i < 4; ++i) {
      waiting_.push_back(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
      static_cast<void>(connect(waiting_.back(), reinterpret_cast<const sockaddr*>(&name), size));
    }
  }
  ~FullListener() {
    for (const int descriptor : waiting_) close(descriptor);
    close(descriptor_);
  }
  const std::string& address() const { return address_; }

 private:
  int descriptor_;
  std::vector<int> waiting_;
  std::string address_;
};

TEST(TevSender, TheEndComesInTimeWhateverTheViewerDoes) {
  TevReceiver blocked(0, 1 << 16);
  blocked.read(false);
  const FullListener full;
  for (const std::string& address : {"127.0.0.1:" + std::to_string(free_port()), full.address(), blocked.address()}) {
    Warnings warnings;
    TevTiming timing = kQuick;
    timing.connect_s = 10;
    TevSender sender(resolve_tev_address(address).value(), warnings.take(), timing);
    ASSERT_TRUE(sender.begin(kLarge));
    for (int x = 0; x < kLarge.width; x += 256) ASSERT_TRUE(show(sender, {x, 0, x + 256, kLarge.height}, 1));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const double begun_s = now_s();
    sender.finish();
    EXPECT_LT(now_s() - begun_s, timing.finish_s + 0.5 * kPatience) << address;
    ASSERT_EQ(warnings.texts().size(), 1u) << address;
    sender.finish();
    EXPECT_TRUE(show(sender, {0, 0, 256, kLarge.height}, 2));  // has no effect
  }
}

// Writing to a connection that is closed raises a signal that ends the process, unless care is taken.
TEST(TevSocket, NeverRaisesABrokenPipe) {
  static std::atomic<int> raised{0};
  struct sigaction before {
  }, counting{};
  counting.sa_handler = [](int) { ++raised; };
  sigaction(SIGPIPE, &counting, &before);
  TevReceiver receiver;
  TevSocket socket;
  const auto patient = [](double) { return true; };
  ASSERT_TRUE(socket.connect(address_of(receiver), patient));
  ASSERT_TRUE(eventually([&] { return receiver.connections() == 1; }));
  receiver.cut();
  const std::string bytes(1 << 20, '\0');
  Status sent = ok_status();
  for (int i = 0; i < 100 && sent; ++i) {
    sent = socket.send(bytes, bytes, patient);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // The first send may be answered by a reset; one more is to a connection that is known to be closed.
  EXPECT_FALSE(sent);
  EXPECT_FALSE(socket.connected());
  sigaction(SIGPIPE, &before, nullptr);
  EXPECT_EQ(raised, 0);
}

}  // namespace
}  // namespace helio::test
