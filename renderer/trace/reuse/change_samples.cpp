#include "renderer/trace/reuse/change_samples.h"

#include <cmath>
#include <limits>

#include "renderer/base/check.h"
#include "renderer/film/core/film_windows.h"

namespace helio {
namespace {

// That sees `factor` times as much along both axes.
CameraPose widened(CameraPose pose, double factor) {
  pose.half_height *= factor;
  pose.vertical_fov = 2 * std::atan(std::tan(0.5 * pose.vertical_fov) * factor);
  return pose;
}

}  // namespace

ChangeSamples::ChangeSamples(std::shared_ptr<const RenderScene> before, std::shared_ptr<const RenderScene> after,
                             const CameraPose& pose, int width, int height, const PixelRect& region, int side,
                             const PathSettings& settings)
    : scenes_{std::move(before), std::move(after)},
      settings_(settings),
      side_(side),
      columns_((width + side - 1) / side),
      rows_((height + side - 1) / side),
      margin_x_(columns_ * side - width),
      margin_y_(rows_ * side - height),
      pose_(widened(pose, double(rows_) * side / height)),
      bound_(columns_, rows_) {
  HELIO_DCHECK(!region.empty() && pose.lens_radius == 0);
  for (std::unique_ptr<Film>& film : films_) film = std::make_unique<Film>(columns_, rows_);
  const PixelRect cells = {column(region.x0), row(region.y0), column(region.x1 - 1) + 1, row(region.y1 - 1) + 1};
  windows_ = cut_aligned(cells, kPathGroupSize, kPathGroupSize);
}

void ChangeSamples::trace(std::size_t part, TraceStats& stats) {
  const CancelToken never;
  const SampleRange range = {int(part % kHalves), 0, 1};
  for (int s = 0; s < 2; ++s) {
    const Camera camera(pose_, columns_, rows_, scenes_[s]->origin());
    trace_window(*scenes_[s], camera, settings_, range, windows_[part / kHalves], never, *films_[s], stats);
  }
}

void ChangeSamples::collect(std::size_t part) {
  const auto radiance = [](const HalfPixel& half) {
    if (half.count == 0) return Rgb(std::numeric_limits<float>::quiet_NaN());  // it was not finite
    return Rgb(float(half.sum[0]), float(half.sum[1]), float(half.sum[2]));
  };
  const PixelRect& window = windows_[part];
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      Rgb values[2][kHalves];
      for (int s = 0; s < 2; ++s) {
        for (int h = 0; h < kHalves; ++h) values[s][h] = radiance(films_[s]->half(h, x, y));
      }
      bound_.set(x, y, values[0], values[1]);
    }
  }
}

}  // namespace helio
