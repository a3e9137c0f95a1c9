#include "bad_clients.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <memory>
#include <random>
#include <thread>
#include <utility>

#include "../service_fixture.h"
#include "../tcp_relay.h"

namespace helio::test {
namespace {

using Random = std::mt19937;

int between(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

void rest(Random& random, int most_ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(between(random, 0, most_ms)));
}

std::unique_ptr<pb::RenderService::Stub> connect_to(const std::string& address) {
  grpc::ChannelArguments own;
  own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  own.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return pb::RenderService::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own));
}

struct BadClient {
  const std::string& address;
  const std::string& scene_id;
  Random random;
  BadDeeds& deeds;

  // Empty where the daemon has no place.
  std::string session(pb::RenderService::Stub& stub, int side) const {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene_id);
    request.mutable_settings()->set_width(side);
    request.mutable_settings()->set_height(side);
    request.set_grace_s(0.5);
    pb::CreateSessionResponse response;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
    return stub.CreateSession(&context, request, &response).ok() ? response.session_id() : std::string();
  }

  // More tiles than a connection holds, of which it takes one.
  void stop_reading() {
    const auto stub = connect_to(address);
    const std::string id = session(*stub, 192);
    if (id.empty()) return rest(random, 100);
    grpc::ClientContext context;
    const auto stream = stub->StreamFrames(&context);
    pb::StreamRequest request;
    request.mutable_open()->set_session_id(id);
    request.mutable_open()->mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
    stream->Write(request);
    *request.mutable_view() = view(1);
    stream->Write(request);
    pb::StreamResponse response;
    if (stream->Read(&response)) ++deeds.streams;
    rest(random, 500);
    context.TryCancel();
    stream->Finish();
  }

  void vanish() {
    TcpRelay relay(address);
    const auto stub = connect_to(relay.address());
    const std::string id = session(*stub, 64);
    if (id.empty()) return rest(random, 100);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
    const auto stream = stub->StreamFrames(&context);
    pb::StreamRequest request;
    request.mutable_open()->set_session_id(id);
    stream->Write(request);
    *request.mutable_view() = view(1);
    stream->Write(request);
    pb::StreamResponse response;
    const int messages = between(random, 1, 10);
    for (int i = 0; i < messages && stream->Read(&response); ++i) deeds.streams += i == 0 ? 1 : 0;
    relay.cut();
    while (stream->Read(&response)) {
    }
    deeds.vanished += stream->Finish().ok() ? 0 : 1;
  }

  std::string noise(int bytes) {
    std::string text(std::size_t(bytes), '\0');
    for (char& c : text) c = char(random());
    return text;
  }

  // Bytes that are no HTTP/2, frames that are none after its preface, and calls whose messages are none.
  void send_rubbish() {
    if (between(random, 0, 1) == 0) {
      static const char* const kMethods[] = {"CreateSession", "LoadScene", "StreamFrames", "RunJob",
                                             "SubmitJob",     "Compare",   "EditScene",    "NoSuchMethod"};
      const std::string method = kRenderService + kMethods[between(random, 0, 7)];
      grpc::ChannelArguments own;
      own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      const auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own);
      std::vector<std::string> messages;
      for (int i = between(random, 1, 3); i > 0; --i) messages.push_back(noise(between(random, 1, 2000)));
      deeds.rubbish += send_raw(channel, method, messages).status.ok() ? 0 : 1;
      return;
    }
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in peer{};
    peer.sin_family = AF_INET;
    peer.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    peer.sin_port = htons(std::uint16_t(std::stoi(address.substr(address.rfind(':') + 1))));
    const timeval patience{5, 0};  // of a daemon that waits for more
    setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (connect(socket, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) == 0) {
      const std::string preface = between(random, 0, 1) == 0 ? "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" : "";
      const std::string bytes = preface + noise(between(random, 1, 4000));
      const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      shutdown(socket, SHUT_WR);
      char answer[4096];
      ssize_t got = sent;
      while (got > 0) got = recv(socket, answer, sizeof answer, 0);
      deeds.rubbish += got == 0 || errno == ECONNRESET ? 1 : 0;
    }
    close(socket);
  }

  // One session, on one stream after the other, of which some are still open when the next comes.
  void reconnect() {
    std::unique_ptr<pb::RenderService::Stub> stub = connect_to(address);
    const std::string id = session(*stub, 48);
    if (id.empty()) return rest(random, 100);
    std::unique_ptr<StreamClient> before;
    const int times = between(random, 2, 6);
    for (int i = 1; i <= times; ++i) {
      auto stream = std::make_unique<StreamClient>(*stub, id);
      stream->send(view(std::uint64_t(i)));
      if (!stream->reader().wait_for([](const auto& message) { return message.has_opened(); })) break;
      ++deeds.streams;
      if (before) deeds.taken_over += before->status().error_code() == grpc::StatusCode::ABORTED ? 1 : 0;
      before.reset();
      if (between(random, 0, 1) == 0) before = std::move(stream);
      rest(random, 30);
    }
  }
};

}  // namespace

void behave_badly(BadHabit habit, const std::string& address, const std::string& scene_id, std::uint32_t seed,
                  const std::atomic<bool>& stop, BadDeeds& deeds) {
  BadClient client{address, scene_id, Random(seed), deeds};
  while (!stop) {
    switch (habit) {
      case BadHabit::stops_reading:
        client.stop_reading();
        break;
      case BadHabit::vanishes:
        client.vanish();
        break;
      case BadHabit::sends_rubbish:
        client.send_rubbish();
        break;
      case BadHabit::reconnects:
        client.reconnect();
        break;
    }
  }
}

}  // namespace helio::test
