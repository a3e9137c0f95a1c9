// What a preview is asked for.
#pragma once

#include <memory>
#include <optional>

#include "renderer/base/gaze_density.h"
#include "renderer/base/pixel_filter.h"
#include "renderer/base/published_foveation.h"
#include "renderer/film/core/film.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

struct PreviewTarget {
  std::shared_ptr<const RenderScene> scene;
  CameraPose camera;  // fitted()
  PathSettings path;  // integrator path
  PixelFilter filter;
  PixelRect region;
  // now_s() clock. Visibility and lookup take what they take; fresh samples and levels of the filter are given up so
  // that the sweeps end by until_s.
  double until_s = 0;
  // Rests at the view of the newest preview; nobody writes to it until the sweeps are over. Null: none.
  const Film* film = nullptr;
  const DisplayLayer* display = nullptr;  // of the film, likewise; null: it is shown as it is
  std::optional<GazeDensity> density = {};  // where somebody looks; absent: everywhere alike
  // Surfaces are traced in every second pixel along either axis (sparse_surfaces.h); published: 0.555 of the pixels' sides.
  bool upscaling = false;
  // As published, around the gaze (paper/paper_preview.h), with no use for until_s, film, display and density; both or
  // neither.
  std::optional<PublishedFoveation> published = {};
  std::optional<Gaze> gaze = {};
};

}  // namespace helio
