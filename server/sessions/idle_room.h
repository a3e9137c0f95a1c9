// Makes room in the memory account: waits for what has ended already, then ends what nobody uses. First edited scenes,
// which can be made again in milliseconds, then what is kept for later (SpareMemory), then sessions to which nobody
// listens.
#pragma once

#include "server/base/memory_account.h"
#include "server/base/reaper.h"
#include "server/scenes/scene_registry.h"
#include "server/sessions/session_registry.h"

namespace helio {

// Memory that is kept in case somebody asks for it again. Thread safe.
class SpareMemory {
 public:
  virtual ~SpareMemory() = default;
  // Frees the part that was used least recently. False: nothing can be freed.
  virtual bool free_some() = 0;
  virtual std::uint64_t could_free() const = 0;
};

class IdleRoom final : public RoomMaker {
 public:
  // All of them may be constructed later.
  IdleRoom(MemoryAccount& memory, Reaper& reaper, SceneRegistry& scenes, SessionRegistry& sessions)
      : memory_(memory), reaper_(reaper), scenes_(scenes), sessions_(sessions) {}

  // Null: there is none any more. Not while memory is asked for.
  void set_spare(SpareMemory* spare) { spare_ = spare; }

  bool make_room(std::uint64_t bytes) override;
  std::uint64_t could_free() const override;

 private:
  MemoryAccount& memory_;
  Reaper& reaper_;
  SceneRegistry& scenes_;
  SessionRegistry& sessions_;
  SpareMemory* spare_ = nullptr;
};

}  // namespace helio
