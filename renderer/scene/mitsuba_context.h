// What every part of the Mitsuba loader works with.
#pragma once

#include <map>
#include <string>

#include "renderer/scene/mitsuba_values.h"

namespace helio::mitsuba {

struct LoadContext {
  const Document& document;
  const FileSource& source;
  MemoryBudget& budget;
  Diagnostics& diagnostics;
  SceneDescription& scene;
  std::map<std::string, int> images;              // by file name as written
  std::map<const Element*, Material> materials;   // bsdfs already read
};

}  // namespace helio::mitsuba
