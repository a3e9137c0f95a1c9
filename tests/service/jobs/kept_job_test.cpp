// Jobs that the daemon keeps: from submission to file.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "kept_jobs_fixture.h"
#include "renderer/codec/checksum.h"
#include "renderer/codec/tile_codec.h"

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

// Who asks again gets the job, whatever has become of its scene meanwhile.
TEST_F(KeptJobsTest, AClientTokenOutlivesItsScene) {
  start_daemon();
  const std::string scene = load_quad();
  pb::SubmitJobRequest asked = request(scene, 16, 4);
  asked.set_client_token("once");
  const std::string id = submitted(asked);
  ASSERT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  pb::UnloadSceneRequest unload;
  unload.set_scene_id(scene);
  pb::UnloadSceneResponse unloaded;
  ASSERT_TRUE(eventually([&] { return call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded).ok(); }));
  pb::SubmitJobResponse again;
  const grpc::Status status = submit(asked, &again);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(again.job().job_id(), id);
  EXPECT_TRUE(again.already_there());
}

TEST_F(KeptJobsTest, IsForgottenOnceItsDaysAreOver) {
  start_daemon();
  const std::string id = submitted(request(load_quad(), 16, 4));
  ASSERT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  restart(10, [](ServerConfig& config) { config.keep_jobs_days = 1; });
  pb::GetJobRequest get;
  get.set_job_id(id);
  pb::Job known;
  const auto is_known = [&] { return call(&pb::RenderService::Stub::GetJob, get, &known).ok(); };
  // The first look comes before the first job begins.
  wait_for(submitted(request(load_quad(), 16, 4)), pb::JOB_STATE_SUCCEEDED);
  EXPECT_TRUE(is_known());
  EXPECT_TRUE(fs::exists(folder_ / ("state/results/" + id + "/0.exr")));
  restart(10, [](ServerConfig& config) { config.keep_jobs_days = 1e-7; });
  EXPECT_TRUE(eventually([&] { return !is_known(); }));
  EXPECT_TRUE(eventually([&] { return !fs::exists(folder_ / ("state/results/" + id)); }));
}

TEST_F(KeptJobsTest, TheOldestIsForgottenWhereTooManyHaveEnded) {
  start_daemon();
  const std::string scene = load_quad();
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) {
    ids.push_back(submitted(request(scene, 16, 4)));
    ASSERT_EQ(wait_for(ids.back(), pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  }
  restart(10, [](ServerConfig& config) {
    config.max_ended_jobs = 2;
    config.max_state_result_bytes = 1;  // but for the newest
  });
  const auto folders = [&] {
    return std::distance(fs::directory_iterator(folder_ / "state/results"), fs::directory_iterator());
  };
  EXPECT_TRUE(eventually([&] { return folders() == 1; }));
  EXPECT_TRUE(fs::exists(folder_ / ("state/results/" + ids[2] + "/0.exr")));
  pb::GetJobRequest get;
  get.set_job_id(ids[1]);
  pb::Job known;
  expect_status(call(&pb::RenderService::Stub::GetJob, get, &known), StatusCode::NOT_FOUND, {ids[1]});
}

// The views of a long path are kept apart from what lists tell.
TEST_F(KeptJobsTest, ALongPathGoesOnAfterARestart) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_quad();
  const std::string before = submitted(request(scene, 16, kNoEnd));
  wait_for(before, pb::JOB_STATE_RUNNING);
  pb::SubmitJobRequest asked = request(scene, 16, 2);
  asked.set_client_token("path");
  for (int i = 0; i < 40; ++i) {
    pb::CameraView& view = *asked.mutable_job()->add_views();
    view.mutable_position()->set_z(2 + 0.1 * i);
    view.mutable_look_at()->mutable_target();
  }
  const std::string id = submitted(asked);
  EXPECT_EQ(job(id).settings().width(), 16u);
  restart();
  pb::SubmitJobResponse again;
  ASSERT_TRUE(submit(asked, &again).ok());
  EXPECT_TRUE(again.already_there());
  ASSERT_TRUE(cancel(before).ok());
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  ASSERT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_EQ(done.views_done(), 40u);
  std::string nearest, farthest;
  ASSERT_TRUE(fetch(id, 0, &nearest).ok() && fetch(id, 39, &farthest).ok());
  EXPECT_NE(nearest, farthest);
  ASSERT_TRUE(submit(asked, &again).ok()) << "at its end the request is known by its hash";
  EXPECT_TRUE(again.already_there());
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

// ---- GetResult as tiles

struct Tiles {
  pb::JobView view;
  std::vector<pb::Tile> tiles;
  grpc::Status status;
};

class JobTilesTest : public KeptJobsTest {
 protected:
  Tiles tiles(const std::string& id, const std::function<void(pb::GetResultRequest&)>& change = {}) {
    pb::GetResultRequest request;
    request.set_job_id(id);
    request.mutable_tiles()->mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
    if (change) change(request);
    grpc::ClientContext context;
    auto reader = stub().GetResult(&context, request);
    pb::GetResultResponse response;
    Tiles got;
    while (reader->Read(&response)) {
      if (response.has_begin()) got.view = response.begin();
      if (response.has_tile()) got.tiles.push_back(response.tile());
      EXPECT_FALSE(response.response_case() == pb::GetResultResponse::kData);
    }
    got.status = reader->Finish();
    return got;
  }
  static Result<DecodedTile> decoded(const std::string& exr) {
    return decode_tile({reinterpret_cast<const std::uint8_t*>(exr.data()), exr.size()}, 1 << 24);
  }
  // Every pixel of a tile is that of the picture.
  static void expect_part(const pb::Tile& tile, const DecodedTile& whole) {
    EXPECT_EQ(crc32_of(reinterpret_cast<const std::uint8_t*>(tile.exr().data()), tile.exr().size()), tile.crc32());
    const auto part = decoded(tile.exr());
    ASSERT_TRUE(part.ok()) << part.error().to_string();
    const PixelRect& w = part->header.data_window;
    const PixelRect told{tile.window().x0(), tile.window().y0(), tile.window().x1(), tile.window().y1()};
    EXPECT_TRUE(w == told);
    EXPECT_LE(std::max(w.width(), w.height()), 128);
    for (std::size_t c = 0; c < part->names.size(); ++c) {
      const auto* from = whole.find(part->names[c]);
      ASSERT_TRUE(from) << part->names[c];
      std::size_t wrong = 0;
      for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
          const float a = part->channels[c][std::size_t((y - w.y0) * w.width() + x - w.x0)];
          const PixelRect& all = whole.header.data_window;
          const float b = (*from)[std::size_t((y - all.y0) * all.width() + x - all.x0)];
          wrong += !(a == b || (std::isnan(a) && std::isnan(b)));
        }
      }
      EXPECT_EQ(wrong, 0u) << part->names[c];
    }
  }
};

TEST_F(JobTilesTest, OfAViewThatIsDoneHaveThePixelsOfItsFile) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_scene(), 200, 2);
  asked.mutable_job()->mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  asked.mutable_job()->mutable_settings()->mutable_region()->set_x0(5);
  asked.mutable_job()->mutable_settings()->mutable_region()->set_x1(200);
  asked.mutable_job()->mutable_settings()->mutable_region()->set_y1(150);
  const std::string id = submitted(asked);
  ASSERT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  const auto whole = decoded(result(id));
  ASSERT_TRUE(whole.ok());
  const Tiles all = tiles(id);
  ASSERT_TRUE(all.status.ok()) << all.status.error_message();
  EXPECT_EQ(all.view.sha256(), job(id).results(0).sha256());
  EXPECT_EQ(all.view.end().reason(), pb::END_REASON_SAMPLES);
  ASSERT_EQ(all.tiles.size(), 4u);
  std::int64_t area = 0;
  for (const pb::Tile& tile : all.tiles) {
    expect_part(tile, *whole);
    EXPECT_TRUE(tile.final());
    EXPECT_EQ(tile.samples_per_pixel(), 2u);
    area += std::int64_t(tile.window().x1() - tile.window().x0()) * (tile.window().y1() - tile.window().y0());
  }
  EXPECT_EQ(area, 195 * 150);

  const Tiles part = tiles(id, [](pb::GetResultRequest& request) {
    pb::Rect& window = *request.mutable_tiles()->mutable_window();
    window.set_x0(120), window.set_y0(7), window.set_x1(140), window.set_y1(9);
    request.mutable_tiles()->mutable_format()->set_without_variance(true);
    request.mutable_tiles()->mutable_format()->set_depth(true);  // which the file has not
    request.mutable_tiles()->mutable_format()->set_compression(pb::COMPRESSION_ZIP);
  });
  ASSERT_TRUE(part.status.ok()) << part.status.error_message();
  ASSERT_EQ(part.tiles.size(), 2u);
  for (const pb::Tile& tile : part.tiles) expect_part(tile, *whole);
  EXPECT_EQ(decoded(part.tiles[0].exr())->names.size(), 4u);  // R, G, B, samples

  const auto refused = [&](int x0, int y0, int x1, int y1) {
    return tiles(id, [&](pb::GetResultRequest& request) {
             pb::Rect& window = *request.mutable_tiles()->mutable_window();
             window.set_x0(x0), window.set_y0(y0), window.set_x1(x1), window.set_y1(y1);
           })
        .status;
  };
  expect_status(refused(0, 0, 10, 10), StatusCode::INVALID_ARGUMENT,
                {"tiles.window", "[0, 10)", "[5, 200) x [0, 150)"});
  expect_status(refused(20, 20, 20, 30), StatusCode::INVALID_ARGUMENT, {"tiles.window"});
  expect_status(tiles(id, [](auto& request) { request.set_view(1); }).status, StatusCode::NOT_FOUND, {"view: 1"});
}

// The checkpoint of a job that waits shows the picture that so many samples make.
TEST_F(JobTilesTest, OfAPausedJobAreItsNewestCheckpoint) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_scene(), 48, kNoEnd);
  const std::string id = submitted(asked);
  wait_for_samples(id, 4);
  ASSERT_TRUE(pause(id).ok());
  ASSERT_EQ(wait_for(id, pb::JOB_STATE_PAUSED).state(), pb::JOB_STATE_PAUSED);
  const Tiles got = tiles(id);
  ASSERT_TRUE(got.status.ok()) << got.status.error_message();
  ASSERT_EQ(got.tiles.size(), 1u);
  EXPECT_EQ(got.view.sha256(), "");
  const auto samples = got.view.end().totals().samples_per_pixel();
  EXPECT_GE(samples, 4u);
  EXPECT_FALSE(got.tiles[0].final());
  EXPECT_EQ(got.tiles[0].samples_per_pixel(), samples);

  pb::RunJobRequest same = asked.job();
  same.mutable_budget()->set_samples(samples);
  same.mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, same);
  pb::RunJobResponse answer;
  std::string tile;
  while (reader->Read(&answer)) {
    if (answer.has_tile()) tile = answer.tile().exr();
  }
  ASSERT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(same_picture(got.tiles[0].exr(), tile));

  // How far it is outlives the attempt, and the daemon.
  const auto expect_known = [&] {
    const pb::Job known = job(id);
    EXPECT_EQ(known.state(), pb::JOB_STATE_PAUSED);
    EXPECT_EQ(known.progress().samples_per_pixel(), samples);
    EXPECT_EQ(known.progress().samples_per_second(), 0);
    EXPECT_TRUE(known.progress().error().known());
    EXPECT_GE(known.checkpoint_s(), known.started_s());
  };
  expect_known();
  restart();
  expect_known();
}

// The first report of the next attempt, which comes within a quarter of a second, tells the samples of all before.
TEST_F(JobTilesTest, AResumedJobDoesNotGoBack) {
  start_daemon();
  const std::string id = submitted(request(load_quad(), 16, kNoEnd));
  ASSERT_TRUE(eventually([&] { return job(id).progress().seconds() > 1.5; }));
  ASSERT_TRUE(pause(id).ok());
  ASSERT_EQ(wait_for(id, pb::JOB_STATE_PAUSED).state(), pb::JOB_STATE_PAUSED);
  const pb::Progress reached = job(id).progress();
  ASSERT_TRUE(resume(id).ok());
  pb::Job now;
  ASSERT_TRUE(eventually([&] {
    now = job(id);
    return now.state() == pb::JOB_STATE_RUNNING && now.progress().samples_per_second() > 0;
  }));
  EXPECT_GE(now.progress().samples_per_pixel(), reached.samples_per_pixel());
  EXPECT_GE(now.progress().seconds(), reached.seconds());
}

TEST_F(JobTilesTest, OfARunningJobComeOnceItHasACheckpoint) {
  start_daemon();
  const std::string id = submitted(request(load_scene(), 32, kNoEnd));
  wait_for_samples(id, 1);
  Tiles got;
  ASSERT_TRUE(eventually([&] {
    got = tiles(id);
    if (!got.status.ok()) expect_status(got.status, StatusCode::UNAVAILABLE, {"no checkpoint so far; try again in"});
    return got.status.ok();
  }));
  EXPECT_EQ(got.tiles.size(), 1u);
  pb::SubmitJobRequest reusing = request(load_quad(), 32, kNoEnd);
  reusing.mutable_job()->mutable_settings()->set_mode(pb::MODE_REPROJECT);
  const std::string other = submitted(reusing);
  wait_for_samples(other, 1);
  expect_status(tiles(other).status, StatusCode::FAILED_PRECONDITION, {"view 0 is not done", "mode reproject"});
}

// ---- views that draw on those before

// A picture that waits for its place is written there without rendering it again, but for the views behind it.
TEST_F(KeptJobsTest, ModesThatReusePicturesEndInTheirBitsAfterAPause) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_scene();
  pb::SubmitJobRequest asked = request(scene, 32, 8);
  asked.mutable_job()->mutable_settings()->set_mode(pb::MODE_REPROJECT);
  for (const double x : {0.0, 0.05, 0.1}) {
    pb::CameraView& camera = *asked.mutable_job()->add_views();
    camera.mutable_position()->set_x(x);
    camera.mutable_position()->set_y(1);
    camera.mutable_position()->set_z(3.5);
    camera.mutable_look_at()->mutable_target()->set_y(1);
  }
  const std::string undisturbed = submitted(asked);
  ASSERT_EQ(wait_for(undisturbed, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  fs::create_directories(out(""));
  for (const int taken : {0, 1, 2}) {
    const std::string name = "walk-" + std::to_string(taken);
    asked.mutable_output()->set_path(name + ".{view}.exr");
    const std::string theirs = out(name + ".000" + std::to_string(taken) + ".exr");
    const std::string before = submitted(request(scene, 16, kNoEnd));
    const std::string id = submitted(asked);
    write_file(theirs, "somebody else's");  // it came after the submission
    ASSERT_TRUE(cancel(before).ok());
    const pb::Job waiting = wait_for(id, pb::JOB_STATE_PAUSED);
    ASSERT_EQ(waiting.state(), pb::JOB_STATE_PAUSED) << waiting.reason();
    EXPECT_NE(waiting.reason().find("is there already"), std::string::npos) << waiting.reason();
    EXPECT_EQ(waiting.views_done(), std::uint32_t(taken));
    fs::remove(theirs);
    ASSERT_TRUE(resume(id).ok());
    const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
    ASSERT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
    bool same = true;
    for (std::uint32_t view = 0; view < 3; ++view) same &= same_picture(result(id, view), result(undisturbed, view));
    EXPECT_TRUE(same || !done.same_bits()) << taken << ": the bits are others, and nothing tells";
    EXPECT_TRUE(taken != 0 || (same && done.same_bits())) << "the whole path began again";
  }
}

// ---- what kills leave

TEST_F(KeptJobsTest, TemporaryFilesGoAndPicturesOfUnknownJobsAreNamed) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 0; });
  pb::SubmitJobRequest asked = request(load_quad(), 16, 4);
  asked.mutable_output()->set_path("walk.exr");
  const std::string id = submitted(asked);
  server_->drain(10);
  server_.reset();
  const std::string known = folder_ / ("state/results/" + id);
  const std::string old = folder_ / "state/results/j-0123456789abcdef01234567";
  const std::string young = folder_ / "state/results/j-aaaaaaaaaaaaaaaaaaaaaaaa";
  const std::string strange = folder_ / "state/results/j-bbbbbbbbbbbbbbbbbbbbbbbb";
  for (const std::string& folder : {known, old, young, strange}) fs::create_directories(folder);
  constexpr const char* kGone = ".tmp-999999999-1";  // more than any process has
  const std::string of_this_number = out("walk.exr.tmp-" + std::to_string(getpid()) + "-1");
  for (const std::string& file : {of_this_number, known + "/0.exr" + kGone, old + "/0.exr", young + "/0.exr", strange + "/mine.txt",
                                  out(std::string("walk.exr") + kGone), out(std::string("other.exr") + kGone),
                                  out("walk.exr.tmp-1-1"), out("walk.exr.tmp-mine")}) {
    write_file(file, "x");
  }
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(24 * 31);
  fs::last_write_time(old + "/0.exr", long_ago);
  fs::last_write_time(strange + "/mine.txt", long_ago);
  start_daemon([](ServerConfig& config) { config.max_jobs = 0; });
  EXPECT_FALSE(fs::exists(known + "/0.exr" + kGone));
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(young + "/0.exr"));
  EXPECT_TRUE(fs::exists(strange + "/mine.txt")) << "no daemon made it";
  EXPECT_FALSE(fs::exists(out(std::string("walk.exr") + kGone)));
  EXPECT_FALSE(fs::exists(of_this_number)) << "of a daemon with the same number, in a container before this one";
  EXPECT_TRUE(fs::exists(out(std::string("other.exr") + kGone))) << "no job was about to write it";
  EXPECT_TRUE(fs::exists(out("walk.exr.tmp-1-1"))) << "the process lives";
  EXPECT_TRUE(fs::exists(out("walk.exr.tmp-mine")));
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
