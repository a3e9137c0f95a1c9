// Hard case 7: a zoom by a hundred shows what the wide view's middle held.
#include <gtest/gtest.h>

#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

TEST(Zoom, AHundredTimesCloserSeesWhatTheMiddleHeld) {
  const auto scene = build(mixed_scene());
  const double wide = 75, narrow = 2 * std::atan(std::tan(wide * 3.14159265358979 / 360) / 100) * 180 / 3.14159265358979;
  const V3d eye(0.1, 0, 0.95), target(0, -0.2, -1);
  // The middle 2x2 of 200x200 pixels are a hundredth of the picture's sides.
  constexpr int kSide = 200;
  const PixelRect middle{99, 99, 101, 101};
  Film film(kSide, kSide);
  const Camera camera(camera_at(eye, target, wide), kSide, kSide, scene->origin());
  TraceStats stats;
  for (int half = 0; half < kHalves; ++half) {
    ASSERT_TRUE(trace_window(*scene, camera, {}, {half, 0, 4096}, middle, CancelToken(), film, stats));
  }
  double mean = 0, variance = 0;
  for (int y = middle.y0; y < middle.y1; ++y) {
    for (int x = middle.x0; x < middle.x1; ++x) {
      double sum = 0, squares = 0, count = 0;
      for (int half = 0; half < kHalves; ++half) {
        const HalfPixel& p = film.half(half, x, y);
        sum += p.sum[1];
        squares += p.sum_squares(1);
        count += p.count;
      }
      mean += sum / count / 4;
      variance += (squares / count - sqr(float(sum / count))) / count / 16;
    }
  }
  const MeanEstimate zoomed = mean_of(render(*scene, camera_at(eye, target, narrow), 16, 16, 256));
  EXPECT_NEAR(zoomed.mean.y, mean, 3 * (zoomed.standard_error.y + std::sqrt(variance)) + 1e-3 * mean);
  EXPECT_EQ(stats.invalid_samples, 0u);
}

}  // namespace
}  // namespace helio::test
