#include "server/session_registry.h"

#include <openssl/rand.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <stdexcept>

#include "renderer/base/clock.h"
#include "server/sha256.h"

namespace helio {

std::string make_id(const char* prefix) {
  std::array<std::uint8_t, 12> bytes;
  if (RAND_bytes(bytes.data(), int(bytes.size())) != 1) throw std::runtime_error("no random numbers");
  return prefix + to_hex(bytes);
}

Result<std::shared_ptr<Session>> SessionRegistry::create(const Rendering::Resources& resources, SceneLease scene,
                                                         const RenderSettings& settings, const Budget& budget,
                                                         double grace_s, const RenderLimits& limits) {
  {
    const std::lock_guard lock(mutex_);
    if (int(sessions_.size()) + creating_ >= max_sessions_) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("max_sessions: {} sessions exist, as many as are allowed", sessions_.size() + creating_),
                   {}};
    }
    ++creating_;  // the film is allocated without the lock
  }
  auto rendering = Rendering::create(resources, std::move(scene), settings, budget, RenderRank::interactive,
                                     FramePublisher::Tiles::all, TileFormat().channels);
  std::shared_ptr<Session> session;
  if (rendering) {
    session = std::make_shared<Session>(make_id("s-"), std::move(*rendering), settings, budget, TileFormat().channels,
                                        grace_s, limits);
  }
  {
    const std::lock_guard lock(mutex_);
    --creating_;
    if (!session) return rendering.error();
    sessions_.emplace(session->id(), session);
  }
  check_grace_later(session, grace_s);
  return session;
}

Result<std::shared_ptr<Session>> SessionRegistry::find(const std::string& id, const std::string& where) const {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(id);
  if (found == sessions_.end()) return Error{ErrorCode::not_found, "there is no session '" + id + "'", where};
  return found->second;
}

Status SessionRegistry::close(const std::string& id, const std::string& where, const grpc::Status& status) {
  std::shared_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(id);
    if (found == sessions_.end()) return Error{ErrorCode::not_found, "there is no session '" + id + "'", where};
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
