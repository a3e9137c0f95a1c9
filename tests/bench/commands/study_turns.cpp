#include "tests/bench/commands/study_turns.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "tests/bench/commands/error_curves.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/scenes/camera_paths.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

StudyMode paper_mode(RenderMode mode, int stored_hits) {
  StudyMode result{{fmt::format("paper {}, {} hit{}", to_string(mode), stored_hits, stored_hits == 1 ? "" : "s"),
                    std::nullopt, std::nullopt, std::nullopt},
                   mode,
                   ModeVariant::paper,
                   {},
                   {}};
  result.reprojection.stored_hits = stored_hits;
  return result;
}

void add_paper_combinations(std::vector<StudyMode>& modes) {
  for (const int stored_hits : {1, 4}) {
    for (const int min_samples : {2, 4}) {
      StudyMode mode = paper_mode(RenderMode::combined, stored_hits);
      mode.adaptive.min_samples = std::uint32_t(min_samples);
      mode.adaptive.max_samples = 32;
      mode.setting = {
          fmt::format("paper combined {}/32, {} hit{}", min_samples, stored_hits, stored_hits == 1 ? "" : "s"),
          min_samples, 32, std::nullopt};
      modes.push_back(mode);
    }
  }
}

// Of the last view, at each count.
Result<std::vector<PictureError>> turn(RenderEngine& engine, const ErrorScene& scene, const StudyMode& mode,
                                       const std::vector<CameraPose>& views, std::uint32_t samples_per_step,
                                       const std::vector<int>& counts, std::uint64_t seed) {
  RenderSettings settings = scene.settings;
  settings.mode = mode.mode;
  settings.variant = mode.variant;
  settings.adaptive = mode.adaptive;
  settings.reprojection = mode.reprojection;
  settings.seed = seed;
  test::LoopViews loop(engine, scene.scene, settings);
  if (reuses(mode.mode)) {
    for (std::size_t i = 0; i + 1 < views.size(); ++i) loop.render(views[i], samples_per_step);
  }
  std::vector<PictureError> errors;
  double seconds = 0;
  for (const int count : counts) {
    const test::ViewPicture& picture = loop.render(views.back(), std::uint32_t(count));
    if (picture.end.reason != FrameEndReason::samples)
      return Error{ErrorCode::internal, std::string("a frame ended by ") + to_string(picture.end.reason), scene.name};
    seconds += picture.seconds;
    const auto error = picture_error(picture.view(), seconds, scene.reference);
    if (!error) return error.error();
    errors.push_back(*error);
  }
  return errors;
}

Result<std::vector<CurveReport>> turn_curves(RenderEngine& engine, const ErrorScene& scene,
                                             const std::vector<StudyMode>& modes, const std::vector<CameraPose>& views,
                                             std::uint32_t samples_per_step, const BenchOptions& options) {
  const std::vector<int> counts = doubling_counts(options.samples);
  // By mode, then count.
  std::vector<std::vector<std::vector<PictureError>>> errors(modes.size(),
                                                             std::vector<std::vector<PictureError>>(counts.size()));
  for (int seed = 1; seed <= options.seeds; ++seed) {
    for (std::size_t m = 0; m < modes.size(); ++m) {
      const auto of_seed = turn(engine, scene, modes[m], views, samples_per_step, counts, std::uint64_t(seed));
      if (!of_seed) return of_seed.error();
      for (std::size_t k = 0; k < counts.size(); ++k) errors[m][k].push_back((*of_seed)[k]);
    }
  }
  std::vector<CurveReport> curves;
  for (std::size_t m = 0; m < modes.size(); ++m) {
    CurveReport curve{scene.name, "heliograph", modes[m].setting.name, reference_mse(scene), {}};
    for (std::size_t k = 0; k < counts.size(); ++k) curve.points.push_back(summarise(counts[k], errors[m][k]));
    curves.push_back(std::move(curve));
  }
  return curves;
}

// Those that the paper's text has words for.
std::string words_of_paper(const std::string& scene) {
  if (scene == "box-area")
    return "5 degrees, 64 samples and four hits the best; plain as good after 1.5 s, 0.2 s (4.3.1)";
  if (scene == "sponza-dabrovic") return "as the box, but ahead for longer than 1.5 s (4.3.2)";
  if (scene == "courtyard") return "32 or 64 samples make no difference; no gain at 50 degrees (4.3.3)";
  if (scene == "box-glass" || scene == "box-low-roughness") return "less effective (4.3.4)";
  if (scene == "box-directional" || scene == "box-point" || scene == "box-69k" || scene == "box-1m")
    return "neither light nor triangles matter (4.3.4)";
  return "";
}

}  // namespace

std::vector<StudyMode> turn_modes() {
  std::vector<StudyMode> modes = {{{"plain", {}, {}, {}}, RenderMode::pt, ModeVariant::bounded, {}, {}}};
  for (const int stored_hits : {1, 4}) modes.push_back(paper_mode(RenderMode::reproject, stored_hits));
  for (const int bound : {4, 8}) {  // of eq. 15; 1/256 is what the others have
    StudyMode mode = paper_mode(RenderMode::reproject, 4);
    mode.reprojection.max_error = bound / 256.0;
    mode.setting.name += fmt::format(", {}/256", bound);
    modes.push_back(mode);
  }
  add_paper_combinations(modes);
  for (const RenderMode mode : {RenderMode::reproject, RenderMode::combined})
    modes.push_back({{fmt::format("ours {}", to_string(mode)), {}, {}, {}}, mode, ModeVariant::bounded, {}, {}});
  return modes;
}

Result<StudyReport> run_turn_study(BenchContext& context) {
  const BenchOptions& options = context.options();
  const std::vector<StudyMode> modes = turn_modes();
  StudyReport report;
  report.title = "Reprojection along turns of 100 degrees, after Schalk (2018), chapters 4.3 and 4.4";
  for (const StudyMode& mode : modes) report.settings.push_back(mode.setting);
  std::vector<NamedPath> paths;
  for (const int degrees : options.step_degrees) {
    auto path = find_camera_path("turn-" + std::to_string(degrees), 1);  // turns do not depend on the depth
    if (!path)
      return Error{ErrorCode::invalid_argument, std::to_string(degrees) + " is none of 5, 10, 20, 50", "--degrees"};
    paths.push_back(std::move(*path));
  }
  RenderEngine engine(options.threads);
  for (const StudyScene& chosen : chosen_scenes(options)) {
    const auto opened = open_error_scene(options, chosen.name, engine);
    if (!opened) return opened.error();
    const std::optional<ErrorScene>& scene = *opened;
    if (!scene) continue;
    for (std::size_t p = 0; p < paths.size(); ++p) {
      for (const int samples : options.step_samples) {
        auto curves =
            turn_curves(engine, *scene, modes, views_of(paths[p], scene->view), std::uint32_t(samples), options);
        if (!curves) return curves.error();
        const std::string name =
            fmt::format("{}, {} degrees and {} samples a step", chosen.name, options.step_degrees[p], samples);
        report.results.push_back({{name, chosen.property, words_of_paper(chosen.name)}, std::move(*curves)});
      }
    }
  }
  return report;
}

}  // namespace helio::bench
