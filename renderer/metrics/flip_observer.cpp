#include "renderer/metrics/flip_observer.h"

#include "renderer/metrics/flip_color.h"

namespace helio {
namespace {

// From Y, X - Y and Y - Z in units of white.
void convert(const float* __restrict y, const float* __restrict cx, const float* __restrict cz, float* __restrict l,
             float* __restrict a, float* __restrict b, std::size_t width) {
  for (std::size_t i = 0; i < width; ++i) {
    const HuntLab lab = clamped_hunt_lab(y[i] + cx[i], y[i], y[i] - cz[i]);
    l[i] = lab.l;
    a[i] = lab.a;
    b[i] = lab.b;
  }
}

}  // namespace

FlipObserver::FlipObserver(const FlipKernels& kernels, int width, int height)
    : width_(std::size_t(width)), filter_(kernels, width, height), l_(width_), a_(width_), b_(width_) {}

ObservedRow FlipObserver::row(int y, const FlipRows& rows) {
  const FlipFilter::Row& filtered = filter_.row(y, rows);
  convert(filtered.y.data(), filtered.cx.data(), filtered.cz.data(), l_.data(), a_.data(), b_.data(), width_);
  return {l_.data(), a_.data(), b_.data(), filtered.edge.data(), filtered.point.data()};
}

}  // namespace helio
