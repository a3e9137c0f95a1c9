// Positions drawn from reconstruction filters against the filters' own integrals, and pictures of an edge filtered so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "renderer/trace/sampling/pixel_filter_sampling.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

using Kind = PixelFilterKind;

double reach_of(const PixelFilter& filter) {
  if (filter.kind == Kind::box) return 0.5;
  return filter.kind == Kind::tent ? filter.scale : 4 * filter.scale;
}

// Integral of the filter, not normalised, from its centre to x.
double integral(const PixelFilter& filter, double x) {
  const double reach = reach_of(filter), s = filter.scale;
  x = std::clamp(x, -reach, reach);
  if (filter.kind == Kind::box) return x;
  if (filter.kind == Kind::tent) return x - 0.5 * x * (std::abs(x) / s);  // 1e-300 squared is 0
  return s * std::sqrt(std::acos(-1) / 2) * std::erf(x / s / std::sqrt(2)) - std::exp(-8.0) * x;
}

// Of the filter cut off at [low, high], the share below x.
double share_below(const PixelFilter& filter, double low, double high, double x) {
  const double from = integral(filter, low), to = integral(filter, high);
  return (integral(filter, std::clamp(x, low, high)) - from) / (to - from);
}

struct Cut {
  double low, high;
};

// In the middle of a film; in its first and last pixel; in a film of one pixel; two pixels from one edge.
constexpr Cut kCuts[] = {{-1000, 1000}, {-0.5, 1000}, {-1000, 0.5}, {-0.5, 0.5}, {-2.5, 1000}};
const std::vector<PixelFilter> kFilters = {{Kind::tent, 0.3},     {Kind::tent, 1},       {Kind::tent, 16},
                                           {Kind::gaussian, 0.1}, {Kind::gaussian, 0.5}, {Kind::gaussian, 16}};

TEST(PixelFilter, PositionsFollowTheFilter) {
  constexpr int kCells = 100, kSamples = 1'000'000;
  const int tests = int(kFilters.size() * std::size(kCuts));
  Random random(21);
  for (const PixelFilter& filter : kFilters) {
    for (const auto& [low, high] : kCuts) {
      const double from = std::max(low, -reach_of(filter)), to = std::min(high, reach_of(filter));
      std::vector<double> observed(kCells), expected(kCells);
      for (int i = 0; i < kSamples; ++i) {
        const double x = sample_pixel_filter(filter, random.next_double(), low, high);
        ASSERT_TRUE(x >= from && x <= to) << x;
        ++observed[std::size_t(std::clamp(int((x - from) / (to - from) * kCells), 0, kCells - 1))];
      }
      for (int i = 0; i < kCells; ++i) {
        const double left = from + (to - from) * i / kCells, right = from + (to - from) * (i + 1) / kCells;
        expected[std::size_t(i)] =
            kSamples * (share_below(filter, low, high, right) - share_below(filter, low, high, left));
      }
      const ChiSquareResult result = chi_square_test(observed, expected);
      EXPECT_TRUE(result.passes(kSignificance, tests))
          << int(filter.kind) << ' ' << filter.scale << " in [" << low << ", " << high << "]: " << result.summary();
    }
  }
}

TEST(PixelFilter, PositionsAreTheInverseOfTheIntegral) {
  std::vector<PixelFilter> filters = kFilters;
  filters.push_back({Kind::tent, 1e-300});
  filters.push_back({Kind::gaussian, 1e-300});
  for (const PixelFilter& filter : filters) {
    for (const auto& cut : kCuts) {
      const double low = cut.low, high = cut.high;  // clang's lambdas capture no bindings
      double last = -std::numeric_limits<double>::infinity();
      const auto check = [&](double u) {
        const double x = sample_pixel_filter(filter, u, low, high);
        ASSERT_GE(x, last) << u;
        ASSERT_NEAR(share_below(filter, low, high, x), u, 1e-6) << int(filter.kind) << ' ' << filter.scale;
        last = x;
      };
      for (const double u : {0.0, 5e-324, 1e-12, 0x1p-24, 1e-5}) check(u);
      for (int i = 1; i < 10000; ++i) check(i / 10000.0);
      for (const double u : {1 - 1e-5, 1 - 0x1p-24, 1 - 0x1p-53, 1.0}) check(u);
      const double from = std::max(low, -reach_of(filter)), to = std::min(high, reach_of(filter));
      // Towards its end the filter falls to 0, so that rounding by e moves the position by about sqrt(e).
      EXPECT_NEAR(sample_pixel_filter(filter, 0, low, high), from, 1e-6 * reach_of(filter));
      EXPECT_NEAR(sample_pixel_filter(filter, 1, low, high), to, 1e-6 * reach_of(filter));
    }
  }
}

TEST(PixelFilter, TheSmallestScaleIsThePixelsCentre) {
  for (const Kind kind : {Kind::tent, Kind::gaussian}) {
    for (const double u : {0.0, 1e-9, 0.25, 0.5, 1.0}) {
      EXPECT_LT(std::abs(sample_pixel_filter({kind, std::numeric_limits<double>::denorm_min()}, u, -0.5, 9)), 1e-300);
    }
  }
}

// Where a ray starts, in pixels from the film's upper left corner.
CameraPose flat_pose(int height) {
  CameraPose pose = *look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 1);
  pose.projection = Projection::orthographic;
  pose.half_height = 0.5 * height;
  return pose;
}

TEST(PixelFilter, TheCameraLooksWhereTheFilterSaysAndNeverBesideTheFilm) {
  constexpr int kWidth = 9, kHeight = 7;
  Random random(22);
  for (const PixelFilter& filter : kFilters) {
    const Camera camera(flat_pose(kHeight), kWidth, kHeight, {0, 0, 0}, filter);
    for (int i = 0; i < 20000; ++i) {
      const int x = i % kWidth, y = i / kWidth % kHeight;
      const V2f u = i < 2 * kWidth * kHeight ? V2f(float(i & 1)) : random.next_v2f();
      const CameraRay ray = camera.generate_ray(x, y, u, {0.5f, 0.5f});
      const double film_x = ray.origin.x + 0.5 * kWidth, film_y = 0.5 * kHeight - ray.origin.y;
      ASSERT_TRUE(film_x >= 0 && film_x <= kWidth && film_y >= 0 && film_y <= kHeight) << film_x << ' ' << film_y;
      const double cx = x + 0.5, cy = y + 0.5;
      ASSERT_NEAR(film_x, cx + sample_pixel_filter(filter, u.x, -cx, kWidth - cx), 1e-5);
      ASSERT_NEAR(film_y, cy + sample_pixel_filter(filter, u.y, -cy, kHeight - cy), 1e-5);
    }
  }
}

TEST(PixelFilter, TheBoxIsAPositionInThePixelWhateverItsScale) {
  const CameraPose pose = camera_at({0.1, 0, 0.95}, {0, -0.2, -1}, 75);
  const Camera plain(pose, 9, 7, {0, 0, 0}), box(pose, 9, 7, {0, 0, 0}, {Kind::box, 7});
  Random random(23);
  for (int i = 0; i < 1000; ++i) {
    const V2f u = random.next_v2f();
    EXPECT_EQ(plain.generate_ray(i % 9, i % 7, u, {0.5f, 0.5f}).direction,
              box.generate_ray(i % 9, i % 7, u, {0.5f, 0.5f}).direction);
  }
}

// A sheet that shines by 1 covers the film up to a column and a row; all else is black. A pixel's mean is the product
// of the shares of its filter, cut off at the film, that lie before either.
TEST(PixelFilter, AnEdgeIsFilteredAsByItsIntegral) {
  constexpr int kWidth = 12, kHeight = 10;
  constexpr double kColumn = 5.3, kRow = 4.8;
  constexpr std::uint32_t kSamplesPerHalf = 8192;
  constexpr double kRounding = 1e-4;  // pixels: the scene is widened by 2^-19 of its radius, rays are floats
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0, 0, 0), Rgb(1, 1, 1))};
  add_mesh(scene, quad({float(-0.5 * kWidth - 2), float(0.5 * kHeight - kRow), 0}, {float(kColumn + 2), 0, 0},
                       {0, float(kRow + 2), 0}, 0));
  const auto sheet = build(std::move(scene));
  for (const PixelFilter& filter :
       std::vector<PixelFilter>{{}, {Kind::tent, 1}, {Kind::tent, 2.5}, {Kind::gaussian, 0.5}, {Kind::gaussian, 3}}) {
    const Film film = render(*sheet, flat_pose(kHeight), kWidth, kHeight, kSamplesPerHalf, {}, nullptr, filter);
    int grey = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double cx = x + 0.5, cy = y + 0.5;
        const double p =
            share_below(filter, -cx, kWidth - cx, kColumn - cx) * share_below(filter, -cy, kHeight - cy, kRow - cy);
        const double error = std::sqrt(p * (1 - p) / (kHalves * kSamplesPerHalf));
        EXPECT_NEAR(moments_of(film, x, y).mean[0], p, 3 * error + kRounding)
            << int(filter.kind) << ' ' << filter.scale << ": pixel " << x << ' ' << y;
        grey += p > 0.01 && p < 0.99;
      }
    }
    EXPECT_GE(grey, filter.kind == Kind::box ? 10 : 18);  // 6 + 5 - 1 pixels under the edge, more with a wider filter
  }
}

// A pixel's samples do not depend on the region, though some lie outside it.
TEST(PixelFilter, ARegionHasThePixelsOfTheWhole) {
  constexpr int kSide = 40;
  const CameraPose pose = camera_at({0.1, 0, 0.95}, {0, -0.2, -1}, 75);
  const PixelFilter filter{Kind::gaussian, 1.5};
  const auto scene = build(mixed_scene());
  const Film whole = render(*scene, pose, kSide, kSide, 4, {}, nullptr, filter);
  EXPECT_FALSE(same_bits(whole, render(*scene, pose, kSide, kSide, 4)));
  const PixelRect region{5, 6, 18, 23};
  const Camera camera(pose, kSide, kSide, scene->origin(), filter);
  Film part(kSide, kSide), in_steps(kSide, kSide);
  TraceStats stats;
  for (int half = 0; half < kHalves; ++half) {
    ASSERT_TRUE(trace_window(*scene, camera, {}, {half, 0, 4}, region, CancelToken(), part, stats));
    for (std::uint32_t i = 0; i < 4; ++i) {
      ASSERT_TRUE(trace_window(*scene, camera, {}, {half, i, 1}, whole.bounds(), CancelToken(), in_steps, stats));
    }
  }
  EXPECT_TRUE(same_bits(whole, in_steps));
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      for (int half = 0; half < kHalves; ++half) {
        ASSERT_EQ(part.half(half, x, y).sum[0], whole.half(half, x, y).sum[0]) << x << ' ' << y;
        ASSERT_EQ(part.half(half, x, y).count, 4u);
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
