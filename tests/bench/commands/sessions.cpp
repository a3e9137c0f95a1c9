// Eight sessions on one scene: how evenly they share the machine, and that they share the scene.
#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "tests/bench/peers/daemon_process.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace pb = heliograph::v1;

constexpr int kSessions = 8;
constexpr int kSide = 256;  // pixels
constexpr auto kSettle = std::chrono::seconds(1);
constexpr auto kWindow = std::chrono::seconds(4);
// Users come one after the other. Sessions that begin in the same instant trace the same pixels at the same time ever
// after, each with the part of the scene in the cache that the others have just used: 10 to 20 % more samples in the
// same time than one that is alone where it is.
constexpr auto kArrival = std::chrono::milliseconds(370);
// Young frames are published often and old ones rarely, and publishing is charged to the session: before their samples
// are compared, the sessions, begun one after the other, have reached the same pace.
constexpr auto kAge = std::chrono::seconds(6);

struct Viewer {
  std::unique_ptr<RenderClient> client;
  std::unique_ptr<FrameStream> stream;
};

// A user with a connection of their own, who looks through the scene's camera, without a budget.
Result<Viewer> start_viewer(const DaemonProcess& daemon, const std::string& scene_id) {
  auto client = daemon.connect();
  if (!client) return client.error();
  Viewer viewer{std::move(client).value(), nullptr};
  pb::CreateSessionRequest create;
  create.set_scene_id(scene_id);
  create.mutable_settings()->set_width(kSide);
  create.mutable_settings()->set_height(kSide);
  const auto session = viewer.client->create_session(create);
  if (!session) return session.error();
  pb::StreamRequest::Open open;
  open.set_session_id(session.value().session_id());
  viewer.stream = viewer.client->stream_frames(open, {});
  pb::View view;
  view.set_id(1);
  view.mutable_camera()->set_scene_camera("0");
  if (const Status sent = viewer.stream->send_view(view); !sent) return sent.error();
  return viewer;
}

Result<std::map<std::string, double>> samples_by_session(RenderClient& client) {
  const auto sessions = client.list_sessions();
  if (!sessions) return sessions.error();
  std::map<std::string, double> samples;
  for (const pb::SessionInfo& session : sessions.value().sessions()) {
    samples[session.session_id()] = double(session.progress().paths());
  }
  return samples;
}

Result<double> session_bytes(RenderClient& client) {
  const auto sessions = client.list_sessions();
  if (!sessions) return sessions.error();
  double bytes = 0;
  for (const pb::SessionInfo& session : sessions.value().sessions()) bytes += double(session.memory_bytes());
  return bytes;
}

// Resident bytes of the daemon beside those of its sessions' films and queues.
Result<double> resident_beside_sessions(const DaemonProcess& daemon, RenderClient& client) {
  std::this_thread::sleep_for(kSettle);
  const auto films = session_bytes(client);
  if (!films) return films.error();
  return double(daemon.resident_bytes()) - films.value();
}

struct Run {
  double deviation = 0;        // largest |rate - mean| over the mean
  double memory = 0;           // resident bytes that came with the scene: with eight sessions over with one
  double memory_uploaded = 0;  // the same once every client has uploaded the scene again
  double listed = 0;           // ListScenes: scenes held
};

Result<Run> measure(const BenchContext& context, const std::filesystem::path& file) {
  auto daemon = DaemonProcess::start(context.options(), context.folder());
  if (!daemon) return daemon.error();
  const double empty = double((*daemon)->resident_bytes());
  auto uploader = (*daemon)->connect();
  if (!uploader) return uploader.error();
  const auto scene_id = upload(**uploader, file);
  if (!scene_id) return scene_id.error();
  std::vector<Viewer> viewers;
  double one = 0, eight = 0;
  for (int i = 0; i < kSessions; ++i) {
    auto viewer = start_viewer(**daemon, scene_id.value());
    if (!viewer) return viewer.error();
    viewers.push_back(std::move(viewer).value());
    std::this_thread::sleep_for(kArrival);
    if (i > 0 && i + 1 < kSessions) continue;
    const auto resident = resident_beside_sessions(**daemon, **uploader);
    if (!resident) return resident.error();
    (i == 0 ? one : eight) = resident.value() - empty;
  }

  std::this_thread::sleep_for(kAge);
  RenderClient& client = *viewers[0].client;
  const auto before = samples_by_session(client);
  if (!before) return before.error();
  std::this_thread::sleep_for(kWindow);
  const auto after = samples_by_session(client);
  if (!after) return after.error();

  Run run;
  std::vector<double> rates;
  double mean = 0;
  for (const auto& [id, samples] : after.value()) {
    rates.push_back(samples - before.value().at(id));
    mean += rates.back() / kSessions;
  }
  if (rates.size() != kSessions || mean <= 0) return Error{ErrorCode::internal, "sessions were lost", "sessions"};
  for (const double rate : rates) run.deviation = std::max(run.deviation, std::fabs(rate - mean) / mean);
  run.memory = eight / one;
  for (const Viewer& viewer : viewers) {
    if (const auto again = upload(*viewer.client, file); !again) return again.error();
  }
  const auto uploaded = resident_beside_sessions(**daemon, **uploader);
  if (!uploaded) return uploaded.error();
  run.memory_uploaded = (uploaded.value() - empty) / one;
  const auto scenes = client.list_scenes();
  if (!scenes) return scenes.error();
  run.listed = scenes.value().scenes_size();
  for (Viewer& viewer : viewers) viewer.stream->cancel();
  return run;
}

}  // namespace

Status run_sessions(BenchContext& context, Figures& figures) {
  const auto room = context.room();
  if (!room) {
    note(room.error().to_string());
    return ok_status();
  }
  std::vector<double> deviation, memory, memory_uploaded, listed;
  for (int i = 0; i < context.options().repeat; ++i) {  // each on a daemon of its own: nothing to warm up
    const auto run = measure(context, *room);
    if (!run) return run.error();
    deviation.push_back(run.value().deviation);
    memory.push_back(run.value().memory);
    memory_uploaded.push_back(run.value().memory_uploaded);
    listed.push_back(run.value().listed);
  }
  figures.add({"sessions.fairness", median(deviation), "share", 0.1, Better::lower});
  figures.add({"sessions.memory", median(memory), "x", 1.1, Better::lower});
  figures.add({"sessions.memory.uploaded_by_each", median(memory_uploaded), "x", std::nullopt, Better::lower});
  figures.add({"sessions.scenes_listed", median(listed), "scenes", 1.0, Better::lower});
  return ok_status();
}

}  // namespace helio::bench
