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
  explicit Place(SessionRegistry& registry) : registry_(registry) {}
  Place(const Place&) = delete;
  ~Place() {
    const std::lock_guard lock(registry_.mutex_);
    if (taken_) --registry_.creating_;
  }

  bool take() {
    const std::lock_guard lock(registry_.mutex_);
    if (int(registry_.sessions_.size()) + registry_.creating_ >= registry_.max_sessions_) return false;
    ++registry_.creating_;
    return taken_ = true;
  }
  // The session has it now. The registry's mutex is held.
  void pass_on() {
    --registry_.creating_;
    taken_ = false;
  }

 private:
  SessionRegistry& registry_;
  bool taken_ = false;
};

Result<std::shared_ptr<Session>> SessionRegistry::create(const RenderContext::Resources& resources, SceneLease scene,
                                                         const RenderSettings& settings, const Budget& budget,
                                                         double grace_s, const RenderLimits& limits) {
  Place place(*this);
  while (!place.take()) {
    if (end_longest_idle()) continue;
    return Error{
        ErrorCode::resource_exhausted,
        fmt::format("max_sessions: there are {} sessions with a listener, as many as are allowed", max_sessions_),
        {},
        kRetrySeconds};
  }
  return make(make_id("s-"), place, resources, std::move(scene), settings, budget, grace_s, limits);
}

Result<std::shared_ptr<Session>> SessionRegistry::make_again(const std::string& id,
                                                             const RenderContext::Resources& resources,
                                                             SceneLease scene, const RenderSettings& settings,
                                                             const Budget& budget, double grace_s,
                                                             const RenderLimits& limits) {
  Place place(*this);
  if (!place.take()) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_sessions: there are {} sessions, as many as are allowed", max_sessions_), {}};
  }
  return make(id, place, resources, std::move(scene), settings, budget, grace_s, limits);
}

Result<std::shared_ptr<Session>> SessionRegistry::make(std::string id, Place& place,
                                                       const RenderContext::Resources& resources, SceneLease scene,
                                                       const RenderSettings& settings, const Budget& budget,
                                                       double grace_s, const RenderLimits& limits) {
  auto rendering = RenderContext::create(resources, std::move(scene), settings, budget, RenderRank::interactive,
                                         FramePublisher::Tiles::all, TileFormat().channels);
  if (!rendering) return rendering.error();
  auto session = std::make_shared<Session>(std::move(id), std::move(*rendering), settings, budget,
                                           TileFormat().channels, grace_s, limits);
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

std::vector<std::shared_ptr<Session>> SessionRegistry::by_idle_time() const {
  std::vector<std::pair<double, std::shared_ptr<Session>>> idle;
  for (auto& session : list()) {
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
  spdlog::info("session ended to make room id={} idle_s={:.1f}", session->id(), idle_s);
  return true;
}

bool SessionRegistry::end_longest_idle() {
  for (const auto& session : by_idle_time()) {
    if (end_idle(session)) return true;
  }
  return false;
}

std::uint64_t SessionRegistry::idle_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& session : by_idle_time()) bytes += session->idle_bytes();
  return bytes;
}

bool SessionRegistry::make_room(std::uint64_t bytes) {
  bool ended = false;
  for (const auto& session : by_idle_time()) {
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
      spdlog::info("session expired id={} grace_s={}", session->id(), session->grace_s());
    }
  });
}

}  // namespace helio
