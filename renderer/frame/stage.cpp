#include "renderer/frame/stage.h"

namespace helio {

const char* to_string(StageId id) {
  static constexpr PerStage<const char*> kNames = {
      "integrate",    "resolve", "measure",  "reproject", "choose",
      "trace_lights", "review",  "allocate", "display",   "preview",
      "checkpoint",   "restore",
  };
  return kNames[std::size_t(id)];
}

}  // namespace helio
