// What every part of the Mitsuba loader works with.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "renderer/scene/mitsuba/values.h"

namespace helio::mitsuba {

// Depths between which a sensor sees. Here cameras see at all depths, which is said where it may matter.
struct ClipPlanes {
  std::string sensor;               // its place and label
  std::size_t camera = 0;           // of SceneDescription::cameras
  std::optional<double> near_clip;  // stated
  double far_clip = 0;
};

struct LoadContext {
  const Document& document;
  const FileSource& source;
  MemoryBudget& budget;
  Diagnostics& diagnostics;
  SceneDescription& scene;
  std::map<std::string, int> images;              // by file name as written
  std::map<const Element*, Material> materials;   // bsdfs already read
  // Bsdfs whose base colour is an attribute of the mesh that wears them (mesh_attribute), with its name; and that of
  // the bsdf being read, as far as it is read: empty: none.
  std::map<const Element*, std::string> attributes;
  std::string attribute;
  std::vector<ClipPlanes> clips;  // of the sensors read
};

}  // namespace helio::mitsuba
