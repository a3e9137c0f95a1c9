// A daemon in the test's process, on a loopback port, and clients that talk to it by plain gRPC.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "heliograph/v1/render_service.grpc.pb.h"
#include "server/app/server.h"

namespace helio::test {

namespace pb = heliograph::v1;

// A camera named "front" looks along -z from (0, 0, 3) at a 2x2 square at the origin that emits `radiance` towards +z.
// Without bounces, every pixel that sees the square is exactly `radiance`.
std::string quad_gltf(double radiance = 1);
// The square of radiance 2, a rough mirror, with a spotlight before its middle that irradiates a disk of radius 0.02 by
// 3e38, the most that a float holds: the mirror's lobe makes more of it, and most samples that see the disk are infinite.
std::string overflowing_gltf();
// The square of radiance 2, a smooth mirror, with a spotlight before it.
std::string spotlit_mirror_gltf();

// One file as LoadScene takes it. Each field can be made wrong.
struct Upload {
  std::string name = "quad.gltf";
  std::string bytes = quad_gltf();
  std::string environment = "0,0,0";
  double time_s = 0;

  pb::LoadSceneRequest begin() const;
  pb::LoadSceneRequest begin_file() const;
  pb::LoadSceneRequest data() const;
  std::vector<pb::LoadSceneRequest> messages() const { return {begin(), begin_file(), data()}; }
};

std::string sha256_of(const std::string& bytes);

// Looks at the square from (x, 0, 3).
pb::View view(std::uint64_t id, double x = 0);

// What a stream got, as it came. Reads on a thread of its own unless told to wait.
class StreamReader {
 public:
  using Read = std::function<bool(pb::StreamResponse*)>;

  ~StreamReader();
  void start(Read read);
  // Waits until a message (the n-th, counted from 1) satisfies `wanted`, or the stream has ended; false after a minute.
  bool wait_for(const std::function<bool(const pb::StreamResponse&)>& wanted, int n = 1);
  bool wait_for_frame_end(std::uint64_t view_id);
  bool wait_for_tiles(int n);
  void wait_for_end();  // of the stream
  std::vector<pb::StreamResponse> messages() const;
  // Time of each message, now_s().
  std::vector<double> times() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<pb::StreamResponse> messages_;
  std::vector<double> times_;
  bool over_ = false;
  std::thread thread_;
};

// StreamFrames from the client's side.
class StreamClient {
 public:
  explicit StreamClient(pb::RenderService::Stub& stub);
  // Opens; with `read` false nothing is read until start_reading().
  StreamClient(pb::RenderService::Stub& stub, const std::string& session_id, bool read = true);
  ~StreamClient();

  bool send(const pb::StreamRequest& request) { return stream_->Write(request); }
  bool send(const pb::View& view);
  bool send(const pb::Budget& budget);
  void start_reading();
  void half_close() { stream_->WritesDone(); }
  void cancel() { context_.TryCancel(); }
  // Status after the stream has ended.
  grpc::Status status();
  StreamReader& reader() { return reader_; }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<pb::StreamRequest, pb::StreamResponse>> stream_;
  StreamReader reader_;
  bool reading_ = false, finished_ = false;
  grpc::Status status_;
};

class ServiceTest : public testing::Test {
 protected:
  // Starts with two render threads on a free port; `change` may set limits.
  void start(const std::function<void(ServerConfig&)>& change = {});
  void TearDown() override;

  pb::RenderService::Stub& stub() { return *stub_; }
  std::shared_ptr<grpc::Channel> new_channel() const;
  std::unique_ptr<pb::RenderService::Stub> new_stub() const { return pb::RenderService::NewStub(new_channel()); }

  grpc::Status load(const std::vector<pb::LoadSceneRequest>& messages, pb::LoadSceneResponse* response);
  // Loads the square and returns its id.
  std::string load_quad(double radiance = 1);
  grpc::Status create(const pb::CreateSessionRequest& request, pb::CreateSessionResponse* response);
  // A session of width x height with this many samples as its budget (0: unlimited).
  std::string create_session(const std::string& scene_id, int width, int height, std::uint32_t samples = 0,
                             double grace_s = 0);
  pb::SessionInfo session_info(const std::string& session_id);  // empty when there is none
  // True once the session does no work for a tenth of a second; false when it goes on and on.
  bool comes_to_rest(const std::string& session_id);

  // Calls a unary method.
  template <class Request, class Response>
  grpc::Status call(grpc::Status (pb::RenderService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    return (stub().*method)(&context, request, response);
  }

  std::unique_ptr<Server> server_;
  std::unique_ptr<pb::RenderService::Stub> stub_;
};

// The status has this code and its message contains each of the parts.
void expect_status(const grpc::Status& status, grpc::StatusCode code, const std::vector<std::string>& parts);

// By how much longer than usual a test waits: the thread sanitizer slows code down five to fifteen times.
#ifdef __SANITIZE_THREAD__
inline constexpr int kPatience = 10;
#else
inline constexpr int kPatience = 1;
#endif

// Polls until true; false after a minute, which ends a hang and asserts nothing about time.
bool eventually(const std::function<bool()>& condition);

// Sends bytes as they are to any method ("/package.Service/Method"), half-closes, and takes what comes.
struct RawAnswer {
  std::vector<std::string> messages;
  grpc::Status status;
};
RawAnswer send_raw(std::shared_ptr<grpc::Channel> channel, const std::string& method,
                   const std::vector<std::string>& messages);
inline const std::string kRenderService = "/heliograph.v1.RenderService/";

}  // namespace helio::test
