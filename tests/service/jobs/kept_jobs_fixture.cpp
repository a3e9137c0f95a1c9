#include "kept_jobs_fixture.h"

#include <cstring>
#include <filesystem>

#include "renderer/codec/sha256.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {

void KeptJobsTest::start_daemon(const std::function<void(ServerConfig&)>& change) {
  std::filesystem::create_directories(folder_ / "out");
  start([&](ServerConfig& config) {
    config.state = folder_ / "state";
    config.output_roots = {folder_ / "out"};
    config.scene_roots = {folder_.path()};
    if (change) change(config);
  });
}

void KeptJobsTest::restart(double grace_s, const std::function<void(ServerConfig&)>& change) {
  server_->drain(grace_s);
  stub_.reset();
  server_.reset();
  start_daemon(change);
}

std::string KeptJobsTest::load_scene(const std::string& name) {
  Upload upload;
  upload.name = name + ".gltf";
  upload.bytes = read_file(std::string(HELIO_SOURCE_DIR) + "/scenes/" + name + "/" + name + ".gltf");
  upload.environment = "";
  pb::LoadSceneResponse response;
  const grpc::Status status = load(upload.messages(), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.scene().scene_id();
}

pb::SubmitJobRequest KeptJobsTest::request(const std::string& scene_id, int size, std::uint32_t samples) const {
  pb::SubmitJobRequest request;
  request.mutable_job()->set_scene_id(scene_id);
  request.mutable_job()->mutable_settings()->set_width(size);
  request.mutable_job()->mutable_settings()->set_height(size);
  request.mutable_job()->mutable_budget()->set_samples(samples);
  return request;
}

grpc::Status KeptJobsTest::submit(const pb::SubmitJobRequest& request, pb::SubmitJobResponse* response) {
  return call(&pb::RenderService::Stub::SubmitJob, request, response);
}

std::string KeptJobsTest::submitted(const pb::SubmitJobRequest& request) {
  pb::SubmitJobResponse response;
  const grpc::Status status = submit(request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.job().job_id();
}

pb::Job KeptJobsTest::job(const std::string& id) {
  pb::GetJobRequest request;
  request.set_job_id(id);
  pb::Job job;
  const grpc::Status status = call(&pb::RenderService::Stub::GetJob, request, &job);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return job;
}

pb::Job KeptJobsTest::wait_for(const std::string& id, pb::JobState state) {
  grpc::ClientContext context;
  pb::WatchJobRequest request;
  request.set_job_id(id);
  request.set_from_seq(1);
  auto reader = stub().WatchJob(&context, request);
  pb::WatchJobResponse response;
  while (reader->Read(&response)) {
    const pb::Job now = job(id);
    if (now.state() != state && now.state() < pb::JOB_STATE_SUCCEEDED) continue;
    context.TryCancel();
    return now;
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return job(id);
}

void KeptJobsTest::wait_for_samples(const std::string& id, std::uint32_t samples) {
  grpc::ClientContext context;
  pb::WatchJobRequest request;
  request.set_job_id(id);
  request.set_progress(true);
  auto reader = stub().WatchJob(&context, request);
  pb::WatchJobResponse response;
  while (reader->Read(&response)) {
    if (response.has_event() && response.event().to() == pb::JOB_STATE_RUNNING) continue;
    if (response.has_event()) return;
    const pb::Job& now = response.has_watching() ? response.watching().job() : response.progress();
    if (now.progress().samples_per_pixel() >= samples) return context.TryCancel();
  }
}

grpc::Status KeptJobsTest::pause(const std::string& id) {
  pb::PauseJobRequest request;
  request.set_job_id(id);
  pb::Job answer;
  return call(&pb::RenderService::Stub::PauseJob, request, &answer);
}

grpc::Status KeptJobsTest::resume(const std::string& id) {
  pb::ResumeJobRequest request;
  request.set_job_id(id);
  pb::Job answer;
  return call(&pb::RenderService::Stub::ResumeJob, request, &answer);
}

grpc::Status KeptJobsTest::cancel(const std::string& id) {
  pb::CancelJobRequest request;
  request.set_job_id(id);
  pb::CancelJobResponse answer;
  return call(&pb::RenderService::Stub::CancelJob, request, &answer);
}

std::vector<pb::JobEvent> KeptJobsTest::events(const std::string& id) {
  grpc::ClientContext context;
  pb::WatchJobRequest request;
  request.set_job_id(id);
  request.set_from_seq(1);
  auto reader = stub().WatchJob(&context, request);
  std::vector<pb::JobEvent> events;
  pb::WatchJobResponse response;
  while (reader->Read(&response)) {
    if (response.has_event()) events.push_back(response.event());
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return events;
}

grpc::Status KeptJobsTest::fetch(const std::string& id, std::uint32_t view, std::string* file) {
  grpc::ClientContext context;
  pb::GetResultRequest request;
  request.set_job_id(id);
  request.set_view(view);
  auto reader = stub().GetResult(&context, request);
  pb::GetResultResponse response;
  pb::JobView begin;
  while (reader->Read(&response)) {
    if (response.has_begin()) begin = response.begin();
    *file += response.data();
  }
  const grpc::Status status = reader->Finish();
  if (!status.ok()) return status;
  EXPECT_EQ(begin.bytes(), file->size());
  const std::string digest = sha256_of(*file);
  EXPECT_EQ(begin.sha256(), to_hex({reinterpret_cast<const std::uint8_t*>(digest.data()), digest.size()}));
  return status;
}

std::string KeptJobsTest::result(const std::string& id, std::uint32_t view) {
  std::string file;
  const grpc::Status status = fetch(id, view, &file);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return file;
}

bool same_picture(const std::string& a, const std::string& b) {
  const auto decode = [](const std::string& file) {
    return decode_tile({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()}, 1 << 24);
  };
  const auto left = decode(a), right = decode(b);
  if (!left || !right || left->names != right->names || left->channels.size() != right->channels.size()) return false;
  for (std::size_t i = 0; i < left->channels.size(); ++i) {
    const auto &x = left->channels[i], &y = right->channels[i];
    if (x.size() != y.size() || std::memcmp(x.data(), y.data(), x.size() * sizeof(float)) != 0) return false;
  }
  return true;
}

}  // namespace helio::test
