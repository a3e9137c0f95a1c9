// All sessions, and their end when nobody came back within the grace time.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/session.h"

namespace helio {

// Unguessable: `prefix` and 96 random bits, hexadecimal.
std::string make_id(const char* prefix);

class SessionRegistry {
 public:
  SessionRegistry(int max_sessions, TimerQueue& timers) : max_sessions_(max_sessions), timers_(timers) {}

  // resource_exhausted: max_sessions, max_memory.
  Result<std::shared_ptr<Session>> create(const Rendering::Resources& resources, SceneLease scene,
                                          const RenderSettings& settings, const Budget& budget, double grace_s,
                                          const RenderLimits& limits);
  Result<std::shared_ptr<Session>> find(const std::string& id, const std::string& where) const;
  // Its stream ends with `status`.
  Status close(const std::string& id, const std::string& where, const grpc::Status& status);
  std::vector<std::shared_ptr<Session>> list() const;

 private:
  void check_grace_later(const std::shared_ptr<Session>& session, double in_s);

  const int max_sessions_;
  TimerQueue& timers_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  int creating_ = 0;
};

}  // namespace helio
