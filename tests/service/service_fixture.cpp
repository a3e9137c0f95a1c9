#include "service_fixture.h"

#include <absl/strings/escaping.h>
#include <grpcpp/generic/generic_stub.h>
#include <spdlog/spdlog.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "renderer/base/clock.h"
#include "renderer/codec/sha256.h"

namespace helio::test {
namespace {

grpc::ByteBuffer to_buffer(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

// Runs the operations of one generic call, in order, on a queue of its own.
class GenericCall {
 public:
  GenericCall(std::shared_ptr<grpc::Channel> channel, const std::string& method) : stub_(channel) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
    call_ = stub_.PrepareCall(&context_, method, &queue_);
    call_->StartCall(this);
    wait();
  }
  bool write(const std::string& message) {
    call_->Write(to_buffer(message), this);
    return wait();
  }
  void writes_done() {
    call_->WritesDone(this);
    wait();
  }
  bool read(std::string& message) {
    grpc::ByteBuffer buffer;
    call_->Read(&buffer, this);
    if (!wait()) return false;
    grpc::Slice slice;
    buffer.DumpToSingleSlice(&slice);
    message.assign(reinterpret_cast<const char*>(slice.begin()), slice.size());
    return true;
  }
  grpc::Status finish() {
    grpc::Status status;
    call_->Finish(&status, this);
    wait();
    return status;
  }

 private:
  bool wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

}  // namespace

std::string quad_gltf(double radiance) {
  const float positions[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
  const std::uint16_t indices[6] = {0, 1, 2, 0, 2, 3};
  std::string buffer(sizeof positions + sizeof indices, '\0');
  std::memcpy(buffer.data(), positions, sizeof positions);
  std::memcpy(buffer.data() + sizeof positions, indices, sizeof indices);
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"mesh": 0}, {"camera": 0, "name": "front", "translation": [0, 0, 3]}],
 "cameras": [{"name": "front", "type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
 "extensionsUsed": ["KHR_materials_emissive_strength"],
 "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
   "emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": )" +
         std::to_string(radiance) + R"(}}}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
   {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
 "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,)" +
         absl::Base64Escape(buffer) + R"("}]})";
}

std::string overflowing_gltf() {
  auto gltf = nlohmann::json::parse(quad_gltf(2));
  gltf["materials"][0]["pbrMetallicRoughness"] = {{"metallicFactor", 1}, {"roughnessFactor", 0.2236}};
  gltf["extensionsUsed"].push_back("KHR_lights_punctual");
  gltf["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"}, {"intensity", 1.2e37}, {"spot", {{"innerConeAngle", 0.08}, {"outerConeAngle", 0.1}}}}};
  gltf["nodes"].push_back(
      {{"translation", {0, 0, 0.2}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  gltf["scenes"][0]["nodes"].push_back(2);
  return gltf.dump();
}

std::string spotlit_mirror_gltf() {
  auto gltf = nlohmann::json::parse(overflowing_gltf());
  gltf["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = 0;
  gltf["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = 1;
  return gltf.dump();
}

std::string sha256_of(const std::string& bytes) {
  Sha256 hash;
  hash.update(bytes);
  const Sha256Digest digest = hash.finish();
  return std::string(digest.begin(), digest.end());
}

pb::LoadSceneRequest Upload::begin() const {
  pb::LoadSceneRequest request;
  request.mutable_begin()->set_main_file(name);
  request.mutable_begin()->set_environment(environment);
  request.mutable_begin()->set_total_bytes(bytes.size());
  request.mutable_begin()->set_time_s(time_s);
  return request;
}

pb::LoadSceneRequest Upload::begin_file() const {
  pb::LoadSceneRequest request;
  request.mutable_begin_file()->set_name(name);
  request.mutable_begin_file()->set_bytes(bytes.size());
  request.mutable_begin_file()->set_sha256(sha256_of(bytes));
  return request;
}

pb::LoadSceneRequest Upload::data() const {
  pb::LoadSceneRequest request;
  request.set_data(bytes);
  return request;
}

pb::View view(std::uint64_t id, double x) {
  pb::View view;
  view.set_id(id);
  pb::CameraView& camera = *view.mutable_camera();
  camera.mutable_position()->set_x(x);
  camera.mutable_position()->set_z(3);
  camera.mutable_look_at()->mutable_target();
  return view;
}

// ---- StreamReader --------------------------------------------------------------------------------------------------

StreamReader::~StreamReader() {
  if (thread_.joinable()) thread_.join();
}

void StreamReader::start(Read read) {
  thread_ = std::thread([this, read = std::move(read)] {
    pb::StreamResponse response;
    while (read(&response)) {
      const std::lock_guard lock(mutex_);
      messages_.push_back(std::move(response));
      times_.push_back(now_s());
      arrived_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    over_ = true;
    arrived_.notify_all();
  });
}

bool StreamReader::wait_for(const std::function<bool(const pb::StreamResponse&)>& wanted, int n) {
  std::unique_lock lock(mutex_);
  std::size_t looked_at = 0;
  int found = 0;
  const auto look = [&] {
    for (; looked_at < messages_.size() && found < n; ++looked_at) found += wanted(messages_[looked_at]);
    return found >= n || over_;
  };
  arrived_.wait_for(lock, std::chrono::seconds(60 * kPatience), look);
  return found >= n;
}

bool StreamReader::wait_for_frame_end(std::uint64_t view_id) {
  return wait_for([&](const auto& m) { return m.has_frame_end() && m.frame_end().tag().view_id() == view_id; });
}

bool StreamReader::wait_for_tiles(int n) {
  return wait_for([](const auto& m) { return m.has_tile(); }, n);
}

void StreamReader::wait_for_end() {
  std::unique_lock lock(mutex_);
  EXPECT_TRUE(arrived_.wait_for(lock, std::chrono::seconds(60 * kPatience), [&] { return over_; }))
      << "the stream did not end";
}

std::vector<pb::StreamResponse> StreamReader::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

std::vector<double> StreamReader::times() const {
  const std::lock_guard lock(mutex_);
  return times_;
}

// ---- StreamClient --------------------------------------------------------------------------------------------------

StreamClient::StreamClient(pb::RenderService::Stub& stub) {
  context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(120 * kPatience));
  stream_ = stub.StreamFrames(&context_);
}

StreamClient::StreamClient(pb::RenderService::Stub& stub, const std::string& session_id, bool read)
    : StreamClient(stub) {
  pb::StreamRequest open;
  open.mutable_open()->set_session_id(session_id);
  send(open);
  if (read) start_reading();
}

StreamClient::~StreamClient() {
  if (!finished_) {
    context_.TryCancel();
    status();
  }
}

bool StreamClient::send(const pb::View& view) {
  pb::StreamRequest request;
  *request.mutable_view() = view;
  return send(request);
}

bool StreamClient::send(const pb::Budget& budget) {
  pb::StreamRequest request;
  *request.mutable_budget() = budget;
  return send(request);
}

void StreamClient::start_reading() {
  reading_ = true;
  reader_.start([this](pb::StreamResponse* response) { return stream_->Read(response); });
}

grpc::Status StreamClient::status() {
  if (!finished_) {
    if (!reading_) start_reading();
    reader_.wait_for_end();
    status_ = stream_->Finish();
    finished_ = true;
  }
  return status_;
}

// ---- ServiceTest ---------------------------------------------------------------------------------------------------

void ServiceTest::start(const std::function<void(ServerConfig&)>& change) {
  spdlog::set_level(spdlog::level::warn);
  ServerConfig config;
  config.render_threads = 2;
  config.max_memory = 1ull << 30;
  if (change) change(config);
  auto server = Server::start(config);
  ASSERT_TRUE(server.ok()) << server.error().to_string();
  server_ = std::move(*server);
  if (server_->address().empty()) return;
  // A connection that fails for a reason that does not last is tried again; calls would fail with it.
  const std::shared_ptr<grpc::Channel> channel = new_channel();
  ASSERT_TRUE(channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::seconds(60)));
  stub_ = pb::RenderService::NewStub(channel);
}

void ServiceTest::TearDown() {
  stub_.reset();
  server_.reset();
}

std::shared_ptr<grpc::Channel> ServiceTest::new_channel() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a connection of its own
  return grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments);
}

grpc::Status ServiceTest::load(const std::vector<pb::LoadSceneRequest>& messages, pb::LoadSceneResponse* response) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
  auto writer = stub().LoadScene(&context, response);
  for (const auto& message : messages) {
    if (!writer->Write(message)) break;
  }
  writer->WritesDone();
  return writer->Finish();
}

std::string ServiceTest::load_quad(double radiance) {
  Upload upload;
  upload.bytes = quad_gltf(radiance);
  pb::LoadSceneResponse response;
  const grpc::Status status = load(upload.messages(), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.scene().scene_id();
}

grpc::Status ServiceTest::create(const pb::CreateSessionRequest& request, pb::CreateSessionResponse* response) {
  return call(&pb::RenderService::Stub::CreateSession, request, response);
}

std::string ServiceTest::create_session(const std::string& scene_id, int width, int height, std::uint32_t samples,
                                        double grace_s) {
  pb::CreateSessionRequest request;
  request.set_scene_id(scene_id);
  request.mutable_settings()->set_width(width);
  request.mutable_settings()->set_height(height);
  request.mutable_budget()->set_samples(samples);
  request.set_grace_s(grace_s);
  pb::CreateSessionResponse response;
  const grpc::Status status = create(request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.session_id();
}

pb::SessionInfo ServiceTest::session_info(const std::string& session_id) {
  pb::ListSessionsResponse list;
  EXPECT_TRUE(call(&pb::RenderService::Stub::ListSessions, pb::ListSessionsRequest(), &list).ok());
  for (const auto& session : list.sessions()) {
    if (session.session_id() == session_id) return session;
  }
  return {};
}

bool ServiceTest::comes_to_rest(const std::string& session_id) {
  return eventually([&] {
    const double used = session_info(session_id).used_seconds();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return session_info(session_id).used_seconds() == used;
  });
}

void expect_status(const grpc::Status& status, grpc::StatusCode code, const std::vector<std::string>& parts) {
  EXPECT_EQ(status.error_code(), code) << status.error_message();
  for (const std::string& part : parts) {
    EXPECT_NE(status.error_message().find(part), std::string::npos)
        << "'" << part << "' in: " << status.error_message();
  }
}

bool eventually(const std::function<bool()>& condition) {
  const double deadline = now_s() + 60 * kPatience;
  while (!condition()) {
    if (now_s() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

RawAnswer send_raw(std::shared_ptr<grpc::Channel> channel, const std::string& method,
                   const std::vector<std::string>& messages) {
  GenericCall call(channel, method);
  for (const std::string& message : messages) {
    if (!call.write(message)) break;
  }
  call.writes_done();
  RawAnswer answer;
  std::string message;
  while (call.read(message)) answer.messages.push_back(message);
  answer.status = call.finish();
  return answer;
}

}  // namespace helio::test
