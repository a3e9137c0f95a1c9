// Clients as a daemon meets them: that stop reading, vanish, send what is no message, and come again and again.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace helio::test {

enum class BadHabit { stops_reading, vanishes, sends_rubbish, reconnects };
inline constexpr int kBadHabits = 4;

// What they have done in all. Thread safe.
struct BadDeeds {
  std::atomic<int> streams = 0;     // opened
  std::atomic<int> vanished = 0;    // connections cut in the middle of a stream
  std::atomic<int> rubbish = 0;     // connections and calls that were refused
  std::atomic<int> taken_over = 0;  // streams that ended because the same client came again
};

// Does so until `stop`, on the calling thread. `address`: the daemon's, on 127.0.0.1; `scene_id`: for its sessions, whose
// ids it hands to nobody: they end when their grace is over.
void behave_badly(BadHabit habit, const std::string& address, const std::string& scene_id, std::uint32_t seed,
                  const std::atomic<bool>& stop, BadDeeds& deeds);

}  // namespace helio::test
