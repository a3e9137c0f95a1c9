// The reprojection part of Schalk's study (2018, chapters 4.3 and 4.4): a camera turns by 100 degrees in equal steps,
// with so many samples at each, and the last view's error is measured from then on, while its own samples come.
// `heliograph compare --path` gives every view the same budget.
#include <spdlog/fmt/fmt.h>

#include "tests/bench/commands/contenders.h"
#include "tests/bench/scenes/camera_paths.h"
#include "tests/bench/scenes/study_scenes.h"
#include "tests/bench/subcommands.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

// Sets what a mode is; the rest is the scene's.
struct TurnMode {
  std::string name;
  RenderMode mode = RenderMode::pt;
  ModeVariant variant = ModeVariant::bounded;
  AdaptiveSettings adaptive = {};
  ReprojectionSettings reprojection = {};

  RenderSettings settings_of(const ErrorScene& scene) const {
    RenderSettings settings = scene.settings;
    settings.mode = mode;
    settings.variant = variant;
    settings.adaptive = adaptive;
    settings.reprojection = reprojection;
    return settings;
  }
};

TurnMode paper_mode(const std::string& name, RenderMode mode, int stored_hits) {
  TurnMode paper{name, mode, ModeVariant::paper};
  paper.reprojection.stored_hits = stored_hits;
  return paper;
}

// Plain path tracing first; reprojection as published with one and four stored hits, with four also by the two larger
// bounds of chapter 4.3; its combination with adaptive sampling by the settings that chapter 4.4 takes; ours.
std::vector<TurnMode> turn_modes() {
  std::vector<TurnMode> modes = {{"pt"}};
  for (const int hits : {1, 4})
    modes.push_back(paper_mode(fmt::format("paper-reproject-{}", hits), RenderMode::reproject, hits));
  for (const int bound : {4, 8}) {  // of eq. 15; 1/256 is what the others have
    modes.push_back(paper_mode(fmt::format("paper-reproject-4-error-{}", bound), RenderMode::reproject, 4));
    modes.back().reprojection.max_error = bound / 256.0;
  }
  for (const int hits : {1, 4}) {
    for (const int least : {2, 4}) {
      modes.push_back(paper_mode(fmt::format("paper-combined-{}-32-{}", least, hits), RenderMode::combined, hits));
      modes.back().adaptive.min_samples = std::uint32_t(least);
      modes.back().adaptive.max_samples = 32;
    }
  }
  modes.push_back({"reproject", RenderMode::reproject});
  modes.push_back({"combined", RenderMode::combined});
  return modes;
}

struct Turn {
  std::vector<CameraPose> views;
  std::uint32_t samples_per_step = 0;
};

// The last view at each count, of one mode and seed. Its time counts from the last step on.
Status play(RenderEngine& engine, const ErrorScene& scene, const TurnMode& mode, const Turn& turn,
            const std::vector<int>& counts, int seed, RecordedComparison& comparison) {
  RenderSettings settings = mode.settings_of(scene);
  settings.seed = std::uint64_t(seed);
  test::LoopViews loop(engine, scene.scene, settings);
  if (reuses(mode.mode)) {
    for (std::size_t i = 0; i + 1 < turn.views.size(); ++i) loop.render(turn.views[i], turn.samples_per_step);
  }
  double seconds = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const test::ViewPicture& picture = loop.render(turn.views.back(), std::uint32_t(counts[k]));
    if (picture.end.reason != FrameEndReason::samples)
      return Error{ErrorCode::internal, std::string("a frame ended by ") + to_string(picture.end.reason), scene.name};
    seconds += picture.seconds;
    if (const Status added = comparison.add(mode.name, seed, k, picture.view(), seconds); !added) return added;
  }
  return ok_status();
}

Result<pb::CompareRecord> measure_turn(RenderEngine& engine, const ErrorScene& scene, const std::string& name,
                                       const Turn& turn, const BenchOptions& options) {
  const std::vector<TurnMode> modes = turn_modes();
  std::vector<RecordedMode> recorded;
  for (const TurnMode& mode : modes) recorded.push_back({mode.name, mode.settings_of(scene)});
  const std::vector<int> counts = doubling_counts(options.samples);
  RecordedComparison comparison(name, scene, recorded, counts, options);
  for (int seed = 1; seed <= options.seeds; ++seed) {
    for (const TurnMode& mode : modes) {
      const Status played = play(engine, scene, mode, turn, counts, seed, comparison);
      if (!played) return played.error();
    }
  }
  return comparison.finish();
}

}  // namespace

Result<std::vector<pb::CompareRecord>> run_turns(BenchContext& context) {
  const BenchOptions& options = context.options();
  std::vector<NamedPath> paths;
  for (const int degrees : options.step_degrees) {
    auto path = find_camera_path("turn-" + std::to_string(degrees), 1);  // turns do not depend on the depth
    if (!path)
      return Error{ErrorCode::invalid_argument, std::to_string(degrees) + " is none of 5, 10, 20, 50", "--degrees"};
    paths.push_back(std::move(*path));
  }
  RenderEngine engine(options.threads);
  std::vector<pb::CompareRecord> records;
  const Status done =
      measure_error_scenes(options, study_scenes(), engine, kReferenceSamples, [&](const ErrorScene& scene) -> Status {
        for (std::size_t p = 0; p < paths.size(); ++p) {
          for (const int samples : options.step_samples) {
            const std::string name =
                fmt::format("{}-{}-degrees-{}-samples", scene.name, options.step_degrees[p], samples);
            auto record =
                measure_turn(engine, scene, name, {views_of(paths[p], scene.view), std::uint32_t(samples)}, options);
            if (!record) return record.error();
            records.push_back(std::move(*record));
          }
        }
        return ok_status();
      });
  if (!done) return done.error();
  return records;
}

}  // namespace helio::bench
