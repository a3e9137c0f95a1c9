// What jobs that the daemon keeps cost: checkpoints, submissions, lists, and a restart with many of them.
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "client/jobs/job_client.h"
#include "renderer/base/clock.h"
#include "renderer/frame/picture_checkpoint.h"
#include "tests/bench/peers/daemon_process.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/loop_rendering.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {
namespace {

namespace pb = heliograph::v1;

constexpr int kSubmits = 200;  // of each client
constexpr int kClients = 8;
constexpr int kJobs = 1000, kScenes = 10, kPage = 100;

// A 1280x720 film rendered with as many checkpoints as their clock allows: for how long samples stand still, by the
// processor time of the copies over the workers, and their share of the frame.
Status measure_checkpoints(BenchContext& context, Figures& figures, Integrator integrator, double goal_ms) {
  const auto scene = load_bench_scene(context.cornell(), context.options().threads);
  if (!scene) return scene.error();
  RenderEngine engine(context.options().threads);
  RenderSettings settings;
  settings.width = 1280;
  settings.height = 720;
  settings.integrator = integrator;
  std::vector<double> pauses, shares;
  for (int i = -1; i < context.options().repeat; ++i) {
    std::atomic<int> copies = 0;
    RenderLoopOptions options;
    options.checkpoints.emplace();
    options.checkpoints->interval_s = 0.01;
    options.checkpoints->keep = [&](const std::shared_ptr<const PictureCheckpoint>&) { ++copies; };
    const auto camera = camera_pose((*scene)->description().cameras.front());
    const auto picture =
        render_picture(engine, *scene, settings, integrator == Integrator::path ? 64 : 12, camera, options);
    if (!picture) return picture.error();
    if (i < 0) continue;  // warm-up
    if (copies == 0) return Error{ErrorCode::internal, "a frame ended before its first checkpoint", "service"};
    for (const PassTime& pass : picture->end.passes) {
      if (pass.pass != "checkpoint") continue;
      const double seconds = pass.seconds / context.options().threads;
      pauses.push_back(1e3 * seconds / copies);
      shares.push_back(100 * seconds / picture->end.progress.seconds);
    }
  }
  const std::string name = std::string("service.checkpoint.") + to_string(integrator);
  figures.add({name + ".pause", median(pauses), "ms", goal_ms, Better::lower});
  figures.add({name + ".share", median(shares), "%", 2.0, Better::lower});
  return ok_status();
}

// Seconds of a small write and its flush to the disk, as a commit takes at least.
double flush_seconds(const std::filesystem::path& folder) {
  const std::string file = (folder / "flush").string();
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  std::vector<double> seconds;
  const std::string page(4096, 'x');
  for (int i = 0; descriptor >= 0 && i < 100; ++i) {
    const double started = now_s();
    if (::write(descriptor, page.data(), page.size()) < 0 || ::fsync(descriptor) != 0) break;
    seconds.push_back(now_s() - started);
  }
  if (descriptor >= 0) ::close(descriptor);
  return seconds.empty() ? 0 : median(seconds);
}

pb::SubmitJobRequest request(const std::string& scene, int width, int height, std::uint32_t samples) {
  pb::SubmitJobRequest request;
  request.mutable_job()->set_scene_id(scene);
  request.mutable_job()->mutable_settings()->set_width(width);
  request.mutable_job()->mutable_settings()->set_height(height);
  request.mutable_job()->mutable_budget()->set_samples(samples);
  return request;
}

// Submissions a second of so many clients at once.
Result<double> submit_rate(const DaemonProcess& daemon, const std::string& scene, int clients) {
  std::vector<std::unique_ptr<RenderClient>> connections;
  for (int i = 0; i < clients; ++i) {
    auto client = daemon.connect();
    if (!client) return client.error();
    connections.push_back(std::move(*client));
  }
  std::atomic<int> failures = 0;
  const double started = now_s();
  std::vector<std::thread> threads;
  for (int i = 0; i < clients; ++i) {
    threads.emplace_back([&, i] {
      JobClient jobs(*connections[std::size_t(i)]);
      for (int k = 0; k < kSubmits; ++k) failures += jobs.submit(request(scene, 64, 64, 1)).ok() ? 0 : 1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  if (failures > 0) return Error{ErrorCode::internal, std::to_string(failures) + " submissions failed", "service"};
  return clients * kSubmits / (now_s() - started);
}

Status measure_submits(BenchContext& context, Figures& figures) {
  const std::filesystem::path state = context.folder() / "state-submits";
  std::filesystem::create_directories(state);
  const auto daemon =
      DaemonProcess::start(context.options(), context.folder(), {"--state", state.string(), "--max-jobs", "0"});
  if (!daemon) return daemon.error();
  auto client = (*daemon)->connect();
  if (!client) return client.error();
  const auto scene = upload(**client, context.cornell());
  if (!scene) return scene.error();
  const double flush = flush_seconds(state);
  const auto one = submit_rate(**daemon, *scene, 1);
  if (!one) return one.error();
  const auto eight = submit_rate(**daemon, *scene, kClients);
  if (!eight) return eight.error();
  figures.add({"service.flush", 1e3 * flush, "ms", std::nullopt, Better::lower});
  figures.add({"service.submits.one_client", *one, "1/s", std::nullopt, Better::higher});
  figures.add({"service.submits.one_client.times_flush", *one * flush, "", 0.8, Better::higher});
  figures.add({"service.submits.eight_clients", *eight, "1/s", 300.0, Better::higher});
  return ok_status();
}

// From the call of SubmitJob until GetJob tells of the first rays.
Status measure_first_sample(BenchContext& context, Figures& figures) {
  const std::filesystem::path state = context.folder() / "state-first";
  const auto daemon = DaemonProcess::start(context.options(), context.folder(), {"--state", state.string()});
  if (!daemon) return daemon.error();
  auto client = (*daemon)->connect();
  if (!client) return client.error();
  const auto scene = upload(**client, context.cornell());
  if (!scene) return scene.error();
  JobClient jobs(**client);
  std::vector<double> seconds;
  for (int i = -1; i < 4 * context.options().repeat; ++i) {
    const double started = now_s();
    const auto submitted = jobs.submit(request(*scene, 640, 360, 1u << 20));
    if (!submitted) return submitted.error();
    const std::string id = submitted->job().job_id();
    for (;;) {
      const auto job = jobs.get(id);
      if (!job) return job.error();
      if (job->progress().rays() > 0) break;
      if (is_over(job->state())) return Error{ErrorCode::internal, job->reason(), "service"};
    }
    if (i >= 0) seconds.push_back(now_s() - started);
    if (const Status done = jobs.cancel(id); !done) return done;
    pb::WatchJobRequest watch;
    watch.set_job_id(id);
    if (const Status over = jobs.watch(watch, {}); !over) return over;
  }
  figures.add({"service.first_sample", 1e3 * median(seconds), "ms", 40.0, Better::lower});
  return ok_status();
}

// A page of the list, and a daemon's start, with so many jobs and scenes.
Status measure_many(BenchContext& context, Figures& figures) {
  const std::filesystem::path state = context.folder() / "state-many";
  const std::vector<std::string> options = {"--state", state.string(), "--max-jobs", "0"};
  {
    const auto daemon = DaemonProcess::start(context.options(), context.folder(), options);
    if (!daemon) return daemon.error();
    auto client = (*daemon)->connect();
    if (!client) return client.error();
    JobClient jobs(**client);
    for (int i = 0; i < kScenes; ++i) {
      const auto local = collect_local_scene(context.cornell().string(), "0.1,0.1," + std::to_string(0.01 * i));
      if (!local) return local.error();
      const auto loaded = (*client)->upload_scene(*local);
      if (!loaded) return loaded.error();
      for (int k = 0; k < kJobs / kScenes; ++k) {
        const auto submitted = jobs.submit(request(loaded->scene().scene_id(), 640, 360, 64));
        if (!submitted) return submitted.error();
      }
    }
    std::vector<double> seconds;
    pb::ListJobsRequest list;
    list.set_page_size(kPage);
    for (int i = -1; i < 4 * context.options().repeat; ++i) {
      const double started = now_s();
      const auto page = jobs.list(list);
      if (!page) return page.error();
      if (i >= 0) seconds.push_back(now_s() - started);
      list.set_page_token(page->next_page_token());
    }
    figures.add({"service.list", 1e3 * median(seconds), "ms", 10.0, Better::lower});
  }
  std::vector<double> seconds;
  for (int i = 0; i < context.options().repeat; ++i) {
    const double started = now_s();
    const auto daemon = DaemonProcess::start(context.options(), context.folder(), options);
    if (!daemon) return daemon.error();
    auto client = (*daemon)->connect();
    if (!client) return client.error();
    const auto page = JobClient(**client).list({});
    if (!page) return page.error();
    if (page->total() != kJobs) return Error{ErrorCode::internal, "jobs were lost", "service"};
    seconds.push_back(now_s() - started);
  }
  figures.add({"service.restart", median(seconds), "s", 3.0, Better::lower});
  return ok_status();
}

}  // namespace

Status run_service(BenchContext& context, Figures& figures) {
  for (const Status& done :
       {measure_checkpoints(context, figures, Integrator::path, 20),
        measure_checkpoints(context, figures, Integrator::lvc, 60), measure_submits(context, figures),
        measure_first_sample(context, figures), measure_many(context, figures)}) {
    if (!done) return done;
  }
  return ok_status();
}

}  // namespace helio::bench
