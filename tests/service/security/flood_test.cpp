// Callers that send as much as they can.
#include <grpcpp/generic/generic_stub.h>

#include <fstream>
#include <thread>

#include "daemon_process.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

// So many calls at once on a connection, each with a message of this size, which nobody takes before it is whole.
void flood(const std::string& address, int calls, std::size_t bytes) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  struct Call {
    grpc::ClientContext context;
    grpc::ByteBuffer answer;
    grpc::Status status;
    std::unique_ptr<grpc::GenericClientAsyncResponseReader> reader;
  };
  const grpc::Slice slice(std::string(bytes, '\xff'));
  const grpc::ByteBuffer message(&slice, 1);
  std::vector<std::unique_ptr<Call>> under_way;
  for (int i = 0; i < calls; ++i) {
    auto& call = *under_way.emplace_back(std::make_unique<Call>());
    call.context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    call.reader = stub.PrepareUnaryCall(&call.context, kRenderService + "GetServerInfo", message, &queue);
    call.reader->StartCall();
    call.reader->Finish(&call.answer, &call.status, &call);
  }
  for (int i = 0; i < calls; ++i) {
    void* tag = nullptr;
    bool ok = false;
    if (!queue.Next(&tag, &ok)) return;
    EXPECT_FALSE(static_cast<Call*>(tag)->status.ok()) << "rubbish";
  }
}

TEST(Flood, OfMessagesLeavesTheDaemonItsMemoryAndOthersTheirAnswers) {
  constexpr int kConnections = 4, kCalls = 32, kFloods = 4;
  constexpr std::size_t kMessage = std::size_t(7) << 19;
  DaemonProcess daemon({"--max-rpc-memory", "16777216", "--log-level", "off", "--render-threads", "1"});
  ASSERT_NE(daemon.address(), "");
  const auto asks = [&] {
    const auto stub =
        pb::RenderService::NewStub(grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
    pb::GetServerInfoResponse response;
    return stub->GetServerInfo(&context, pb::GetServerInfoRequest(), &response).ok();
  };
  const auto flood_it = [&] {
    std::vector<std::thread> floods;
    for (int i = 0; i < kConnections; ++i) floods.emplace_back([&] { flood(daemon.address(), kCalls, kMessage); });
    for (std::thread& one : floods) one.join();
    EXPECT_TRUE(asks());
    return daemon.resident_bytes();
  };
  ASSERT_TRUE(asks());
  const std::uint64_t before = daemon.resident_bytes();
  std::uint64_t after = 0;
  for (int i = 0; i < kFloods; ++i) after = flood_it();
  // What the memory allocator holds back for the next time is not given back, so the bound is a share of what was sent.
  constexpr std::uint64_t kSent = std::uint64_t(kMessage) * kConnections * kCalls * kFloods;
  EXPECT_LT(after, before + kSent / 3);
}

}  // namespace
}  // namespace helio::test
