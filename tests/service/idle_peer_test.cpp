// Peers that connect and then do nothing: what they hold ends by itself and is bounded.
#include <future>

#include "renderer/base/clock.h"
#include "server/base/timer_queue.h"
#include "server/rpc/read_deadline.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class IdlePeerTest : public ServiceTest {
 protected:
  // A LoadScene call whose client sends these messages and then nothing, not even the end.
  grpc::Status stalled_load(const std::vector<pb::LoadSceneRequest>& messages) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    pb::LoadSceneResponse response;
    const auto writer = stub().LoadScene(&context, &response);
    for (const auto& message : messages) writer->Write(message);
    return writer->Finish();
  }
};

TEST_F(IdlePeerTest, AStreamWithoutOpenEnds) {
  start([](ServerConfig& config) { config.request_timeout_s = 0.2; });
  StreamClient idle(stub());
  expect_status(idle.status(), StatusCode::DEADLINE_EXCEEDED,
                {"the stream sent no open within 0.2 s (request-timeout)"});
}

TEST_F(IdlePeerTest, AStreamThatIsOpenOutlivesTheLimit) {
  start([](ServerConfig& config) { config.request_timeout_s = 3 + kPatience; });
  const std::string session = create_session(load_quad(), 8, 8, 1);
  StreamClient open(stub(), session);
  ASSERT_TRUE(open.reader().wait_for([](const auto& m) { return m.has_opened(); }));
  // It came later and so ends after the limit of the one that is open.
  StreamClient idle(stub());
  EXPECT_EQ(idle.status().error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(session_info(session).attached());
  open.send(view(1));
  EXPECT_TRUE(open.reader().wait_for_frame_end(1));
}

TEST_F(IdlePeerTest, AnUploadThatStallsEndsAndGivesItsMemoryBack) {
  start([](ServerConfig& config) {
    config.request_timeout_s = 0.2;
    config.max_memory = 32 << 20;
  });
  Upload upload;
  upload.bytes += std::string(20 << 20, ' ');
  expect_status(stalled_load({}), StatusCode::DEADLINE_EXCEEDED, {"did not come within 0.2 s (request-timeout)"});
  // Each of more than half the memory: a second one begins only when the first has given it back.
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(eventually([&] {
      return stalled_load({upload.begin(), upload.begin_file()}).error_code() == StatusCode::DEADLINE_EXCEEDED;
    }));
  }
}

TEST_F(IdlePeerTest, AConnectionHasAsManyCallsAsTheLimitSays) {
  start([](ServerConfig& config) { config.max_streams = 2; });
  const std::string session = create_session(load_quad(), 8, 8, 1);
  const auto limited = new_stub();
  const auto ask = [&](std::chrono::milliseconds patience) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    pb::GetServerInfoResponse response;
    return limited->GetServerInfo(&context, pb::GetServerInfoRequest(), &response).error_code();
  };
  EXPECT_EQ(ask(std::chrono::seconds(60)), StatusCode::OK);
  {
    StreamClient open(*limited, session), idle(*limited);
    ASSERT_TRUE(open.reader().wait_for([](const auto& m) { return m.has_opened(); }));
    idle.start_reading();
    // gRPC's client holds the call back until a stream is free.
    EXPECT_EQ(ask(std::chrono::milliseconds(300)), StatusCode::DEADLINE_EXCEEDED);
    grpc::ClientContext context;
    pb::GetServerInfoResponse response;
    EXPECT_TRUE(new_stub()->GetServerInfo(&context, pb::GetServerInfoRequest(), &response).ok()) << "another connection";
  }
  EXPECT_EQ(ask(std::chrono::seconds(60)), StatusCode::OK);
}

TEST(TimerQueueCancel, DropsWhatWaits) {
  TimerQueue timers;
  std::promise<void> last;
  std::atomic<int> calls{0};
  const auto token = std::make_shared<int>(0);
  const TimerQueue::Id dropped = timers.call_at(1e9, [&calls, token] { ++calls; });
  EXPECT_EQ(token.use_count(), 2);
  timers.cancel(dropped);
  EXPECT_EQ(token.use_count(), 1) << "what the function held is free at once";
  timers.call_at(0, [&] { last.set_value(); });
  last.get_future().wait();
  EXPECT_EQ(calls, 0);
  timers.cancel(dropped);  // of one that is gone: nothing
}

TEST(ReadDeadline, OnlyOneOfStopAndExpiryHappens) {
  TimerQueue timers;
  std::atomic<int> expired{0};
  int stopped = 0;
  for (int i = 0; i < 200; ++i) {
    ReadDeadline deadline(timers, 1e-5 * (i % 20), [&] { ++expired; });
    deadline.start();
    std::this_thread::yield();
    stopped += deadline.stop();
  }
  std::promise<void> done;
  timers.call_at(now_s(), [&] { done.set_value(); });
  done.get_future().wait();
  EXPECT_EQ(stopped + expired, 200);
}

}  // namespace
}  // namespace helio::test
