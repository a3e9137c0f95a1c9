#include "renderer/trace/gbuffer/gbuffer_pass.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "renderer/base/check.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/gbuffer/guard_band.h"
#include "renderer/trace/gbuffer/silhouette_coverage.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {

int filter_reach(const PixelFilter& filter) {
  switch (filter.kind) {
    case PixelFilterKind::box:
      return 1;
    case PixelFilterKind::tent:
      return std::max(1, int(std::ceil(std::min(filter.scale, 100.0))));
    case PixelFilterKind::gaussian:
      return std::max(1, int(std::ceil(std::min(4 * filter.scale, 100.0))));
  }
  return 1;
}

GbufferPass::GbufferPass(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                         const CameraPose& pose, const PixelFilter& filter)
    : scene_(std::move(scene)),
      film_(film),
      region_(region),
      pose_(pose),
      camera_(pose, film.width(), film.height(), scene_->origin()),  // centres are of pixels, not of filters
      reach_(filter_reach(filter)),
      box_(filter.kind == PixelFilterKind::box) {
  HELIO_DCHECK(film.history());
}

std::uint64_t GbufferPass::find_borders(const PixelRect& window) {
  FilmHistory& history = *film_.history();
  const GuardBand outside(*scene_, camera_, pose_.forward, window, reach_, region_);
  const CameraProjection projection(pose_, film_.width(), film_.height(), scene_->origin());
  SurfaceSteps steps(projection);
  // The brightest with some pixel that the filter reaches.
  const auto border_of = [&](int x, int y) {
    const CentreHit& here = history.centre(x, y);
    Border most = Border::none;
    const PixelRect around = intersect(reached_from(x, y), outside.bounds());
    for (int py = around.y0; py < around.y1; ++py) {
      for (int px = around.x0; px < around.x1; ++px) {
        const CentreHit& there = region_.contains(px, py) ? history.centre(px, py) : outside.at(px, py);
        if (steps.one_surface(here, x + 0.5, y + 0.5, there, px + 0.5, py + 0.5)) continue;
        most = std::max(most, border_between(here, there));
      }
    }
    return most;
  };
  std::vector<std::uint8_t> doubtful;  // of the window: whose rims may tell more
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const Border border = border_of(x, y);
      history.carried(x, y).set_found(border != Border::none);
      doubtful.push_back(box_ && border == Border::plain);
    }
  }
  const SilhouetteCoverage rims(*scene_, camera_, pose_.forward, window, doubtful);
  auto asked = doubtful.begin();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++asked) {
      if (*asked && rims.show_only(history.centre(x, y), x, y, steps)) history.carried(x, y).set_found(0);
    }
  }
  return outside.rays() + rims.rays();
}

void GbufferPass::settle(const PixelRect& window) {
  FilmHistory& history = *film_.history();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      history.centre(x, y).border = history.carried(x, y).found() != 0;
      history.carried(x, y).set_found(0);
    }
  }
}

}  // namespace helio
