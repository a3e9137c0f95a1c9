#include "renderer/trace/reuse/forward_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/trace/camera/camera_projection.h"

namespace helio {
namespace {

// Depths that differ by less than this share are of one surface.
constexpr double kSameDepths = 0.01;

}  // namespace

ForwardMap::ForwardMap(const HistorySource& source, const CameraPose& from, const CameraPose& to,
                       const PixelRect& region, const V3d& scene_origin, const CancelToken* cancel)
    : width_(source.width()), landed_(std::size_t(source.width()) * std::size_t(source.height()), -1) {
  const CameraProjection there(from, source.width(), source.height(), scene_origin);
  const CameraProjection here(to, source.width(), source.height(), scene_origin);
  struct Landing {
    double depth = std::numeric_limits<double>::infinity(), off2 = 0;
  };
  std::vector<Landing> landings(landed_.size());
  const PixelRect seen = intersect(region, {0, 0, source.width(), source.height()});
  for (int y = seen.y0; y < seen.y1; ++y) {
    if (cancel && cancel->cancelled()) return;
    for (int x = seen.x0; x < seen.x1; ++x) {
      const CentreHit& centre = source.centre(x, y);
      if (centre.border || source.pixel(x, y).empty()) continue;
      const V3d position = centre.hit() ? there.position_at(x + 0.5, y + 0.5, double(centre.depth))
                                        : there.direction_at(x + 0.5, y + 0.5);
      const FilmPoint point = centre.hit() ? here.point(position) : here.direction(position);
      if (!point.in_front || !(point.x >= 0 && point.y >= 0 && point.x < source.width() && point.y < source.height()))
        continue;
      const int px = int(point.x), py = int(point.y);
      const double off_x = point.x - px - 0.5, off_y = point.y - py - 0.5;
      const Landing landing{
          !centre.hit() ? std::numeric_limits<double>::max() : dot(position - here.origin(), to.forward),
          off_x * off_x + off_y * off_y};
      const std::size_t place = std::size_t(py) * std::size_t(width_) + std::size_t(px);
      Landing& best = landings[place];
      const double tolerance = kSameDepths * std::abs(best.depth);
      const bool nearer = landed_[place] < 0 || landing.depth < best.depth - tolerance;
      const bool beside = !nearer && landing.depth <= best.depth + tolerance && landing.off2 < best.off2;
      if (!nearer && !beside) continue;
      best = {std::min(best.depth, landing.depth), landing.off2};
      landed_[place] = std::int32_t(y) * width_ + x;
    }
  }
}

}  // namespace helio
