// An edited scene: a new snapshot that shares with the one it was made from whatever the edit leaves as it is.
//
// Meshes, images and pyramids are always shared. An edit of materials or lights shares the whole BVH as well: only
// light tables and records are new, and the picture is, bit for bit, that of a scene loaded with the new values. The
// table that samples an environment map is shared until its colour changes.
//
// An object that is moved gets a new place in a new top level. One that was placed once and hence baked is taken out of
// the flat geometry and becomes an instance, whose own space is the rebased world as loaded, so that moves do not add
// up: what is put back stands where it stood. What is left of the flat geometry becomes one bottom level. Both are
// built once, with the first move of that object; from then on a move costs a top level of as many nodes as there are
// instances. The origin stays where it was, and so does the resolution of float around it. Scenes with moved objects
// are rendered by the general kernel. A picture equals that of a scene loaded so in distribution.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>

#include "renderer/scene/load/scene_edit.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

struct EditOptions {
  int threads = 0;  // for what is built of the BVH; 0: all cores
  // Of all that the edited scene holds and its base does not, while it is built.
  std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max();
  MemoryLedger* ledger = nullptr;       // what the edit takes is taken from it besides, and left in it; null: none
  const CancelToken* cancel = nullptr;  // null: never
};

// `changes`: from resolve_edits() on base->description(). An empty set of changes gives a snapshot like the base.
// Errors: invalid_argument (a transform that flattens, leaves the coordinate range, makes an object too small to be
// traced or pulls it apart beyond what its floats tell), resource_exhausted (max_bytes, number of lights), cancelled.
Result<std::shared_ptr<const RenderScene>> edit_scene(const std::shared_ptr<const RenderScene>& base,
                                                      const SceneChanges& changes, const EditOptions& options = {});

}  // namespace helio
