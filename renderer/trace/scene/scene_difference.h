// What two snapshots of one scene differ in, as far as it tells what a picture of the first still says of the second.
//
// Their values are compared, not the edits that led from one to the other: what was skipped, merged or undone on the
// way does not count.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "renderer/trace/scene/render_scene.h"

namespace helio {

enum class SurfaceChange : std::uint8_t { none, some, all };

struct SceneDifference {
  // By instance of the description: all of its surface looks different or stands elsewhere, or that of some of its
  // materials does. Empty: none of any.
  std::vector<SurfaceChange> surfaces;
  std::vector<bool> materials;  // those that look different, by number; a blend with what it mixes. Empty: none
  bool environment = false;
  bool lights = false;  // point, spot and directional ones, and projectors
  // The whole difference: all that shines sends so many times as much, per channel in [2^-20, 2^20]. Light adds up, so
  // pictures differ by just this factor.
  std::optional<Rgb> brightness;

  // Whether centres of pixels may meet something else, or what looks different.
  bool edits_what_shows() const { return !brightness && (!surfaces.empty() || environment); }
  bool empty() const { return surfaces.empty() && materials.empty() && !environment && !lights; }
};

// Nothing: the snapshots are of different loads.
std::optional<SceneDifference> scene_difference(const RenderScene& from, const RenderScene& to);

}  // namespace helio
