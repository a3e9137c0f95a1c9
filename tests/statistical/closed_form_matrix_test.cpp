// The matrix: every scene whose radiance is known x every render mode x every way of rendering it x every camera, as
// the product renders: through a render loop, from the tiles that it publishes.
//
// Each cell's mean must lie within 0.5 % and within three standard errors of the radiance. Of some two hundred numbers
// one in three runs would have one that misses three standard errors by chance: a cell that misses is rendered once
// more, with another seed and four times the samples, and must not miss again (once in 1e5).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <future>
#include <tuple>

#include "renderer/frame/render_loop.h"
#include "tests/bench/render_modes.h"
#include "tests/statistical/closed_form_scenes.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

constexpr int kSide = 16;
constexpr double kTolerance = 0.005, kStandardErrors = 3;
// Float rounding and the offsets of rays, where an estimate has next to no variance.
constexpr double kRounding = 1e-4;

// How a scene is rendered. The tree has one sampler, so its row is how it is used: as many points as a whole net has,
// and a number that cuts nets short.
struct Way {
  const char* name;
  bool general;  // the general kernel in robust mode; else kernels and rays as SceneFeatures choose
  RouletteRule roulette;
  int roulette_from;
  double samples;  // times those of the scene
};

constexpr Way kWays[] = {
    {"as the scene chooses, whole nets", false, RouletteRule::root, 3, 1},
    {"general kernel, robust rays, cut nets", true, RouletteRule::throughput, 1, 0.7},
};

struct MeanOfPicture {
  V3d mean{0, 0, 0}, variance{0, 0, 0};  // of the mean
  FrameEndReason reason = FrameEndReason::failed;
};

// Sums the final tiles.
class MeanSink final : public FrameSink {
 public:
  void frame_begun(const FrameBegin&) override {}
  void tile_ready(FrameTile tile) override {
    if (!tile.final) return;
    for (int c = 0; c < 3; ++c) {
      for (const float value : tile.pixels.radiance[c]) sum_.mean[c] += value;
      for (const float value : tile.pixels.variance[c]) sum_.variance[c] += value;
    }
  }
  void frame_ended(const FrameEnd& end) override {
    constexpr double pixels = kSide * kSide;
    sum_.mean /= pixels;
    sum_.variance /= pixels * pixels;
    sum_.reason = end.reason;
    end_.set_value(sum_);
  }
  MeanOfPicture wait() { return end_.get_future().get(); }

 private:
  MeanOfPicture sum_;
  std::promise<MeanOfPicture> end_;
};

IntegrateFunction general_path_tracer(std::shared_ptr<const RenderScene> scene) {
  return [scene = std::move(scene)](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
    const Camera camera(job.camera, job.settings.width, job.settings.height, scene->origin());
    PathSettings settings = path_settings(job.settings);
    settings.general_kernel = true;
    return trace_window(*scene, camera, settings, job.range, job.window, cancel, film, stats, job.targets);
  };
}

// The kernels of other integrators are general, and a loop without a scene has no light paths to draw on.
MeanOfPicture render_mean(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene, const Way& way,
                          const RenderSettings& settings, std::uint32_t samples, const CameraPose& pose) {
  const auto sink = std::make_shared<MeanSink>();
  Budget budget;
  budget.samples = samples;
  RenderLoopOptions options;
  options.tile_size = kSide;
  RenderLoop loop =
      way.general && !caches_light_vertices(settings.integrator)
          ? RenderLoop(engine, general_path_tracer(scene), settings, budget, RenderRank::job, sink, options)
          : RenderLoop(engine, scene, settings, budget, RenderRank::job, sink, options);
  RenderLoop::Update update;
  update.view = View{1, pose, 0, 0};
  loop.update(update);
  return sink->wait();
}

// The largest distance from the truth in units of what is allowed: at most 1 passes.
double miss_of(const MeanOfPicture& picture, const V3d& truth) {
  double miss = picture.reason == FrameEndReason::samples ? 0 : INFINITY;
  for (int c = 0; c < 3; ++c) {
    const double error = std::abs(picture.mean[c] - truth[c]);
    const double by_chance = kStandardErrors * std::sqrt(picture.variance[c]) + kRounding * truth[c];
    const double worst = std::max(error / (kTolerance * truth[c]), error / by_chance);
    miss = worst <= miss ? miss : std::isnan(worst) ? INFINITY : worst;
  }
  return miss;
}

class ClosedFormMatrix : public testing::TestWithParam<std::tuple<NamedScene, bench::ComparedMode>> {};

TEST_P(ClosedFormMatrix, HasTheKnownRadiance) {
  const auto& [named, mode] = GetParam();
  const ClosedFormScene scene = named.make();
  RenderEngine engine(2);
  for (const Way& way : kWays) {
    const std::size_t index = std::size_t(&way - kWays);
    RenderSceneOptions options;
    options.rays = way.general ? RayMode::robust : RayMode::measured;
    const auto built = build(scene.description, options);
    ASSERT_TRUE(built);
    RenderSettings settings;
    settings.width = settings.height = kSide;
    mode.choose_in(settings);
    settings.max_segments = scene.max_segments;
    settings.roulette = way.roulette;
    settings.roulette_from = way.roulette_from;
    for (std::size_t kind = 0; kind < std::size(kCameraKinds); ++kind) {
      if (!full_tier() && kind % std::size(kWays) != index) continue;  // each camera in one of the ways
      const CameraKind camera = kCameraKinds[kind];
      const CameraPose pose = pose_of(scene, camera);
      const auto samples = std::uint32_t(way.samples * scene.samples);
      settings.seed = 1;
      MeanOfPicture picture = render_mean(engine, built, way, settings, samples, pose);
      double miss = miss_of(picture, scene.radiance);
      if (miss > 1) {
        std::printf("%s, %s, %s, %s: at %.3g of its bound, once more\n", named.name, mode.name, way.name,
                    to_string(camera), miss);
        settings.seed = 2;
        picture = render_mean(engine, built, way, settings, 4 * samples, pose);
        miss = miss_of(picture, scene.radiance);
      }
      EXPECT_LE(miss, 1) << mode.name << ", " << way.name << ", " << to_string(camera) << " camera: (" << picture.mean.x
                         << ", " << picture.mean.y << ", " << picture.mean.z << ") for (" << scene.radiance.x << ", "
                         << scene.radiance.y << ", " << scene.radiance.z << "), standard error "
                         << std::sqrt(picture.variance.x) << ", " << std::sqrt(picture.variance.y) << ", "
                         << std::sqrt(picture.variance.z);
    }
  }
}

// All but merging alone, for which pictures of 256 light paths are too small: merging_bias_test.cpp.
std::vector<bench::ComparedMode> modes_of_the_matrix() {
  std::vector<bench::ComparedMode> modes;
  for (const bench::ComparedMode& mode : bench::kRenderModes) {
    if (mode.integrator != Integrator::photon) modes.push_back(mode);
  }
  return modes;
}

INSTANTIATE_TEST_SUITE_P(Scenes, ClosedFormMatrix,
                         testing::Combine(testing::ValuesIn(closed_form_scenes().begin(), closed_form_scenes().end()),
                                          testing::ValuesIn(modes_of_the_matrix())),
                         [](const auto& info) {
                           std::string name =
                               std::string(std::get<0>(info.param).name) + "_" + std::get<1>(info.param).name;
                           std::replace(name.begin(), name.end(), '+', '_');
                           return name;
                         });

// What is rendered as the scene chooses has to meet every choice: both kernels, both kinds of rays, one light, power
// and tree.
TEST(ClosedFormScenes, MeetEveryChoice) {
  bool plain = false, general = false, fast = false, robust = false, one = false, power = false, tree = false;
  for (const NamedScene& named : closed_form_scenes()) {
    const auto scene = build(named.make().description);
    ASSERT_TRUE(scene);
    const SceneFeatures& f = scene->features();
    (f.only_lambert && !f.spheres && !f.instances && !f.absorption ? plain : general) = true;
    (f.fast_rays ? fast : robust) = true;
    (f.light_tree ? tree : f.light_count == 2 ? power : one) = true;
  }
  EXPECT_TRUE(plain && general);
  EXPECT_TRUE(fast && robust);
  EXPECT_TRUE(one && power && tree);
}

}  // namespace
}  // namespace helio::test
