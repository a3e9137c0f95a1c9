#include "renderer/trace/gbuffer/guard_band.h"

namespace helio {

GuardBand::GuardBand(const RenderScene& scene, const Camera& camera, const V3d& axis, const PixelRect& window,
                     int reach, const PixelRect& region)
    : bounds_(intersect({window.x0 - reach, window.y0 - reach, window.x1 + reach, window.y1 + reach},
                        {-1, -1, camera.width() + 1, camera.height() + 1})) {
  const PixelRect inside = intersect(bounds_, region);
  if (inside.area() == bounds_.area()) return;
  hits_.resize(std::size_t(bounds_.area()));
  PrimaryHits centres(scene, camera, axis);
  const PixelRect strips[] = {{bounds_.x0, bounds_.y0, bounds_.x1, inside.y0},
                              {bounds_.x0, inside.y0, inside.x0, inside.y1},
                              {inside.x1, inside.y0, bounds_.x1, inside.y1},
                              {bounds_.x0, inside.y1, bounds_.x1, bounds_.y1}};
  for (const PixelRect& strip : strips) {
    for (int y0 = strip.y0; y0 < strip.y1; y0 += kPathGroupSize) {
      for (int x0 = strip.x0; x0 < strip.x1; x0 += kPathGroupSize) {
        const PixelRect part = intersect({x0, y0, x0 + kPathGroupSize, y0 + kPathGroupSize}, strip);
        centres.trace(part);
        rays_ += std::uint64_t(part.area());
        for (int y = part.y0; y < part.y1; ++y) {
          for (int x = part.x0; x < part.x1; ++x) hits_[index(x, y)] = centres.at(x, y);
        }
      }
    }
  }
}

}  // namespace helio
