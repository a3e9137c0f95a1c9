// From a client that gives its stream up to the last work that the daemon does for it.
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "renderer/base/clock.h"
#include "tests/bench/peers/daemon_process.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace pb = heliograph::v1;

constexpr int kWidth = 1280, kHeight = 720;
constexpr int kMinTries = 200;          // fewer would not tell a 99th percentile
constexpr double kQuietSeconds = 0.03;  // without worker time: the work has stopped. Pieces last about 5 ms at most
constexpr double kGiveUpSeconds = 10;   // a daemon that goes on for so long never stops
constexpr double kPollSeconds = 0.0005;
constexpr double kRenderSeconds = 0.002;  // tries are spread over so many of these after the first tile

// What the daemon says of a session.
struct Work {
  bool attached = false;
  double used_seconds = 0;  // by workers
};

Result<Work> work_of(RenderClient& client, const std::string& session_id) {
  const auto list = client.list_sessions();
  if (!list) return list.error();
  for (const pb::SessionInfo& session : list->sessions()) {
    if (session.session_id() == session_id) return Work{session.attached(), session.used_seconds()};
  }
  return Error{ErrorCode::not_found, "the session is gone", "cancel"};
}

// Waits until the daemon has stopped working for the session; the time of the last sign that it had not.
Result<double> last_sign_of_work(RenderClient& client, const std::string& session_id) {
  const double start = now_s();
  double last_sign = start, used_seconds = -1;
  for (;;) {
    const double asked = now_s();
    if (asked - last_sign > kQuietSeconds) return last_sign;
    if (asked - start > kGiveUpSeconds) return Error{ErrorCode::internal, "the daemon works on", "cancel"};
    const auto work = work_of(client, session_id);
    if (!work) return work.error();
    if (work->attached || work->used_seconds != used_seconds) {
      // What was counted before the first look is no sign of work after it.
      if (used_seconds >= 0 || work->attached) last_sign = now_s();
      used_seconds = work->used_seconds;
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kPollSeconds));
  }
}

// One stream that is given up while its picture is refined. Seconds from the call of cancel to the last sign of work.
Result<double> give_up(RenderClient& client, RenderClient& observer, const std::string& session_id,
                       const pb::RenderSettings& of_session, std::uint64_t try_) {
  std::mutex mutex;
  std::condition_variable changed;
  bool tile = false, over = false;
  FrameCallbacks callbacks;
  callbacks.tile = [&](const pb::Tile& received) {
    const std::lock_guard lock(mutex);
    tile = tile || received.tag().view_id() == try_;
    changed.notify_all();
  };
  callbacks.ended = [&](const Status&) {
    const std::lock_guard lock(mutex);
    over = true;
    changed.notify_all();
  };
  pb::StreamRequest::Open open;
  open.set_session_id(session_id);
  const auto stream = client.stream_frames(open, callbacks);
  pb::View view;
  view.set_id(try_);
  view.mutable_camera()->set_scene_camera("0");
  // Every try starts a picture of its own.
  pb::RenderSettings settings = of_session;
  settings.set_seed(try_);
  if (const Status sent = stream->send_settings(settings); !sent) return sent.error();
  if (const Status sent = stream->send_view(view); !sent) return sent.error();
  {
    std::unique_lock lock(mutex);
    changed.wait_for(lock, std::chrono::seconds(60), [&] { return tile || over; });
    if (!tile) return Error{ErrorCode::unavailable, "no tile came within 60 s", "cancel"};
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(kRenderSeconds * double(try_ % 10)));
  const double cancelled = now_s();
  stream->cancel();
  const auto stopped = last_sign_of_work(observer, session_id);
  if (!stopped) return stopped.error();
  return *stopped - cancelled;
}

// `device`: as RenderSettings.device.
Result<std::vector<double>> give_up_often(RenderClient& client, RenderClient& observer, const std::string& scene_id,
                                          const std::string& device, int tries) {
  pb::CreateSessionRequest create;
  create.set_scene_id(scene_id);
  create.mutable_settings()->set_width(kWidth);
  create.mutable_settings()->set_height(kHeight);
  create.mutable_settings()->set_device(device);
  const auto session = client.create_session(create);
  if (!session) return session.error();
  std::vector<double> milliseconds;
  for (int i = 1; i <= tries + 1; ++i) {  // the first one is the warm-up
    const auto seconds = give_up(client, observer, session->session_id(), create.settings(), std::uint64_t(i));
    if (!seconds) return seconds.error();
    if (i > 1) milliseconds.push_back(1e3 * *seconds);
  }
  return milliseconds;
}

void add_figures(const std::string& name, double goal, const std::vector<double>& milliseconds, Figures& figures) {
  figures.add({name + "p99_ms", percentile(milliseconds, 0.99), "ms", goal, Better::lower});
  figures.add({name + "p50_ms", percentile(milliseconds, 0.5), "ms", std::nullopt, Better::lower});
  figures.add({name + "worst_ms", percentile(milliseconds, 1), "ms", std::nullopt, Better::lower});
}

}  // namespace

Status run_cancel(BenchContext& context, Figures& figures) {
  auto daemon = DaemonProcess::start(context.options(), context.folder(), {"--devices", "cpu,vulkan"});
  if (!daemon) return daemon.error();
  auto client = (*daemon)->connect();
  if (!client) return client.error();
  auto observer = (*daemon)->connect();
  if (!observer) return observer.error();
  const auto scene_id = upload(**client, context.cornell());
  if (!scene_id) return scene_id.error();
  const int tries = std::max(kMinTries, context.options().views);
  const auto cpu = give_up_often(**client, **observer, *scene_id, "cpu", tries);
  if (!cpu) return cpu.error();
  add_figures("cancel.", 20.0, *cpu, figures);
  const auto vulkan = give_up_often(**client, **observer, *scene_id, "vulkan", tries);
  if (vulkan) {
    add_figures("cancel.vulkan_", 50.0, *vulkan, figures);
  } else {
    note("no figures by a Vulkan device: " + vulkan.error().to_string());
  }
  return ok_status();
}

}  // namespace helio::bench
