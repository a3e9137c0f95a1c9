// Previews of small scenes, against films of the same views.
#include "renderer/preview/preview.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "renderer/base/clock.h"
#include "preview_pictures.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr PixelRect kAll{0, 0, kWidth, kHeight};

class Previews {
 public:
  explicit Previews(std::shared_ptr<const RenderScene> scene, int width = kWidth, int height = kHeight)
      : scene_(std::move(scene)), history_(std::make_shared<PreviewHistory>(width, height)) {}

  PreviewHistory& history() { return *history_; }
  void set_scene(std::shared_ptr<const RenderScene> scene) { scene_ = std::move(scene); }
  TraceStats stats;
  int sweeps = 0;  // of the newest

  // With all the time it could want, or none.
  Picture show(const CameraPose& camera, const Film* film = nullptr, const PixelRect& region = kAll,
               bool in_time = true, const PathSettings& path = {}, const DisplayLayer* display = nullptr) {
    PreviewTarget target{scene_, camera, path, {}, region, now_s() + (in_time ? 1e3 : -1.0), film, display};
    Preview preview(history_, target, std::make_shared<CancelToken>());
    Picture picture = make(preview, region, stats);
    sweeps = preview.sweeps();
    return picture;
  }

 private:
  std::shared_ptr<const RenderScene> scene_;
  std::shared_ptr<PreviewHistory> history_;
};

Rgb mean_of(const Picture& picture) {
  V3d sum(0, 0, 0);
  for (const Rgb& pixel : picture) sum += V3d(pixel);
  return Rgb(sum / double(picture.size()));
}

double relmse(const Picture& picture, const Picture& reference) {
  const double mean = double(luminance(mean_of(reference)));
  double sum = 0;
  for (std::size_t i = 0; i < picture.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double r = reference[i][c], d = picture[i][c] - r;
      sum += d * d / (r * r + 0.01 * mean * mean);
    }
  }
  return sum / (3 * double(picture.size()));
}

void expect_finite(const Picture& picture) {
  for (const Rgb& pixel : picture) {
    ASSERT_TRUE(is_finite(pixel));
    ASSERT_GE(std::min({pixel.x, pixel.y, pixel.z}), 0.0f);
  }
}

const CameraPose kHome = camera_at({0, 0, 0.95}, {0, -0.2, -1}, 70);
CameraPose turned(double degrees) {
  const double a = degrees * 3.14159265358979 / 180;
  return camera_at({0, 0, 0.95}, {1.95 * std::sin(a), -0.2, 0.95 - 1.95 * std::cos(a)}, 70);
}

TEST(PathList, TracesTheSamplesOfTheFilm) {
  for (const SceneDescription& description : {lambert_room(), mixed_scene()}) {
    const auto scene = build(description);
    const Camera camera(kHome, kWidth, kHeight, scene->origin());
    Film film(kWidth, kHeight);
    const CancelToken never;
    TraceStats stats;
    ASSERT_TRUE(trace_window(*scene, camera, {}, {0, 0, 1}, kAll, never, film, stats));
    std::vector<PixelPosition> pixels;
    for (int i = 0; i < 700; ++i) pixels.push_back({i * 37 % kWidth, i * 13 % kHeight});
    std::vector<Rgb> radiance(pixels.size());
    ASSERT_TRUE(trace_pixels(*scene, camera, {}, pixels, 0, never, radiance, stats));
    int same = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Rgb expected = resolve_mean(film, pixels[i].x, pixels[i].y);
      same += length(radiance[i] - expected) <= 1e-4f * (1 + length(expected));
    }
    EXPECT_GE(same, 690);  // packets differ, so that an edge may be met on its other side
  }
}

TEST(PathList, EndsWhenItIsCancelled) {
  const auto scene = build(lambert_room());
  const Camera camera(kHome, kWidth, kHeight, scene->origin());
  CancelToken cancel;
  cancel.cancel();
  const PixelPosition pixel{3, 3};
  Rgb radiance;
  TraceStats stats;
  EXPECT_FALSE(trace_pixels(*scene, camera, {}, {&pixel, 1}, 0, cancel, {&radiance, 1}, stats));
}

TEST(Preview, IsWholeWithoutAnyHistoryAndWithoutTime) {
  for (const SceneDescription& description : {lambert_room(), mixed_scene()}) {
    const auto scene = build(description);
    const Picture film = picture_of(render(*scene, kHome, kWidth, kHeight, 16));
    for (const bool in_time : {true, false}) {
      const Picture preview = Previews(scene).show(kHome, nullptr, kAll, in_time);
      expect_finite(preview);
      const float mean = luminance(mean_of(preview)), expected = luminance(mean_of(film));
      EXPECT_GT(mean, 0.5f * expected) << in_time;
      EXPECT_LT(mean, 2.0f * expected) << in_time;
    }
  }
}

TEST(Preview, ShowsTheRestingFilmAtItsOwnView) {
  for (const SceneDescription& description : {lambert_room(), mixed_scene()}) {
    const auto scene = build(description);
    const Film film = render(*scene, kHome, kWidth, kHeight, 32);
    Previews previews(scene);
    previews.show(kHome);
    EXPECT_TRUE(previews.history().shows(scene.get(), kHome, kAll));
    EXPECT_LT(relmse(previews.show(kHome, &film), picture_of(film)), 0.003);
  }
}

// Of a preview that was given up, pixels and colours are of two views.
TEST(Preview, WhatWasGivenUpIsNoViewToTakeAFilmOverFrom) {
  const auto scene = build(lambert_room());
  const Film film = render(*scene, kHome, kWidth, kHeight, 16);
  Previews previews(scene);
  previews.show(kHome);
  TraceStats stats;
  {
    const auto history = std::shared_ptr<PreviewHistory>(std::shared_ptr<void>(), &previews.history());
    Preview given_up(history, {scene, turned(20), {}, {}, kAll, now_s() + 1e3}, std::make_shared<CancelToken>());
    for (std::size_t part = 0; part < given_up.parts(); ++part) given_up.run(0, part, stats);
  }
  EXPECT_FALSE(previews.history().shows(scene.get(), kHome, kAll));
  previews.show(kHome);
  EXPECT_LT(relmse(previews.show(kHome, &film), picture_of(film)), 0.02);
}

TEST(Preview, FollowsTheCameraWithTheLightOfTheFilm) {
  for (const SceneDescription& description : {lambert_room(), mixed_scene()}) {
    const auto scene = build(description);
    const Film film = render(*scene, kHome, kWidth, kHeight, 32);
    Previews previews(scene);
    previews.show(kHome);
    Picture preview = previews.show(turned(0.5), &film);
    for (int step = 2; step <= 10; ++step) preview = previews.show(turned(0.5 * step));
    const CameraPose end = turned(5);
    const Picture reference = picture_of(render(*scene, end, kWidth, kHeight, 128));
    const Picture one = picture_of(render(*scene, end, kWidth, kHeight, 1));
    expect_finite(preview);
    EXPECT_LT(relmse(preview, reference), 0.3 * relmse(one, reference));
  }
}

TEST(Preview, FollowsTheCameraWithTheFilmAsItIsShown) {
  const auto scene = build(lambert_room());
  const Film film = render(*scene, kHome, kWidth, kHeight, 4);
  DisplayLayer layer(kWidth, kHeight);
  layer.begin(kAll);
  for (int sweep = 0; sweep < DisplayLayer::kSweeps; ++sweep) {
    for (std::size_t part = 0; part < layer.parts(); ++part) layer.run(film, sweep, part);
    layer.finish_sweep(sweep);
  }
  const CameraPose moved = turned(1);
  const Picture reference = picture_of(render(*scene, moved, kWidth, kHeight, 256));
  const auto error = [&](const DisplayLayer* display) {
    Previews previews(scene);
    previews.show(kHome);
    return relmse(previews.show(moved, &film, kAll, false, {}, display), reference);
  };
  const double as_it_is = error(nullptr);
  EXPECT_LT(error(&layer), 0.7 * as_it_is);
  layer.forget();
  EXPECT_EQ(error(&layer), as_it_is);
}

TEST(Preview, ThousandTinyMovesNeitherBlurNorDrift) {
  const auto scene = build(lambert_room());
  const Film film = render(*scene, kHome, kWidth, kHeight, 128);
  Previews previews(scene);
  previews.show(kHome);
  const double first = relmse(previews.show(turned(0.001), &film), picture_of(film));
  Picture preview;
  for (int step = 0; step < 1000; ++step) preview = previews.show(turned(step % 2 ? 0.001 : 0.0), nullptr, kAll, false);
  EXPECT_LT(relmse(preview, picture_of(film)), first + 0.002);
}

TEST(Preview, ShowsLampsAndTheEnvironmentExactly) {
  SceneDescription description = lambert_room();
  const auto scene = build(description);
  const CameraPose up = camera_at({0, 0, 0}, {0, 1, 0.001}, 20);
  const Picture preview = Previews(scene).show(up, nullptr, kAll, false);
  EXPECT_NEAR(preview[kWidth * kHeight / 2 + kWidth / 2].x, 9.0f, 0.05f);
}

// Where there is no time to filter all that is noisy, what has come into view is filtered as far as gaps are: with two
// levels its single samples would stay apart.
TEST(Preview, FiltersFewSamplesFarBeforeManySamplesAtAll) {
  const auto scene = build(lambert_room());
  Film film(kWidth, kHeight);
  const CancelToken never;
  TraceStats stats;
  const Camera camera(kHome, kWidth, kHeight, scene->origin());
  const PixelRect few{0, 0, kWidth, 8};
  ASSERT_TRUE(trace_window(*scene, camera, {}, {0, 0, 1}, few, never, film, stats));
  ASSERT_TRUE(trace_window(*scene, camera, {}, {0, 0, 8}, {0, 8, kWidth, kHeight}, never, film, stats));
  Previews previews(scene);
  previews.show(kHome, &film);
  PreviewHistory& history = previews.history();
  // Of 1,000 s half may be spent: not on two levels of every pixel, but on four of these few.
  history.costs = {.sample = 1e9, .filter = 500.0 / (1.5 * kWidth * kHeight)};
  previews.show(kHome, &film);
  EXPECT_EQ(previews.sweeps, 2 + 4) << "capture, surfaces, and four levels";
}

TEST(Preview, KeepsToItsRegion) {
  const auto scene = build(lambert_room());
  const PixelRect region{17, 9, 61, 40};
  Previews previews(scene);
  const Picture preview = previews.show(kHome, nullptr, region);
  EXPECT_EQ(preview.size(), std::size_t(region.area()));
  expect_finite(preview);
  EXPECT_GT(luminance(mean_of(preview)), 0.0f);
  const PreviewPixel& outside = previews.history().last.pixels[previews.history().index(5, 5)];
  EXPECT_EQ(outside.surface, 0);
  // Another region of the same session.
  expect_finite(previews.show(turned(2), nullptr, kAll));
}

TEST(Preview, TakesOverAnEditedSceneAsAGuess) {
  const auto scene = build(lambert_room());
  SceneDescription brighter = lambert_room();
  brighter.materials[1].emission = Rgb(18, 16, 14);
  const auto edited = build(brighter);
  Previews previews(scene);
  previews.show(kHome);
  const Film film = render(*scene, kHome, kWidth, kHeight, 64);
  previews.show(kHome, &film);
  previews.set_scene(edited);
  for (int i = 0; i < 12; ++i) previews.show(kHome);
  const Picture after = previews.show(kHome);
  const float expected = luminance(mean_of(picture_of(render(*edited, kHome, kWidth, kHeight, 64))));
  EXPECT_NEAR(luminance(mean_of(after)), expected, 0.15f * expected);
}

TEST(Preview, StaysFiniteWhereCamerasGoWrong) {
  const auto scene = build(mixed_scene());
  const CameraPose poses[] = {camera_at({0, -1, 0}, {0, -1.5, -1}, 60),       // in the floor
                              camera_at({0.5, -0.6, 0.2}, {0, 0, -1}, 60),    // in the glass sphere
                              camera_at({0, 0, 0.95}, {0, 0, -1}, 179), camera_at({1e7, 0, 0}, {0, 0, 0}, 0.1),
                              camera_at({0, 0, 0.95}, {0, 0, -1}, 0.1)};
  Previews previews(scene);
  for (const CameraPose& pose : poses) expect_finite(previews.show(pose));
  CameraPose lens = kHome;
  lens.lens_radius = 0.1;
  lens.focus_distance = 1;
  expect_finite(previews.show(lens));
  CameraPose flat = kHome;
  flat.projection = Projection::orthographic;
  flat.half_height = 0.5;
  expect_finite(previews.show(flat));
  expect_finite(previews.show(kHome));
}

TEST(Preview, LeavesOutSamplesThatAreNotFinite) {
  SceneDescription description = lambert_room();
  description.materials[1].emission = Rgb(std::numeric_limits<float>::max());
  const auto scene = build(description);
  Previews previews(scene);
  for (int i = 0; i < 3; ++i) expect_finite(previews.show(turned(i)));
}

TEST(PreviewPixel, LightSurvivesPacking) {
  for (const float x : {0.0f, 1e-7f, 1e-4f, 0.02f, 1.0f, 3.7f, 65504.0f}) {
    EXPECT_NEAR(unpack_half(pack_half(x)), x, 5e-4f * x + 6e-8f) << x;
  }
  EXPECT_EQ(unpack_half(pack_half(1e30f)), kMostHalf);
  EXPECT_EQ(unpack_half(pack_half(-1)), 0);
  for (const float x : {0.02f, 0.1f, 0.5f, 1.0f}) {
    EXPECT_NEAR(unpack_color(pack_color(Rgb(x, x, x))).x, x, 0.02f * x);
  }
  EXPECT_GT(unpack_color(pack_color(Rgb(0, 0, 0))).x, 0.01f);
}

TEST(SampleOrder, MeetsGapsEvenlyBeforeWhatIsNoisy) {
  PreviewHistory history(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      PreviewPixel& pixel = history.current.pixels[history.index(x, y)];
      pixel.surface = 1;
      pixel.samples = x < 16 ? 0 : x < 32 ? 3 : 200;
    }
  }
  std::vector<SampleOrder::Wanted> wanted{SampleOrder::find({0, 0, 64, 64}, history)};
  EXPECT_EQ(wanted[0].below[0], 32u * 64u);  // fewer than 32 samples
  EXPECT_EQ(wanted[0].below[1], 32u * 64u);  // than 4
  EXPECT_EQ(wanted[0].below[2], 16u * 64u);  // none
  const auto first = SampleOrder::merge(wanted, 4);
  ASSERT_EQ(first.size(), 4u);
  std::set<int> blocks;
  for (const PixelPosition& p : first) {
    EXPECT_LT(p.x, 16);
    blocks.insert(p.y / 16);
  }
  EXPECT_EQ(blocks.size(), 4u);
  const auto all = SampleOrder::merge(wanted, 1u << 20);
  std::set<std::pair<int, int>> distinct;
  bool noisy = false;
  for (const PixelPosition& p : all) {
    distinct.insert({p.x, p.y});
    noisy |= p.x >= 16;
    EXPECT_TRUE(!noisy || p.x >= 16);
  }
  EXPECT_EQ(distinct.size(), all.size());
}

TEST(EdgeAvoidingFilter, DoesNotCrossSurfaces) {
  PreviewHistory history(32, 32);
  const auto scene = build(lambert_room());
  const PreviewView view{scene, kHome, {0, 0, 32, 32}};
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      PreviewPixel& pixel = history.current.pixels[history.index(x, y)];
      pixel.depth = 1;
      pixel.surface = x < 16 ? 7 : 9;
      pixel.set_normal({0, 0, 1});
      if (x % 8 != 0 || y % 8 != 0) continue;
      pixel.samples = 1;
      pixel.set_light(x < 16 ? Rgb(1, 0, 0) : Rgb(0, 0, 2));
    }
  }
  const EdgeAvoidingFilter filter(view, kSettledSamples, history);
  for (int level = 0; level < 4; ++level) filter.run(view.region, level);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      const Rgb light = history.current.pixels[history.index(x, y)].unpacked_light();
      EXPECT_NEAR(light.x, x < 16 ? 1 : 0, 0.01f) << x << ' ' << y;
      EXPECT_NEAR(light.z, x < 16 ? 0 : 2, 0.01f) << x << ' ' << y;
    }
  }
}

TEST(EdgeAvoidingFilter, LeavesWhatHasTheSamplesThatAreEnough) {
  PreviewHistory history(16, 16);
  const auto scene = build(lambert_room());
  const PreviewView view{scene, kHome, {0, 0, 16, 16}};
  for (int i = 0; i < 256; ++i) {
    PreviewPixel& pixel = history.current.pixels[std::size_t(i)];
    pixel.depth = 1;
    pixel.surface = 7;
    pixel.set_normal({0, 0, 1});
    pixel.samples = i == 100 ? 0 : 2;
    if (i != 100) pixel.set_light(i % 2 ? Rgb(1, 1, 1) : Rgb(3, 3, 3));
  }
  const EdgeAvoidingFilter filter(view, 1, history);
  for (int level = 0; level < 2; ++level) filter.run(view.region, level);
  EXPECT_NEAR(history.current.pixels[100].unpacked_light().x, 2, 0.7f);
  EXPECT_EQ(history.current.pixels[101].unpacked_light().x, 1);
  EXPECT_EQ(history.current.pixels[102].unpacked_light().x, 3);
}

}  // namespace
}  // namespace helio::test
