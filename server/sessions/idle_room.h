// Makes room in the memory account: waits for what has ended already, then ends what nobody uses. First edited scenes,
// which can be made again in milliseconds, then sessions to which nobody listens.
#pragma once

#include "server/base/memory_account.h"
#include "server/base/reaper.h"
#include "server/scenes/scene_registry.h"
#include "server/sessions/session_registry.h"

namespace helio {

class IdleRoom final : public RoomMaker {
 public:
  // All of them may be constructed later.
  IdleRoom(MemoryAccount& memory, Reaper& reaper, SceneRegistry& scenes, SessionRegistry& sessions)
      : memory_(memory), reaper_(reaper), scenes_(scenes), sessions_(sessions) {}

  bool make_room(std::uint64_t bytes) override;
  std::uint64_t could_free() const override;

 private:
  MemoryAccount& memory_;
  Reaper& reaper_;
  SceneRegistry& scenes_;
  SessionRegistry& sessions_;
};

}  // namespace helio
