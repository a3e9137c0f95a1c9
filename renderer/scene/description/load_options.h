// What the caller of a load chooses.
#pragma once

#include <cstdint>
#include <string>

#include "renderer/base/memory_ledger.h"
#include "renderer/scene/description/file_source.h"

namespace helio {

struct SceneLoadOptions {
  double time_s = 0;                        // the animation is evaluated at this time
  // Name of the animation (clip) to play, or its number written in decimal; empty: the first that moves anything.
  std::string animation;
  // Refuses files that break a rule of their format even where their meaning is beyond doubt (scenes/README.md).
  bool strict = false;
  std::uint64_t max_memory_bytes = 8ull << 30;  // everything that loading may hold at once, decoded images included
  MemoryLedger* ledger = nullptr;  // what loading holds is taken from it besides, and left in it; null: none
  // "FILE.exr" (read through environment_source) or "R,G,B"; empty: what the scene says. See environment.h.
  std::string environment;
  const FileSource* environment_source = nullptr;
};

}  // namespace helio
