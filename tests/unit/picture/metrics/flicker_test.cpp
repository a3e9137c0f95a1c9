#include "renderer/metrics/flicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/picture/metrics/test_picture.h"

namespace helio {
namespace {

using test::Picture;

struct Positions {
  int width, height;
  std::vector<float> x, y;

  // Every pixel's centre, moved.
  Positions(int w, int h, float dx, float dy) : width(w), height(h) {
    for (int i = 0; i < w * h; ++i) {
      x.push_back(float(i % w) + 0.5f + dx);
      y.push_back(float(i / w) + 0.5f + dy);
    }
  }
  PreviousPositions view() const { return {width, height, x.data(), y.data()}; }
};

TEST(FlickerMetric, IsTheChangeOfTheErrorNotTheError) {
  const int w = 6, h = 4;
  const Positions still(w, h, 0, 0);
  // Both frames 0.5 too bright, of scenes of different brightness.
  const Picture r0(w, h, 1.0f), x0(w, h, 1.5f), r1(w, h, 3.0f), x1(w, h, 3.5f), x2(w, h, 2.75f);
  const FlickerFrame before{x0.view(), r0.view()};
  EXPECT_EQ(flicker(before, {x1.view(), r1.view()}, still.view())->mean, 0);
  EXPECT_EQ(flicker(before, {x1.view(), r1.view()}, still.view())->share_without_previous, 0);
  // From +0.5 to -0.25.
  EXPECT_DOUBLE_EQ(flicker(before, {x2.view(), r1.view()}, still.view())->mean, 0.75);
  EXPECT_DOUBLE_EQ(flicker({x2.view(), r1.view()}, before, still.view())->mean, 0.75);
  // One channel of one pixel changes by 0.5: a mean of 0.5 / 72.
  Picture x3 = x0;
  x3.channels[1][7] += 0.5f;
  EXPECT_DOUBLE_EQ(flicker(before, {x3.view(), r0.view()}, still.view())->mean, 0.5 / (3 * w * h));
}

TEST(FlickerMetric, FollowsTheMotionAndLeavesOutWhatIsNew) {
  const int w = 5, h = 3;
  Picture before(w, h, 0.0f), after(w, h, 0.0f);
  for (auto& c : before.channels) {
    for (int i = 0; i < w * h; ++i) c[std::size_t(i)] = float(i * i);
  }
  // The picture moved two pixels to the right and one down.
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const bool seen = x >= 2 && y >= 1;
        after.channels[c][std::size_t(y * w + x)] =
            seen ? before.channels[c][std::size_t((y - 1) * w + x - 2)] : 1000.0f;
      }
    }
  }
  Positions moved(w, h, -2, -1);
  const Flicker kept = flicker(before.view(), after.view(), moved.view()).value();
  EXPECT_EQ(kept.mean, 0);
  EXPECT_DOUBLE_EQ(kept.share_without_previous, 1 - 3 * 2 / 15.0);
  EXPECT_GT(flicker(before.view(), after.view(), Positions(w, h, 0, 0).view())->mean, 1);
  // A position counts for the pixel that it lies in, up to its upper borders.
  for (float& x : moved.x) x += 0.49f;
  EXPECT_EQ(flicker(before.view(), after.view(), moved.view())->mean, 0);
  // NaN and infinity: not seen. Of the six pixels five are left.
  moved.x[std::size_t(1 * w + 2)] = std::nanf("");
  EXPECT_DOUBLE_EQ(flicker(before.view(), after.view(), moved.view())->share_without_previous, 1 - 5 / 15.0);
  moved.y[std::size_t(1 * w + 3)] = std::numeric_limits<float>::infinity();
  EXPECT_DOUBLE_EQ(flicker(before.view(), after.view(), moved.view())->share_without_previous, 1 - 4 / 15.0);
}

TEST(FlickerMetric, BearsExtremesAndRefusesWhatCannotBeCompared) {
  const Picture bright(1, 1, 1e9f), faint(1, 1, std::numeric_limits<float>::denorm_min()), wide(2, 1, 0.0f);
  const Positions one(1, 1, 0, 0), two(2, 1, 0, 0), gone(1, 1, 1, 0);
  EXPECT_DOUBLE_EQ(flicker(faint.view(), bright.view(), one.view())->mean, 1e9);
  Picture broken = faint;
  broken.channels[0][0] = std::nanf("");
  EXPECT_EQ(flicker(broken.view(), faint.view(), one.view()).error().to_string(),
            "previous error image: is not finite at pixel (0, 0), channel 0");
  EXPECT_EQ(flicker({faint.view(), broken.view()}, {faint.view(), faint.view()}, one.view()).error().where,
            "previous reference");
  EXPECT_EQ(flicker({broken.view(), faint.view()}, {faint.view(), faint.view()}, one.view()).error().where,
            "previous picture");
  EXPECT_FALSE(flicker(wide.view(), faint.view(), one.view()).ok());
  EXPECT_EQ(flicker(faint.view(), faint.view(), two.view()).error().to_string(),
            "previous positions: 2x1, must be the picture's 1x1");
  EXPECT_EQ(flicker(faint.view(), faint.view(), gone.view()).error().code, ErrorCode::failed_precondition);
}

}  // namespace
}  // namespace helio
