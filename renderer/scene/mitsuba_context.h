// What every part of the Mitsuba loader works with.
#pragma once

#include <map>
#include <set>
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
  // Bsdfs whose base colour is the attribute "vertex_color" of the mesh that wears them (mesh_attribute); and whether
  // the bsdf being read is such a one so far.
  std::set<const Element*> vertex_colored;
  bool reads_vertex_color = false;
};

}  // namespace helio::mitsuba
