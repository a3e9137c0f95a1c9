// What the probes of earlier views say of a new one's tiles: how hard the light of a surface is to find hardly depends
// on who looks, so only what comes into view has to be probed, once it is more than borders on what is known. (What an
// orthographic camera sees of the sky is never known.)
//
// Views are kept as they were probed, never as they were recalled: of a thousand tiny moves each asks the very view
// that saw the surface, and nothing drifts.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

// Of one way of rendering a tile: mean relative error (square) of a pixel with one sample, and mean rays of a sample.
struct TechniqueEstimate {
  double error = 0, cost = 0;
};

struct TileEstimate {
  TechniqueEstimate path, bdpt;

  void add(const TileEstimate& other);
  TileEstimate over(double n) const;  // of a sum of n
};

// A view of a scene, or the part of it that was probed.
struct ProbedView {
  CameraPose pose;
  int width = 0, height = 0;                       // of the film
  double brightness = 0;                           // mean luminance that all errors are relative to
  std::vector<std::optional<TileEstimate>> tiles;  // as LightTiles numbers them; none: not probed
};

class TechniqueHistory {
 public:
  // Views that are kept. With more of them the next view is probed as a whole.
  static constexpr std::size_t kMostViews = 8;
  using Views = std::vector<std::shared_ptr<const ProbedView>>;

  // Of this scene, of which the views say something: the newest first. Of another scene or another size of film there
  // are none, nor when there are too many.
  Views views(const std::shared_ptr<const RenderScene>& scene, int width, int height) const;
  // A view that drew on others is added to them; one that was probed as a whole takes their place.
  void note(const std::shared_ptr<const RenderScene>& scene, std::shared_ptr<const ProbedView> view, bool whole);
  void forget() { views_.clear(); }
  std::size_t bytes() const;

 private:
  std::weak_ptr<const RenderScene> scene_;
  Views views_;
};

// Means of what the views know of each tile in [first, first + count), as LightTiles numbers them, of a film of their
// size: by the surfaces that five rays of the tile meet, of which views have to have seen two, from the
// same side. Pure.
std::vector<std::optional<TileEstimate>> recall_tiles(const RenderScene& scene, const CameraPose& pose,
                                                      const TechniqueHistory::Views& views, std::size_t first,
                                                      std::size_t count);

}  // namespace helio
