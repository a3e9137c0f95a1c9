// Jobs that the daemon keeps: from submission to file.
#include <filesystem>
#include <fstream>
#include <set>

#include "kept_jobs_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
namespace fs = std::filesystem;

// So many samples that no test waits for its end.
constexpr std::uint32_t kNoEnd = 1u << 30;

TEST_F(KeptJobsTest, IsRenderedAndKeptForGetResult) {
  start_daemon();
  const std::string scene = load_scene();
  pb::SubmitJobRequest asked = request(scene, 48, 8);
  asked.set_name("a still");
  asked.mutable_job()->mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  pb::SubmitJobResponse response;
  const grpc::Status status = submit(asked, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_FALSE(response.already_there());
  const std::string id = response.job().job_id();
  const auto told = events(id);
  ASSERT_EQ(told.size(), 3u);
  EXPECT_EQ(told[0].from(), pb::JOB_STATE_UNSPECIFIED);
  EXPECT_EQ(told[0].to(), pb::JOB_STATE_QUEUED);
  EXPECT_EQ(told[1].to(), pb::JOB_STATE_RUNNING);
  EXPECT_EQ(told[2].from(), pb::JOB_STATE_RUNNING);
  EXPECT_EQ(told[2].to(), pb::JOB_STATE_SUCCEEDED);
  EXPECT_LT(told[0].seq(), told[1].seq());
  EXPECT_LT(told[1].seq(), told[2].seq());

  const pb::Job done = job(id);
  EXPECT_EQ(done.name(), "a still");
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.target_state(), pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.settings().roulette_from(), 3);  // complete
  EXPECT_EQ(done.attempt(), 1u);
  EXPECT_TRUE(done.same_bits());
  EXPECT_EQ(done.views_done(), 1u);
  EXPECT_EQ(done.updated_seq(), told[2].seq());
  EXPECT_LE(done.submitted_s(), done.started_s());
  EXPECT_LE(done.started_s(), done.ended_s());
  ASSERT_EQ(done.results_size(), 1);
  EXPECT_EQ(done.results(0).end().reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(done.results(0).end().totals().samples_per_pixel(), 8u);
  EXPECT_TRUE(done.results(0).file().empty());
  EXPECT_FALSE(result(id).empty());

  // The same bits as those of RunJob, whose tiles are 48 x 48 at most here: one file.
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, asked.job());
  pb::RunJobResponse answer;
  std::string tile;
  while (reader->Read(&answer)) {
    if (answer.has_tile()) tile = answer.tile().exr();
  }
  ASSERT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(same_picture(result(id), tile));
}

TEST_F(KeptJobsTest, WritesTheFilesOfAPathUnderAnOutputRoot) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_quad(), 16, 4);
  for (int i = 0; i < 3; ++i) asked.mutable_job()->add_views()->set_scene_camera("front");
  asked.mutable_output()->set_path("walk.{view}.exr");
  const std::string id = submitted(asked);
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  ASSERT_EQ(done.results_size(), 3);
  for (int i = 0; i < 3; ++i) {
    const std::string file = out("walk.000" + std::to_string(i) + ".exr");
    EXPECT_EQ(done.results(i).file(), fs::canonical(file).string());
    EXPECT_TRUE(read_file(file) == result(id, std::uint32_t(i)));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out"), fs::directory_iterator()), 3) << "temporary files";
}

TEST_F(KeptJobsTest, RefusesWhatItCouldNotWrite) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_quad(), 16, 4);
  pb::SubmitJobResponse response;
  const auto refused = [&](const std::string& path, StatusCode code, const std::vector<std::string>& parts) {
    asked.mutable_output()->set_path(path);
    expect_status(submit(asked, &response), code, parts);
  };
  refused("", StatusCode::INVALID_ARGUMENT, {"output.path", "0 bytes"});
  refused("picture.png", StatusCode::INVALID_ARGUMENT, {"output.path", "picture.png", ".exr"});
  refused("../picture.exr", StatusCode::PERMISSION_DENIED, {"output.path", "outside the output roots"});
  refused("/etc/picture.exr", StatusCode::PERMISSION_DENIED, {"output.path", "outside the output roots"});
  refused("nowhere/picture.exr", StatusCode::NOT_FOUND, {"output.path", "no folder", "nowhere"});
  fs::create_directory_symlink("/tmp", out("link"));
  refused("link/picture.exr", StatusCode::PERMISSION_DENIED, {"outside the output roots"});
  write_file(out("there.exr"), "mine");
  refused("there.exr", StatusCode::FAILED_PRECONDITION, {"there.exr", "there already", "overwrite"});
  asked.mutable_job()->add_views()->set_scene_camera("front");
  asked.mutable_job()->add_views()->set_scene_camera("front");
  refused("views.exr", StatusCode::INVALID_ARGUMENT, {"views.exr", "2 views", "{view}"});
  EXPECT_EQ(read_file(out("there.exr")), "mine");
}

TEST_F(KeptJobsTest, NamesAllProblemsOfARequest) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_quad(), 16, 0);
  asked.set_name(std::string(300, 'x'));
  asked.set_client_token("a\nb");
  asked.set_priority(101);
  asked.mutable_job()->set_preview_tiles(true);
  asked.mutable_job()->set_detach(true);
  pb::SubmitJobResponse response;
  expect_status(submit(asked, &response), StatusCode::INVALID_ARGUMENT,
                {"name: 300 bytes", "client_token", "priority: 101", "[-100, 100]", "job.preview_tiles", "job.detach",
                 "job.budget"});
  asked = request("no such scene", 16, 4);
  expect_status(submit(asked, &response), StatusCode::NOT_FOUND, {"job.scene_id"});
  pb::ListJobsRequest list;
  list.set_page_size(1001);
  list.add_states(pb::JobState(9));
  pb::ListJobsResponse listed;
  expect_status(call(&pb::RenderService::Stub::ListJobs, list, &listed), StatusCode::INVALID_ARGUMENT,
                {"page_size: 1001", "states[0]: 9"});
  for (const auto& told : {pause("j-none"), resume("j-none"), cancel("j-none")})
    expect_status(told, StatusCode::NOT_FOUND, {"j-none"});
  std::string file;
  expect_status(fetch("j-none", 0, &file), StatusCode::NOT_FOUND, {"j-none"});
}

TEST_F(KeptJobsTest, AClientTokenAnswersTheSameJob) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_quad(), 16, 4);
  asked.set_client_token("once");
  pb::SubmitJobResponse first, second;
  ASSERT_TRUE(submit(asked, &first).ok());
  ASSERT_TRUE(submit(asked, &second).ok());
  EXPECT_EQ(first.job().job_id(), second.job().job_id());
  EXPECT_TRUE(second.already_there());
  asked.mutable_job()->mutable_budget()->set_samples(5);
  expect_status(submit(asked, &second), StatusCode::INVALID_ARGUMENT, {"client_token"});
}

TEST_F(KeptJobsTest, BeginsByPriorityThenAge) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_quad();
  const std::string first = submitted(request(scene, 16, kNoEnd));
  wait_for(first, pb::JOB_STATE_RUNNING);
  std::vector<std::string> ids;
  for (const int priority : {0, 5, 0, -3}) {
    pb::SubmitJobRequest asked = request(scene, 16, 2);
    asked.set_priority(priority);
    ids.push_back(submitted(asked));
  }
  pb::SetJobPriorityRequest raise;
  raise.set_job_id(ids[3]);
  raise.set_priority(7);
  pb::Job raised;
  ASSERT_TRUE(call(&pb::RenderService::Stub::SetJobPriority, raise, &raised).ok());
  EXPECT_EQ(raised.priority(), 7);
  EXPECT_EQ(job(ids[0]).state(), pb::JOB_STATE_QUEUED);
  ASSERT_TRUE(cancel(first).ok());
  double before = 0;
  for (const int i : {3, 1, 0, 2}) {
    const pb::Job done = wait_for(ids[std::size_t(i)], pb::JOB_STATE_SUCCEEDED);
    EXPECT_GT(done.started_s(), before) << i;
    before = done.started_s();
  }
  EXPECT_EQ(wait_for(first, pb::JOB_STATE_CANCELED).state(), pb::JOB_STATE_CANCELED);
}

// RunJob's and kept ones together are max_jobs.
TEST_F(KeptJobsTest, WaitsForThePlaceOfARunJob) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_quad();
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, request(scene, 16, kNoEnd).job());
  pb::RunJobResponse answer;
  ASSERT_TRUE(reader->Read(&answer));
  const std::string id = submitted(request(scene, 16, 2));
  EXPECT_EQ(job(id).state(), pb::JOB_STATE_QUEUED);
  context.TryCancel();
  EXPECT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
}

TEST_F(KeptJobsTest, PausedGoesOnToTheSameBits) {
  start_daemon();
  const std::string scene = load_scene();
  const std::string whole = submitted(request(scene, 64, 512));
  const std::string id = submitted(request(scene, 64, 512));
  wait_for_samples(id, 2);
  ASSERT_TRUE(pause(id).ok());
  const pb::Job paused = wait_for(id, pb::JOB_STATE_PAUSED);
  ASSERT_EQ(paused.state(), pb::JOB_STATE_PAUSED) << "done before it could pause: " << paused.reason();
  expect_status(pause(id), StatusCode::FAILED_PRECONDITION, {"PAUSED"});
  std::string file;
  expect_status(fetch(id, 0, &file), StatusCode::FAILED_PRECONDITION, {"not done", "PAUSED"});
  ASSERT_TRUE(resume(id).ok());
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempt(), 2u);
  EXPECT_TRUE(done.same_bits());
  EXPECT_EQ(wait_for(whole, pb::JOB_STATE_SUCCEEDED).attempt(), 1u);
  EXPECT_TRUE(result(id) == result(whole)) << "the files differ";
  expect_status(resume(id), StatusCode::FAILED_PRECONDITION, {"SUCCEEDED"});
}

TEST_F(KeptJobsTest, CancelsWhereverItIs) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_quad();
  const std::string running = submitted(request(scene, 16, kNoEnd)), queued = submitted(request(scene, 16, kNoEnd));
  wait_for(running, pb::JOB_STATE_RUNNING);
  ASSERT_TRUE(cancel(queued).ok());
  EXPECT_EQ(job(queued).state(), pb::JOB_STATE_CANCELED);
  ASSERT_TRUE(cancel(running).ok());
  EXPECT_EQ(wait_for(running, pb::JOB_STATE_CANCELED).state(), pb::JOB_STATE_CANCELED);
  expect_status(cancel(running), StatusCode::FAILED_PRECONDITION, {"CANCELED"});
}

// What is in the way when the picture is done pauses the job, which is not rendered again.
TEST_F(KeptJobsTest, PausesWhereItsFileCannotBeWritten) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_scene(), 64, 256);
  asked.mutable_output()->set_path("picture.exr");
  const std::string id = submitted(asked);
  write_file(out("picture.exr"), "somebody else's");
  const pb::Job paused = wait_for(id, pb::JOB_STATE_PAUSED);
  ASSERT_EQ(paused.state(), pb::JOB_STATE_PAUSED) << "done before the file was there: " << paused.reason();
  EXPECT_NE(paused.reason().find("picture.exr"), std::string::npos) << paused.reason();
  EXPECT_NE(paused.reason().find("there already"), std::string::npos) << paused.reason();
  EXPECT_EQ(read_file(out("picture.exr")), "somebody else's");
  // The folder is gone, even.
  fs::remove_all(folder_ / "out");
  ASSERT_TRUE(resume(id).ok());
  const pb::Job again = wait_for(id, pb::JOB_STATE_PAUSED);
  EXPECT_EQ(again.state(), pb::JOB_STATE_PAUSED);
  fs::create_directories(folder_ / "out");
  ASSERT_TRUE(resume(id).ok());
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_TRUE(read_file(out("picture.exr")) == result(id));
}

TEST_F(KeptJobsTest, ListsByPageAndState) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_quad();
  const std::string first = submitted(request(scene, 16, kNoEnd));
  wait_for(first, pb::JOB_STATE_RUNNING);
  std::vector<std::string> ids = {first};
  for (int i = 0; i < 6; ++i) ids.push_back(submitted(request(scene, 16, kNoEnd)));
  ASSERT_TRUE(cancel(ids[6]).ok());
  pb::ListJobsRequest list;
  list.set_page_size(3);
  std::vector<std::string> listed;
  for (;;) {
    pb::ListJobsResponse page;
    ASSERT_TRUE(call(&pb::RenderService::Stub::ListJobs, list, &page).ok());
    EXPECT_EQ(page.total(), 7u);
    EXPECT_LE(page.jobs_size(), 3);
    for (const pb::Job& one : page.jobs()) listed.push_back(one.job_id());
    if (page.next_page_token().empty()) break;
    list.set_page_token(page.next_page_token());
  }
  EXPECT_EQ(listed, std::vector<std::string>(ids.rbegin(), ids.rend()));
  list = {};
  list.add_states(pb::JOB_STATE_RUNNING);
  list.add_states(pb::JOB_STATE_CANCELED);
  pb::ListJobsResponse page;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListJobs, list, &page).ok());
  ASSERT_EQ(page.total(), 2u);
  EXPECT_EQ(page.jobs(0).job_id(), ids[6]);
  EXPECT_EQ(page.jobs(1).job_id(), first);
}

TEST_F(KeptJobsTest, HoldsMaxQueuedJobs) {
  start_daemon([](ServerConfig& config) {
    config.max_jobs = 0;
    config.max_queued_jobs = 2;
  });
  const std::string scene = load_quad();
  submitted(request(scene, 16, 2));
  const std::string second = submitted(request(scene, 16, 2));
  pb::SubmitJobResponse response;
  expect_status(submit(request(scene, 16, 2), &response), StatusCode::RESOURCE_EXHAUSTED, {"max_queued_jobs"});
  ASSERT_TRUE(cancel(second).ok());
  EXPECT_TRUE(submit(request(scene, 16, 2), &response).ok());
}

// A watch that begins at an event is told every one from there on, whoever made it.
TEST_F(KeptJobsTest, AWatchGoesOnFromASequenceNumber) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 0; });
  const std::string scene = load_quad();
  const std::string one = submitted(request(scene, 16, 2)), two = submitted(request(scene, 16, 2));
  grpc::ClientContext context;
  pb::WatchJobRequest watch;
  watch.set_from_seq(job(two).updated_seq());
  auto reader = stub().WatchJob(&context, watch);
  pb::WatchJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  ASSERT_TRUE(response.has_watching());
  EXPECT_EQ(response.watching().next_seq(), job(two).updated_seq() + 1);
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.event().job_id(), two);
  ASSERT_TRUE(pause(one).ok());
  ASSERT_TRUE(cancel(two).ok());
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.event().job_id(), one);
  EXPECT_EQ(response.event().to(), pb::JOB_STATE_PAUSED);
  EXPECT_FALSE(response.event().by().empty());
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.event().job_id(), two);
  EXPECT_EQ(response.event().to(), pb::JOB_STATE_CANCELED);
  context.TryCancel();
  watch.set_from_seq(1000);
  grpc::ClientContext other;
  expect_status(stub().WatchJob(&other, watch)->Finish(), StatusCode::INVALID_ARGUMENT, {"from_seq: 1000"});
}

TEST_F(KeptJobsTest, DetachOutlivesItsCall) {
  start_daemon();
  pb::RunJobRequest asked = request(load_quad(), 16, 64).job();
  asked.set_detach(true);
  std::string id;
  {
    grpc::ClientContext context;
    auto reader = stub().RunJob(&context, asked);
    pb::RunJobResponse response;
    ASSERT_TRUE(reader->Read(&response));
    ASSERT_TRUE(response.has_accepted());
    id = response.accepted().job_id();
    context.TryCancel();
  }
  EXPECT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  grpc::ClientContext context;
  for (int i = 0; i < 2; ++i) asked.add_views()->set_scene_camera("front");
  auto reader = stub().RunJob(&context, asked);
  pb::RunJobResponse response;
  std::vector<pb::RunJobResponse> messages;
  while (reader->Read(&response)) {
    EXPECT_FALSE(response.has_tile());
    if (!response.has_progress()) messages.push_back(response);
  }
  EXPECT_TRUE(reader->Finish().ok());
  ASSERT_EQ(messages.size(), 3u);
  EXPECT_TRUE(messages[0].has_accepted());
  EXPECT_EQ(messages[1].view_result().view(), 0u);
  EXPECT_EQ(messages[2].result().view(), 1u);
  EXPECT_EQ(messages[2].result().end().reason(), pb::END_REASON_SAMPLES);
}

TEST_F(KeptJobsTest, WithoutAStateFolderNothingIsKept) {
  start();
  pb::SubmitJobResponse response;
  expect_status(submit(request(load_quad(), 16, 4), &response), StatusCode::FAILED_PRECONDITION,
                {"keeps no jobs", "--state"});
  pb::GetServerInfoResponse info;
  ASSERT_TRUE(call(&pb::RenderService::Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok());
  EXPECT_FALSE(info.keeps_jobs());
  grpc::ClientContext context;
  expect_status(stub().WatchJob(&context, pb::WatchJobRequest())->Finish(), StatusCode::FAILED_PRECONDITION,
                {"keeps no jobs"});
}

TEST_F(KeptJobsTest, OneDaemonHoldsTheFolder) {
  start_daemon();
  ServerConfig config;
  config.state = folder_ / "state";
  const auto second = Server::start(config);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find(folder_ / "state"), std::string::npos) << second.error().message;
}

}  // namespace
}  // namespace helio::test
