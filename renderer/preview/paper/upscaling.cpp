#include "renderer/preview/paper/upscaling.h"

#include <algorithm>
#include <cmath>

namespace helio {
namespace {

constexpr float kAlpha = 0.1f;

}  // namespace

void upscale(const UpscalingInput& in, const PixelRect& window, const PixelRect& film_region, int film_width,
             const std::vector<Rgb>* history, std::vector<Rgb>& to) {
  const auto clamp_x = [&](int x) { return std::clamp(x, in.region.x0, in.region.x1 - 1); };
  const auto clamp_y = [&](int y) { return std::clamp(y, in.region.y0, in.region.y1 - 1); };
  const auto at = [&](int x, int y) {
    return std::size_t(clamp_y(y)) * std::size_t(in.width) + std::size_t(clamp_x(x));
  };
  const auto film_index = [&](int x, int y) { return std::size_t(y) * std::size_t(film_width) + std::size_t(x); };
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const float qx = float((x + 0.5) * in.scale_x), qy = float((y + 0.5) * in.scale_y);
      const int cx = clamp_x(int(qx)), cy = clamp_y(int(qy));
      const bool moved = std::hypot(cx + 0.5 - in.x, cy + 0.5 - in.y) < in.jittered_radius;
      const float jitter_x = moved ? float(in.jitter.x) : 0, jitter_y = moved ? float(in.jitter.y) : 0;
      const float fx = qx - 0.5f - jitter_x, fy = qy - 0.5f - jitter_y;
      const int x0 = int(std::floor(fx)), y0 = int(std::floor(fy));
      const float ax = fx - float(x0), ay = fy - float(y0);
      const Rgb color = (in.colors[at(x0, y0)] * (1 - ax) + in.colors[at(x0 + 1, y0)] * ax) * (1 - ay) +
                        (in.colors[at(x0, y0 + 1)] * (1 - ax) + in.colors[at(x0 + 1, y0 + 1)] * ax) * ay;
      Rgb& out = to[film_index(x, y)];
      out = color;
      if (!history) continue;
      const V2f& motion = in.motion[at(cx, cy)];
      const float hx = float(x) + motion.x / float(in.scale_x), hy = float(y) + motion.y / float(in.scale_y);
      if (!(hx >= float(film_region.x0) && hx <= float(film_region.x1 - 1) && hy >= float(film_region.y0) &&
            hy <= float(film_region.y1 - 1)))
        continue;
      const int bx = int(hx), by = int(hy);
      const int bx1 = std::min(bx + 1, film_region.x1 - 1), by1 = std::min(by + 1, film_region.y1 - 1);
      const float wx = hx - float(bx), wy = hy - float(by);
      Rgb kept = ((*history)[film_index(bx, by)] * (1 - wx) + (*history)[film_index(bx1, by)] * wx) * (1 - wy) +
                 ((*history)[film_index(bx, by1)] * (1 - wx) + (*history)[film_index(bx1, by1)] * wx) * wy;
      Rgb least = in.colors[at(cx, cy)], most = least;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const Rgb& near = in.colors[at(cx + i, cy + j)];
          for (int c = 0; c < 3; ++c) {
            least[c] = std::min(least[c], near[c]);
            most[c] = std::max(most[c], near[c]);
          }
        }
      }
      for (int c = 0; c < 3; ++c) kept[c] = std::clamp(kept[c], least[c], most[c]);
      const float dx = qx - (float(cx) + 0.5f + jitter_x), dy = qy - (float(cy) + 0.5f + jitter_y);
      const float beta = std::exp(-2 * (dx * dx + dy * dy));
      out = kept + (color - kept) * (kAlpha * beta);
    }
  }
}

}  // namespace helio
