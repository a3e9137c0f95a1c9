// All sessions, and their end when nobody came back within the grace time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/sessions/session.h"

namespace helio {

// Whose a session is, and how many of them there may be.
struct SessionOwner {
  std::string name;                           // of the token; empty: nobody in particular
  std::optional<std::uint64_t> max_sessions;  // of this owner; nothing: as many as there may be at all
};

// Unguessable: `prefix` and 96 random bits, hexadecimal.
std::string make_id(const char* prefix);

class SessionRegistry {
 public:
  SessionRegistry(int max_sessions, TimerQueue& timers) : max_sessions_(max_sessions), timers_(timers) {}

  // Takes long, as RenderContext::create(). Where no place is left, the session to which nobody has listened for the
  // longest time is ended; where the owner has none left, the longest of the owner's. resource_exhausted: max_sessions
  // or the owner's quota (somebody listens to every session), max_memory.
  Result<std::shared_ptr<Session>> create(const RenderContext::Resources& resources, SceneLease scene,
                                          const RenderSettings& settings, const Budget& budget, double grace_s,
                                          const RenderLimits& limits, const SessionOwner& owner = {});
  // The same of a session of an earlier daemon, under its id and with no other ended for it. take_up: called before
  // anybody else finds the session; a drain must not keep it half made. failed_precondition: the id is taken.
  Result<std::shared_ptr<Session>> make_again(const std::string& id, const RenderContext::Resources& resources,
                                              SceneLease scene, const RenderSettings& settings, const Budget& budget,
                                              double grace_s, const RenderLimits& limits, const SessionOwner& owner,
                                              const std::function<void(Session&)>& take_up);
  // Between the two, find() and close() answer unavailable for this id, with a time to try again.
  void expect(const std::string& id);
  void expect_no_more(const std::string& id);
  Result<std::shared_ptr<Session>> find(const std::string& id, const std::string& where) const;
  // Its stream ends with `status`.
  Status close(const std::string& id, const std::string& where, const grpc::Status& status);
  std::vector<std::shared_ptr<Session>> list() const;

  // Ends sessions to which nobody listens, those that have waited longest first, until the films of the ended ones have
  // `bytes`. False: they have less together; none was ended. owner: null: of all.
  bool make_room(std::uint64_t bytes, const std::string* owner = nullptr);
  // Bytes that make_room() could free.
  std::uint64_t idle_bytes(const std::string* owner = nullptr) const;

 private:
  // A place that is taken before its session is there.
  class Place;

  std::uint64_t held_by(const std::string& owner) const;  // with mutex_ held; those on their way, too
  Result<std::shared_ptr<Session>> make(std::string id, Place& place, const RenderContext::Resources& resources,
                                        SceneLease scene, const RenderSettings& settings, const Budget& budget,
                                        double grace_s, const RenderLimits& limits, const std::string& owner,
                                        const std::function<void(Session&)>& take_up = {});
  Error no_session(const std::string& id, const std::string& where) const;  // with mutex_ held
  bool end_longest_idle(const std::string* owner);
  // Those without a listener, the longest first.
  std::vector<std::shared_ptr<Session>> by_idle_time(const std::string* owner) const;
  bool end_idle(const std::shared_ptr<Session>& session);
  void check_grace_later(const std::shared_ptr<Session>& session, double in_s);

  const int max_sessions_;
  TimerQueue& timers_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  std::set<std::string> expected_;  // expect()
  int creating_ = 0;
  std::map<std::string, std::uint64_t> creating_by_;  // by owner
};

}  // namespace helio
