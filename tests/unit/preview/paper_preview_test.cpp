// Previews as published: their map and formulas, and that their faults are there and can be mended.
#include "renderer/preview/paper/paper_preview.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "renderer/preview/paper/upscaling.h"
#include "preview_pictures.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 240, kHeight = 160;
constexpr PixelRect kAll{0, 0, kWidth, kHeight};
constexpr Gaze kMiddle{0.5 * kWidth, 0.5 * kHeight};

class Previews {
 public:
  explicit Previews(std::shared_ptr<const RenderScene> scene, int width = kWidth, int height = kHeight)
      : scene_(std::move(scene)), history_(std::make_shared<PreviewHistory>(width, height, true)) {}

  TraceStats stats;
  PublishedFoveation published;
  bool upscaling = false;
  std::shared_ptr<CancelToken> cancel = std::make_shared<CancelToken>();

  Picture show(const CameraPose& camera, const Gaze& gaze = kMiddle, const PixelRect& region = kAll) {
    PreviewTarget target{scene_, camera, {}, {}, region};
    target.upscaling = upscaling;
    target.published = published;
    target.gaze = gaze;
    PaperPreview preview(history_, target, cancel);
    return make(preview, region, stats);
  }

 private:
  std::shared_ptr<const RenderScene> scene_;
  std::shared_ptr<PreviewHistory> history_;
};

using Counts = std::function<bool(double distance)>;  // pixels from the middle

double mean_luminance(const Picture& picture, const Counts& counts) {
  double sum = 0, count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!counts(std::hypot(x + 0.5 - kMiddle.x, y + 0.5 - kMiddle.y))) continue;
      sum += luminance(picture[std::size_t(y) * kWidth + std::size_t(x)]);
      ++count;
    }
  }
  return sum / count;
}

// Root mean square over pixels, of luminance.
double difference(const Picture& a, const Picture& b, const Counts& counts) {
  double sum = 0, count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!counts(std::hypot(x + 0.5 - kMiddle.x, y + 0.5 - kMiddle.y))) continue;
      const std::size_t i = std::size_t(y) * kWidth + std::size_t(x);
      const double d = luminance(a[i]) - luminance(b[i]);
      sum += d * d;
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

void expect_whole(const Picture& picture, std::size_t pixels) {
  ASSERT_EQ(picture.size(), pixels);
  for (const Rgb& pixel : picture) {
    ASSERT_TRUE(is_finite(pixel));
    ASSERT_GE(std::min({pixel.x, pixel.y, pixel.z}), 0.0f);
  }
}

const double kRadius = 0.15 * std::hypot(kMiddle.x, kMiddle.y);
bool everywhere(double) {
  return true;
}
bool in_disk(double distance) {
  return distance < kRadius - 1;
}
bool outside(double distance) {
  return distance > 1.2 * kRadius;
}

const CameraPose kHome = camera_at({0, 0, 0.95}, {0, -0.2, -1}, 70);
CameraPose turned(double degrees) {
  const double a = degrees * 3.14159265358979 / 180;
  return camera_at({0, 0, 0.95}, {1.95 * std::sin(a), -0.2, 0.95 - 1.95 * std::cos(a)}, 70);
}

TEST(KernelLogPolar, GoesThereAndBack) {
  const KernelLogPolar map(640, 360, 320, 180);
  EXPECT_EQ(map.columns(), 356);
  EXPECT_EQ(map.rows(), 200);
  EXPECT_NEAR(map.farthest(), std::hypot(320.0, 180.0), 1e-9);
  for (double column = 120; column <= 356; column += 7.3) {
    for (double row = 0; row < 200; row += 3.7) {
      const auto at = map.to_picture(column, row);
      const auto back = map.to_buffer(at.x, at.y);
      ASSERT_NEAR(back.x, column, 1e-6);
      ASSERT_NEAR(std::remainder(back.y - row, 200), 0, 1e-6);
    }
  }
  // Eq. 2.3: the last column is the farthest corner, the first the gaze; the kernel spends most columns near it.
  EXPECT_NEAR(map.distance_at(356), map.farthest(), 1e-9);
  EXPECT_NEAR(map.distance_at(0), 1, 1e-12);
  EXPECT_NEAR(map.distance_at(178), std::exp(std::log(map.farthest()) / 16), 1e-9);
  // Eq. 4.5.
  const int first = map.first_column(55);
  EXPECT_GE(map.distance_at(first), 55);
  EXPECT_LT(map.distance_at(first - 1), 55);
}

TEST(KernelLogPolar, BlurAndDetailFollowTheDistance) {
  const KernelLogPolar map(640, 360, 320, 180);
  const double farthest = map.farthest(), published = 200.0 / 1080;
  EXPECT_NEAR(map.blur_diameter(0.1 * farthest), 3 * published, 1e-9);
  EXPECT_NEAR(map.blur_diameter(0.15 * farthest), 3.8 * published, 1e-9);
  EXPECT_NEAR(map.blur_diameter(farthest), 17.4 * published, 1e-9);
  EXPECT_NEAR(map.blur_diameter(0), 1.4 * published, 1e-9);
  EXPECT_NEAR(map.detail_bias(0), 0.3, 1e-9);
  EXPECT_NEAR(map.detail_bias(map.columns()), 3.3, 1e-9);
  const double u = 0.9, k = std::pow(u, 4), smooth = 3 * k * k - 2 * k * k * k;
  EXPECT_NEAR(map.detail_bias(u * map.columns()), 0.3 + 3 * std::pow(smooth, 3), 1e-9);
}

TEST(KernelLogPolar, IsDefinedForTinyPicturesAndAGazeBeside) {
  for (const auto& [width, height, x, y] :
       {std::tuple(1, 1, 0.5, 0.5), std::tuple(1, 1, 0.0, 0.0), std::tuple(64, 1, -1e6, 1e6),
        std::tuple(8, 8, 8.0, -3.0)}) {
    const KernelLogPolar map(width, height, x, y);
    for (const double column : {0.0, 0.5 * map.columns(), double(map.columns())})
      ASSERT_TRUE(std::isfinite(map.distance_at(column)));
    const auto at = map.to_buffer(0.5, 0.5);
    ASSERT_TRUE(at.x >= 0 && at.x <= map.columns() + 1e-6 && at.y >= 0 && at.y < map.rows()) << at.x << " " << at.y;
  }
}

TEST(Retention, IsAsPublished) {
  EXPECT_DOUBLE_EQ(retention(0, 0), 0.1);
  EXPECT_DOUBLE_EQ(retention(0.5, 0), 0.5);
  EXPECT_DOUBLE_EQ(retention(7, 0), 1);
  EXPECT_DOUBLE_EQ(retention(0, 0.5), 0.1 + 0.9 * 0.5);
  EXPECT_DOUBLE_EQ(retention(0, 9), 1);
  EXPECT_DOUBLE_EQ(motion_heuristic(0, 60), 0);
  EXPECT_DOUBLE_EQ(motion_heuristic(1.0 / 16, 120), 0.25);
  // Eq. 4.7 remembers two pictures; the mean that it is called remembers all.
  PictureRate published, mean;
  EXPECT_DOUBLE_EQ(published.value(), 60);
  for (const double seconds : {0.01, 0.02, 0.05}) {
    published.add(seconds, false);
    mean.add(seconds, true);
  }
  EXPECT_DOUBLE_EQ(published.value(), 0.1 * 20 + 0.9 * 50);
  EXPECT_DOUBLE_EQ(mean.value(), 0.1 * 20 + 0.9 * (0.1 * 50 + 0.9 * 100));
  PictureRate extreme;
  extreme.add(0, false);
  EXPECT_TRUE(std::isfinite(extreme.value()));
}

TEST(Retention, JitterIsAHaltonSequence) {
  EXPECT_DOUBLE_EQ(radical_inverse(1, 2), 0.5);
  EXPECT_DOUBLE_EQ(radical_inverse(6, 2), 0.375);
  EXPECT_DOUBLE_EQ(radical_inverse(5, 3), 2.0 / 3 + 1.0 / 9);
  double x = 0, y = 0;
  for (std::uint32_t picture = 0; picture < 64; ++picture) {
    const SubpixelJitter jitter = subpixel_jitter(picture, 1 / 0.555);
    ASSERT_TRUE(std::abs(jitter.x) <= 0.5 && std::abs(jitter.y) <= 0.5);
    x += jitter.x / 64;
    y += jitter.y / 64;
    // 16 ceil(1.8^2) = 64 elements; 16 without upscaling.
    EXPECT_EQ(subpixel_jitter(picture + 64, 1 / 0.555).x, jitter.x);
    EXPECT_EQ(subpixel_jitter(picture + 16, 1).y, subpixel_jitter(picture, 1).y);
  }
  EXPECT_NE(subpixel_jitter(16, 1 / 0.555).x, subpixel_jitter(0, 1 / 0.555).x);
  EXPECT_NEAR(x, 0, 0.02);
  EXPECT_NEAR(y, 0, 0.02);
}

// The mean of many previews of one view is that of the film: in the disk to the pixel, but for noise; outside blurred.
TEST(PaperPreview, HasTheLightOfTheFilm) {
  const auto scene = build(lambert_room());
  const Picture film = picture_of(render(*scene, kHome, kWidth, kHeight, 64));
  for (const bool upscaling : {false, true}) {
    Previews previews(scene);
    previews.upscaling = upscaling;
    Picture mean(film.size(), Rgb(0, 0, 0));
    constexpr int kPreviews = 40;
    for (int k = 0; k < kPreviews; ++k) {
      const Picture preview = previews.show(kHome);
      expect_whole(preview, film.size());
      for (std::size_t i = 0; i < film.size(); ++i) mean[i] += preview[i] * (1.0f / kPreviews);
    }
    EXPECT_NEAR(mean_luminance(mean, in_disk), mean_luminance(film, in_disk), 0.06 * mean_luminance(film, in_disk))
        << upscaling;
    EXPECT_NEAR(mean_luminance(mean, outside) / mean_luminance(film, outside), 1, 0.1) << upscaling;
    EXPECT_LT(difference(mean, film, in_disk), 0.3 * mean_luminance(film, in_disk)) << upscaling;
  }
}

TEST(PaperPreview, TracesFewerPathsThanPixels) {
  const auto scene = build(lambert_room());
  const auto paths = [&](bool upscaling, const PublishedFoveation& published, const Gaze& gaze) {
    Previews previews(scene);
    previews.upscaling = upscaling;
    previews.published = published;
    previews.show(kHome, gaze);
    return double(previews.stats.paths);
  };
  const double pixels = kWidth * kHeight, all = paths(false, {}, kMiddle), upscaled = paths(true, {}, kMiddle);
  EXPECT_LT(all, 0.4 * pixels);
  EXPECT_GT(all, 3.14 * kRadius * kRadius * 0.9);
  EXPECT_NEAR(upscaled / all, 0.555 * 0.555, 0.08);
  // The paper finds the fewest near 12.443 % (figure 5.2).
  const double fewest = paths(false, {.disk = 0.12443}, kMiddle);
  EXPECT_GT(paths(false, {.disk = 0.05}, kMiddle), fewest);
  EXPECT_GT(paths(false, {.disk = 0.3}, kMiddle), fewest);
  // A disk that grows with the distance of the farthest corner, and one that does not.
  const Gaze corner{0.25 * kWidth, 0.25 * kHeight};
  EXPECT_NEAR(paths(false, {.disk = 0.15, .fixed_disk = true}, kMiddle), all, 0.01 * all);
  EXPECT_GT(paths(false, {.disk = 0.3}, corner), 1.4 * paths(false, {.disk = 0.3, .fixed_disk = true}, corner));
}

TEST(PaperPreview, AntialiasingSteadiesWhatIsOutsideTheDisk) {
  const auto scene = build(lambert_room());
  const auto change = [&](bool antialiasing, const Counts& counts) {
    Previews previews(scene);
    previews.published.antialiasing = antialiasing;
    Picture before;
    double sum = 0;
    for (int k = 0; k < 12; ++k) {
      Picture now = previews.show(kHome);
      if (k >= 8) sum += difference(before, now, counts) / 4;
      before = std::move(now);
    }
    return sum;
  };
  EXPECT_LT(change(true, outside), 0.5 * change(false, outside));
  EXPECT_NEAR(change(true, in_disk), change(false, in_disk), 0.3 * change(false, in_disk));
}

// Bars before a wall, all of which shine: pictures without noise. The published motion is that of what was there, so that
// where a bar arrives it is mixed with the wall. With that of what is there now, the bar that was there shows through the
// wall that comes into view, unless the history of other surfaces is rejected.
TEST(PaperPreview, MendsTakeGhostsAway) {
  SceneDescription description;
  description.materials = {lambert(Rgb(0, 0, 0), Rgb(0.2f, 0.2f, 0.2f)), lambert(Rgb(0, 0, 0), Rgb(0.6f, 0.6f, 0.6f))};
  add_mesh(description, box({-4, -4, -4}, {4, 4, 4}, 0, true));
  for (const float x : {-1.4f, -0.7f, 0.0f, 0.7f, 1.4f})
    add_mesh(description, box({x, -1.5f, -0.4f}, {x + 0.3f, 1.5f, -0.3f}, 1));
  const auto scene = build(description);
  const CameraPose here = turned_and_shifted(kHome, 0, 0), there = turned_and_shifted(kHome, 0, 0.12);
  const Picture before = picture_of(render(*scene, here, kWidth, kHeight, 16)),
                after = picture_of(render(*scene, there, kWidth, kHeight, 16));
  // How far it is from what is seen, of the difference between bars and wall, where the one takes the other's place.
  const auto wrong = [&](const PublishedFoveation& published, bool arrives) {
    Previews previews(scene);
    previews.published = published;
    for (int k = 0; k < 12; ++k) previews.show(here);
    const Picture last = previews.show(there);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < after.size(); ++i) {
      const bool bar_before = before[i].x > 0.59f, bar = after[i].x > 0.59f;
      const bool wall_before = before[i].x < 0.21f, wall = after[i].x < 0.21f;
      if (!(arrives ? wall_before && bar : bar_before && wall)) continue;
      sum += std::abs(last[i].x - after[i].x) / 0.4;
      ++count;
    }
    return sum / count;
  };
  const PublishedFoveation moved{.surface_motion = true}, mended{.reject_history = true, .surface_motion = true};
  EXPECT_LT(wrong(moved, true), 0.8 * wrong({}, true));
  EXPECT_LT(wrong(mended, false), 0.6 * wrong(moved, false));
}

TEST(PaperPreview, AnyGazeAndRegionIsDefined) {
  const auto scene = build(mixed_scene());
  Previews previews(scene);
  for (const bool upscaling : {false, true}) {
    previews.upscaling = upscaling;
    for (const Gaze& gaze : {Gaze{0, 0}, Gaze{kWidth, kHeight}, Gaze{-1e6, 1e6}, Gaze{3.7, 1e6}, Gaze{100.2, 79.9}}) {
      expect_whole(previews.show(kHome, gaze), std::size_t(kAll.area()));
      for (const PixelRect& region : {PixelRect{0, 0, 1, 1}, PixelRect{239, 159, 240, 160}, PixelRect{10, 5, 71, 33}}) {
        expect_whole(previews.show(kHome, gaze, region), std::size_t(region.area()));
        expect_whole(previews.show(turned(3), gaze, region), std::size_t(region.area()));
      }
    }
  }
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(3, 2), std::pair(1, 40)}) {
    for (const bool upscaling : {false, true}) {
      Previews tiny(scene, width, height);
      tiny.upscaling = upscaling;
      const PixelRect all{0, 0, width, height};
      for (int k = 0; k < 2; ++k) expect_whole(tiny.show(kHome, {0.5, 0.5}, all), std::size_t(all.area()));
    }
  }
}

// Disks that reach over all of the buffer but not of the picture, and a gaze far beside it.
TEST(PaperPreview, EveryPixelOfALitRoomHasLight) {
  const auto scene = build(lambert_room());
  for (const bool upscaling : {false, true}) {
    for (const auto& [width, height, gaze, disk] :
         {std::tuple(160, 90, Gaze{80, 45}, 0.85), {160, 90, Gaze{80, 45}, 0.75}, {48, 32, Gaze{-1e6, 1e6}, 0.15},
          {80, 60, Gaze{-1e6, 1e6}, 0.15}, {160, 90, Gaze{-1e6, 1e6}, 0.5}}) {
      Previews previews(scene, width, height);
      previews.upscaling = upscaling;
      previews.published.disk = disk;
      const PixelRect all{0, 0, width, height};
      Picture mean(std::size_t(all.area()), Rgb(0, 0, 0));
      for (int k = 0; k < 12; ++k) {
        const Picture picture = previews.show(kHome, gaze, all);
        for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += picture[i];
      }
      const auto black = std::count_if(mean.begin(), mean.end(), [](const Rgb& pixel) { return !(pixel.x > 0); });
      EXPECT_LT(double(black), 0.02 * double(mean.size())) << width << "x" << height << " " << disk << " " << upscaling;
    }
  }
}

TEST(PaperPreview, OneThatIsCancelledLeavesTheNextWhole) {
  const auto scene = build(lambert_room());
  Previews previews(scene);
  const Picture before = previews.show(kHome);
  previews.cancel->cancel();
  previews.show(turned(5));
  previews.cancel = std::make_shared<CancelToken>();
  for (int k = 0; k < 8; ++k) previews.show(kHome);
  const Picture after = previews.show(kHome);
  expect_whole(after, before.size());
  EXPECT_NEAR(mean_luminance(after, everywhere), mean_luminance(before, everywhere),
              0.2 * mean_luminance(before, everywhere));
}

TEST(PaperPreview, MemoryIsWhatItSays) {
  for (const auto& [width, height] : {std::pair(kWidth, kHeight), std::pair(4096, 1), std::pair(1, 1)}) {
    const PreviewHistory history(width, height, true);
    const PaperHistory& paper = *history.published;
    const auto of = [](const auto& values) { return values.size() * sizeof(values[0]); };
    std::size_t bytes = of(paper.sums) + of(paper.places) + of(paper.motion) + of(paper.colors) + of(paper.looked_up);
    for (const PaperHistory::Side* side : {&paper.now, &paper.before})
      bytes += of(side->samples) + of(side->surfaces) + of(side->shown) + of(side->upscaled);
    EXPECT_EQ(history.bytes(), bytes);
    EXPECT_TRUE(history.last.pixels.empty());
  }
}

// A constant picture stays what it is, at any place, with and without history.
TEST(Upscaling, KeepsAConstant) {
  constexpr int kSmallWidth = 53, kSmallHeight = 35;
  const std::vector<Rgb> colors(std::size_t(kSmallWidth * kSmallHeight), Rgb(0.25f, 0.5f, 4));
  const std::vector<V2f> motion(colors.size(), V2f(0.7f, -1.3f));
  UpscalingInput in{colors, motion, kSmallWidth, kSmallHeight, {0, 0, kSmallWidth, kSmallHeight}};
  in.scale_x = double(kSmallWidth) / kWidth;
  in.scale_y = double(kSmallHeight) / kHeight;
  in.jitter = {0.4, -0.3};
  in.jittered_radius = 1e9;
  std::vector<Rgb> before(std::size_t(kWidth * kHeight), colors[0]), to(before.size());
  for (const std::vector<Rgb>* history : {static_cast<const std::vector<Rgb>*>(nullptr), &std::as_const(before)}) {
    upscale(in, kAll, kAll, kWidth, history, to);
    for (const Rgb& pixel : to) {
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(pixel[c], colors[0][c], 1e-5f);
    }
  }
  // What the history has beyond the colours around is not kept: no ghost of it.
  before.assign(before.size(), Rgb(100, 100, 100));
  upscale(in, kAll, kAll, kWidth, &before, to);
  for (const Rgb& pixel : to) ASSERT_NEAR(pixel.x, 0.25f, 1e-5f);
}

}  // namespace
}  // namespace helio::test
