#include "server/jobs/session_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/base/unix_time.h"
#include "renderer/frame/picture_checkpoint.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/jobs/job_attempt.h"
#include "server/jobs/kept_checkpoint.h"
#include "server/jobs/load_kept_scene.h"

namespace helio {
namespace {

// At a time: each takes memory for a copy of its picture, and waits for the disk.
constexpr std::size_t kKeepers = 4;
constexpr double kAgainSeconds = 0.25;    // until the loader may have a place
constexpr double kRestartSeconds = 1;     // after which a client may ask for its session again
constexpr auto kLook = std::chrono::milliseconds(5);

}  // namespace

SessionKeeper::~SessionKeeper() {
  {
    const std::lock_guard lock(life_->mutex);
    life_->over = true;
  }
  for (std::thread& keeper : keepers_) keeper.join();
}

Status SessionKeeper::open(std::vector<std::string>& notices) {
  if (const Status opened = files_.open(); !opened.ok()) return opened;
  for (const std::string& id : files_.job_ids()) {
    const auto newest = files_.read_head(id);
    std::string useless;
    for (const std::string& line : newest.damaged) useless += (useless.empty() ? "" : "; ") + line;
    if (newest.file) {
      useless.clear();
      auto record = SessionRecord::read(newest.file->header, core_.render_limits());
      if (!record) {
        useless = record.error().to_string();
      } else if (const double age = unix_time_s() - record->kept_s; age > record->grace_s) {
        useless = fmt::format("its grace time of {:g} s was over when this daemon started", record->grace_s);
      } else {
        found_.push_back({id, std::move(*record)});
      }
    }
    if (useless.empty()) continue;
    notices.push_back(fmt::format("session {} of the daemon before is not taken up: {}", id, useless));
    files_.remove(id);
  }
  // Those that were kept last had nobody who listens.
  std::sort(found_.begin(), found_.end(),
            [](const Found& a, const Found& b) { return a.record.kept_s > b.record.kept_s; });
  for (const Found& found : found_) core_.sessions.expect(found.id);
  return ok_status();
}

std::vector<SceneStore::Held> SessionKeeper::held() const {
  std::vector<SceneStore::Held> held;
  for (const Found& found : found_) held.push_back({found.id, found.record.scene_id});
  return held;
}

void SessionKeeper::begin() {
  if (!found_.empty()) take_up_next();
}

// Anew for each session, so that loads which clients ask for come between.
void SessionKeeper::take_up_next() {
  if (core_.draining) return;  // the files stay for the next daemon
  const bool placed = found_.back().record.settings.device.kind != RenderDevice::Kind::cpu;
  // Scenes are put on other devices by threads that may wait for shaders.
  TaskThread& thread = placed ? core_.placer : core_.loader;
  const bool taken = thread.submit([this] {
    if (core_.draining) return;
    const Found found = std::move(found_.back());
    found_.pop_back();
    take_up(found);
    if (!found_.empty()) take_up_next();
  });
  if (taken) return;
  core_.timers.call_at(now_s() + kAgainSeconds, [this, life = life_] {
    const std::lock_guard lock(life->mutex);
    if (!life->over) take_up_next();
  });
}

void SessionKeeper::take_up(const Found& found) {
  const Status made = guarded([&] { return make_again(found); });
  core_.sessions.expect_no_more(found.id);
  if (!made.ok())
    spdlog::warn("session {} of the daemon before is not taken up: {}", found.id, made.error().to_string());
  // A daemon that drains meanwhile may have written the session anew.
  const std::lock_guard lock(removing_);
  if (core_.draining) return;
  files_.remove(found.id);
  scenes_.release(found.id);
}

Status SessionKeeper::make_again(const Found& found) {
  const SessionRecord& record = found.record;
  auto scene = load_kept_scene(core_, scenes_, record.scene_id, record.owner, CancelToken());
  if (!scene) return scene.error();
  std::shared_ptr<const PictureCheckpoint> picture;
  std::string lost = record.without;
  if (record.view && lost.empty()) {
    const std::uint64_t most = checkpoint_bytes(record.settings) + kMostHeaderBytes;
    auto memory = core_.memory_of(record.owner).reserve_with_room(most, "the picture of a session", MemoryOwner::checkpoints);
    auto newest = memory ? files_.read(found.id, most) : CheckpointFiles::Newest();
    for (const std::string& line : newest.damaged) lost += (lost.empty() ? "" : "; ") + line;
    if (!memory) {
      lost = memory.error().to_string();
    } else if (newest.file && !newest.file->body.empty()) {
      auto decoded = PictureCheckpoint::decode(std::move(newest.file->body), record.settings);
      if (!decoded) lost = decoded.error().to_string();
      if (decoded) picture = counted(std::move(*memory), std::move(*decoded));
    }
  }
  const std::uint64_t samples = picture ? picture->samples() : 0;
  const auto take_up = [&](Session& session) {
    if (!record.view) return;
    std::string told;
    if (!lost.empty()) told = "the daemon was restarted; the samples of this picture begin anew: " + lost;
    if (picture && record.build != rendering_build(to_string(record.settings.device))) {
      told = "the daemon was restarted with another build or instruction path: the picture goes on, and its last bits "
             "may differ from those of one build";
    }
    const Status suits = session.take_up(*record.view, std::move(picture), std::move(told));
    if (!suits.ok()) lost = suits.error().to_string();
  };
  const SessionOwner owner{record.owner, core_.access.quotas_of(record.owner).sessions};
  auto session = core_.sessions.make_again(found.id, core_.resources(record.owner), std::move(*scene),
                                           record.settings, record.budget, record.grace_s, core_.render_limits(),
                                           owner, take_up);
  if (!session) return session.error();
  spdlog::info("session taken up id={} scene={} samples={}{}", found.id, record.scene_id.substr(0, 12), samples,
               lost.empty() ? "" : " lost: " + lost);
  return ok_status();
}

void SessionKeeper::keep_all(double deadline_s) {
  { const std::lock_guard what_was_taken_up_is_removed(removing_); }
  sessions_ = core_.sessions.list();
  std::stable_sort(sessions_.begin(), sessions_.end(), [](const auto& a, const auto& b) {
    return (a->idle_s() == 0) > (b->idle_s() == 0);
  });
  for (const auto& session : sessions_) session->freeze("the daemon restarts; this session goes on with the next one");
  for (std::size_t i = 0; i < std::min(kKeepers, sessions_.size()); ++i) {
    keepers_.emplace_back([this, deadline_s] {
      for (std::size_t n = next_++; n < sessions_.size(); n = next_++) {
        const Status kept = guarded([&] { return keep(*sessions_[n], deadline_s), ok_status(); });
        if (!kept.ok()) {
          spdlog::error("session {} is not kept: {}", sessions_[n]->id(), kept.error().to_string());
          sessions_[n]->end_stream(to_grpc_status(kept.error()));
        }
        ++kept_;
      }
    });
  }
}

bool SessionKeeper::wait_until_kept(double deadline_s) {
  while (kept_ < sessions_.size() && now_s() < deadline_s) std::this_thread::sleep_for(kLook);
  return kept_ >= sessions_.size();
}

void SessionKeeper::keep(Session& session, double deadline_s) {
  const Session::State state = session.state();
  const std::string& id = session.id();
  const auto not_kept = [&](const std::string& why) {
    spdlog::warn("session {} is not kept for the next daemon: {}", id, why);
    session.end_stream({grpc::StatusCode::UNAVAILABLE, "the daemon is draining, and cannot keep this session: " + why});
  };
  const SceneLease scene = session.lease();
  if (const Status held = scenes_.hold(*scene, id); !held.ok()) return not_kept(held.error().to_string());
  SessionRecord record;
  record.scene_id = scene->id;
  record.owner = session.owner();
  record.settings = state.settings;
  record.budget = state.budget;
  record.grace_s = session.grace_s();
  record.kept_s = unix_time_s();
  record.view = state.view;
  record.build = rendering_build(to_string(state.settings.device));
  const std::string failure = keep_picture(session, record, state, deadline_s);
  if (!failure.empty() || session.closed()) {
    files_.remove(id);
    scenes_.release(id);
    return not_kept(failure.empty() ? "it was closed" : failure);
  }
  spdlog::info("session kept id={}{}", id, record.without.empty() ? "" : " without its samples: " + record.without);
  session.end_stream(to_grpc_status(
      Error{ErrorCode::unavailable,
            "the daemon restarts; attach to this session again, which goes on " +
                (record.without.empty() ? "with its samples" : "without its samples: " + record.without),
            {}, kRestartSeconds}));
}

// Writes the file of the session, with the picture where there is one. Why that failed; empty: it did not.
std::string SessionKeeper::keep_picture(Session& session, SessionRecord& record, const Session::State& state,
                                        double deadline_s) {
  const std::uint64_t most = state.view ? checkpoint_bytes(state.settings) : 0;
  Result<std::shared_ptr<const PictureCheckpoint>> picture = std::shared_ptr<const PictureCheckpoint>();
  if (bytes_.fetch_add(most) + most > core_.config.max_state_session_bytes) {
    bytes_ -= most;
    picture = Error{ErrorCode::resource_exhausted,
                    fmt::format("max_state_session_bytes: pictures of sessions may take {} bytes together",
                                core_.config.max_state_session_bytes),
                    {}};
  } else if (now_s() > deadline_s) {
    picture = Error{ErrorCode::unavailable, "the daemon's drain-grace left no time for a copy of its picture", {}};
  } else {
    picture = session.copy_picture(deadline_s);
  }
  if (!picture && state.view) record.without = picture.error().to_string();
  std::vector<std::span<const std::uint8_t>> body;
  if (picture && *picture) body.push_back((*picture)->encode());
  Status written = files_.write(session.id(), record.write(), body);
  if (!written.ok() && !body.empty()) {
    record.without = "its picture could not be written: " + written.error().to_string();
    written = files_.write(session.id(), record.write(), {});
  }
  return written.ok() ? std::string() : written.error().to_string();
}

}  // namespace helio
