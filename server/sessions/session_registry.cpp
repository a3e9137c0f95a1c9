#include "server/sessions/session_registry.h"

#include <openssl/rand.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <stdexcept>

#include "renderer/base/clock.h"
#include "renderer/codec/sha256.h"
#include "server/base/retry.h"

namespace helio {
namespace {

constexpr double kSoonSeconds = 0.5;  // that loading a scene again takes, as a first guess

}  // namespace

std::string make_id(const char* prefix) {
  std::array<std::uint8_t, 12> bytes;
  if (RAND_bytes(bytes.data(), int(bytes.size())) != 1) throw std::runtime_error("no random numbers");
  return prefix + to_hex(bytes);
}

class SessionRegistry::Place {
 public:
  Place(SessionRegistry& registry, const SessionOwner& owner) : registry_(registry), owner_(owner) {}
  Place(const Place&) = delete;
  ~Place() {
    const std::lock_guard lock(registry_.mutex_);
    if (taken_) give_up();
  }

  enum class Outcome { taken, daemon_full, owner_full };
  Outcome take() {
    const std::lock_guard lock(registry_.mutex_);
    if (owner_.max_sessions && registry_.held_by(owner_.name) >= *owner_.max_sessions) return Outcome::owner_full;
    if (int(registry_.sessions_.size()) + registry_.creating_ >= registry_.max_sessions_) return Outcome::daemon_full;
    ++registry_.creating_by_[owner_.name];
    ++registry_.creating_;
    taken_ = true;
    return Outcome::taken;
  }
  // The session has it now. The registry's mutex is held.
  void pass_on() {
    give_up();
    taken_ = false;
  }

 private:
  void give_up() {
    --registry_.creating_;
    const auto found = registry_.creating_by_.find(owner_.name);
    if (--found->second == 0) registry_.creating_by_.erase(found);
  }

  SessionRegistry& registry_;
  const SessionOwner& owner_;
  bool taken_ = false;
};

std::uint64_t SessionRegistry::held_by(const std::string& owner) const {
  const auto creating = creating_by_.find(owner);
  const auto open = std::count_if(sessions_.begin(), sessions_.end(),
                                  [&](const auto& session) { return session.second->owner() == owner; });
  return std::uint64_t(open) + (creating == creating_by_.end() ? 0 : creating->second);
}

Result<std::shared_ptr<Session>> SessionRegistry::create(const RenderContext::Resources& resources, SceneLease scene,
                                                         const RenderSettings& settings, const Budget& budget,
                                                         double grace_s, const RenderLimits& limits,
                                                         const SessionOwner& owner) {
  Place place(*this, owner);
  while (true) {
    const Place::Outcome outcome = place.take();
    if (outcome == Place::Outcome::taken) break;
    const bool of_owner = outcome == Place::Outcome::owner_full;
    if (end_longest_idle(of_owner ? &owner.name : nullptr)) continue;
    if (of_owner) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("quota sessions of the token '{}': {} are open, with a listener each; allowed: {}",
                               owner.name, *owner.max_sessions, *owner.max_sessions),
                   {},
                   kRetrySeconds};
    }
    return Error{
        ErrorCode::resource_exhausted,
        fmt::format("max_sessions: there are {} sessions with a listener, as many as are allowed", max_sessions_),
        {},
        kRetrySeconds};
  }
  return make(make_id("s-"), place, resources, std::move(scene), settings, budget, grace_s, limits, owner.name);
}

Result<std::shared_ptr<Session>> SessionRegistry::make_again(const std::string& id,
                                                             const RenderContext::Resources& resources,
                                                             SceneLease scene, const RenderSettings& settings,
                                                             const Budget& budget, double grace_s,
                                                             const RenderLimits& limits, const SessionOwner& owner,
                                                             const std::function<void(Session&)>& take_up) {
  Place place(*this, owner);
  const Place::Outcome outcome = place.take();
  if (outcome == Place::Outcome::owner_full) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("quota sessions of the token '{}': {} are open, as many as are allowed", owner.name,
                             *owner.max_sessions),
                 {}};
  }
  if (outcome != Place::Outcome::taken) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_sessions: there are {} sessions, as many as are allowed", max_sessions_), {}};
  }
  return make(id, place, resources, std::move(scene), settings, budget, grace_s, limits, owner.name, take_up);
}

Result<std::shared_ptr<Session>> SessionRegistry::make(std::string id, Place& place,
                                                       const RenderContext::Resources& resources, SceneLease scene,
                                                       const RenderSettings& settings, const Budget& budget,
                                                       double grace_s, const RenderLimits& limits,
                                                       const std::string& owner,
                                                       const std::function<void(Session&)>& take_up) {
  auto rendering = RenderContext::create(resources, std::move(scene), settings, budget, RenderRank::interactive,
                                         FramePublisher::Tiles::all, TileFormat().channels);
  if (!rendering) return rendering.error();
  auto session = std::make_shared<Session>(std::move(id), std::move(*rendering), settings, budget,
                                           TileFormat().channels, grace_s, limits, owner);
  if (take_up) take_up(*session);
  const std::lock_guard lock(mutex_);
  if (sessions_.contains(session->id()))
    return Error{ErrorCode::failed_precondition, "there is a session '" + session->id() + "' already", {}};
  check_grace_later(session, grace_s);  // it finds the session once the lock is free
  sessions_.emplace(session->id(), session);
  place.pass_on();
  return session;
}

void SessionRegistry::expect(const std::string& id) {
  const std::lock_guard lock(mutex_);
  expected_.insert(id);
}

void SessionRegistry::expect_no_more(const std::string& id) {
  const std::lock_guard lock(mutex_);
  expected_.erase(id);
}

Error SessionRegistry::no_session(const std::string& id, const std::string& where) const {
  if (!expected_.contains(id)) return {ErrorCode::not_found, "there is no session '" + id + "'", where};
  return {ErrorCode::unavailable, "session '" + id + "' of the daemon before is being taken up", where, kSoonSeconds};
}

Result<std::shared_ptr<Session>> SessionRegistry::find(const std::string& id, const std::string& where) const {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(id);
  if (found == sessions_.end() || expected_.contains(id)) return no_session(id, where);
  return found->second;
}

Status SessionRegistry::close(const std::string& id, const std::string& where, const grpc::Status& status) {
  std::shared_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(id);
    if (found == sessions_.end()) return no_session(id, where);
    session = std::move(found->second);
    sessions_.erase(found);
  }
  session->close(status);
  return ok_status();
}

std::vector<std::shared_ptr<Session>> SessionRegistry::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Session>> sessions;
  for (const auto& [id, session] : sessions_) sessions.push_back(session);
  return sessions;
}

std::vector<std::shared_ptr<Session>> SessionRegistry::by_idle_time(const std::string* owner) const {
  std::vector<std::pair<double, std::shared_ptr<Session>>> idle;
  for (auto& session : list()) {
    if (owner && session->owner() != *owner) continue;
    if (const double seconds = session->idle_s(); seconds > 0) idle.emplace_back(seconds, std::move(session));
  }
  std::sort(idle.begin(), idle.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::shared_ptr<Session>> sessions;
  for (auto& [seconds, session] : idle) sessions.push_back(std::move(session));
  return sessions;
}

bool SessionRegistry::end_idle(const std::shared_ptr<Session>& session) {
  const double idle_s = session->idle_s();
  if (!session->close_idle({grpc::StatusCode::NOT_FOUND, "the session was ended to make room"})) return false;
  {
    const std::lock_guard lock(mutex_);
    sessions_.erase(session->id());
  }
  spdlog::info("session ended to make room session={} idle_s={:.1f}", session->id(), idle_s);
  return true;
}

bool SessionRegistry::end_longest_idle(const std::string* owner) {
  for (const auto& session : by_idle_time(owner)) {
    if (end_idle(session)) return true;
  }
  return false;
}

std::uint64_t SessionRegistry::idle_bytes(const std::string* owner) const {
  std::uint64_t bytes = 0;
  for (const auto& session : by_idle_time(owner)) bytes += session->idle_bytes();
  return bytes;
}

bool SessionRegistry::make_room(std::uint64_t bytes, const std::string* owner) {
  bool ended = false;
  for (const auto& session : by_idle_time(owner)) {
    const std::uint64_t of_session = session->idle_bytes();
    if (!end_idle(session)) continue;
    ended = true;
    bytes -= std::min(bytes, of_session);
    if (bytes == 0) break;
  }
  return ended;
}

// Looks again when the session may have been alone for its whole grace time.
void SessionRegistry::check_grace_later(const std::shared_ptr<Session>& session, double in_s) {
  timers_.call_at(now_s() + in_s, [this, weak = std::weak_ptr(session)] {
    const auto session = weak.lock();
    if (!session) return;
    const double left = session->grace_s() - session->idle_s();
    if (left > 0) return check_grace_later(session, std::max(left, 1e-3));
    if (close(session->id(), "", {grpc::StatusCode::NOT_FOUND, "the session's grace time is over"}).ok()) {
      spdlog::info("session expired session={} grace_s={}", session->id(), session->grace_s());
    }
  });
}

}  // namespace helio
