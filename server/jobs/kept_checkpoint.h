// Checkpoints that are read from the state folder, of jobs and of sessions.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "renderer/frame/picture_checkpoint.h"
#include "server/base/memory_account.h"

namespace helio {

inline constexpr std::uint64_t kMostHeaderBytes = 1 << 20;  // of a file of CheckpointFiles

// The checkpoint, whose memory is counted until the last who holds it has let go of it: the render loop, as a rule.
inline std::shared_ptr<const PictureCheckpoint> counted(Reservation memory, PictureCheckpoint picture) {
  struct Counted {
    Reservation memory;
    PictureCheckpoint picture;
  };
  const auto both = std::make_shared<Counted>(Counted{std::move(memory), std::move(picture)});
  return {both, &both->picture};
}

}  // namespace helio
