#include "tests/bench/commands/study.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>

#include "tests/bench/commands/error_curves.h"
#include "tests/bench/render_modes.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/reports/report_files.h"

namespace helio::bench {

namespace {

constexpr int kFirstCount = 4;  // fewer samples than any rule needs to differ from plain path tracing

// The paper's table 1.
struct PaperSetting {
  int min_samples, max_samples;
  double probability;  // as printed, rounded
};
constexpr PaperSetting kTable1[] = {{2, 16, 0.125}, {4, 16, 0.25}, {8, 16, 0.5}, {2, 32, 0.063},
                                    {4, 32, 0.125}, {8, 32, 0.25}, {16, 32, 0.5}};
constexpr int kBoundedMinima[] = {4, 8, 16};  // of table 1 those that our variant allows

void add_adaptive(std::vector<StudyMode>& modes) {
  for (const PaperSetting& paper : kTable1) {
    StudyMode mode{{fmt::format("paper {}/{}", paper.min_samples, paper.max_samples), paper.min_samples,
                    paper.max_samples, paper.probability},
                   RenderMode::adaptive,
                   ModeVariant::paper,
                   {},
                   {}};
    mode.adaptive.min_samples = std::uint32_t(paper.min_samples);
    mode.adaptive.max_samples = std::uint32_t(paper.max_samples);
    modes.push_back(mode);
  }
  for (const int min_samples : kBoundedMinima) {
    StudyMode mode{{fmt::format("ours {}", min_samples), min_samples, std::nullopt, std::nullopt},
                   RenderMode::adaptive,
                   ModeVariant::bounded,
                   {},
                   {}};
    mode.adaptive.min_samples = std::uint32_t(min_samples);
    modes.push_back(mode);
  }
}

Contender contender_of(RenderEngine& engine, const ErrorScene& scene, const StudyMode& mode) {
  return {"heliograph", mode.setting.name, [&engine, &scene, mode](int samples, std::uint64_t seed) {
            RenderSettings settings = scene.settings;
            settings.mode = mode.mode;
            settings.variant = mode.variant;
            settings.adaptive = mode.adaptive;
            settings.seed = seed;
            return render_picture(engine, scene.scene, settings, std::uint32_t(samples));
          }};
}

std::vector<int> counts_up_to(int most) {
  std::vector<int> counts = doubling_counts(most);
  if (most > kFirstCount) std::erase_if(counts, [](int count) { return count < kFirstCount; });
  return counts;
}

}  // namespace

const std::vector<StudyScene>& study_scenes() {
  static const std::vector<StudyScene> scenes = {
      {"box-area", "34 triangles, area light, soft glossy: the default",
       "adaptive better at first, 4/32 the most stable; a minimum of 8 worse (4.2.1, 5)"},
      {"box-point", "light: a point", "a graph alone (appendix A.1.1)"},
      {"box-directional", "light: directional", "adaptive not effective, 4/32 better than 2/32 (4.2.4)"},
      {"box-69k", "69 thousand triangles", "a graph alone (appendix A.1.1)"},
      {"box-1m", "1.09 million triangles", "a graph alone (appendix A.1.1)"},
      {"box-low-roughness", "materials: highly reflective", "adaptive not effective, 4/32 better than 2/32 (4.2.4)"},
      {"box-glass", "materials: glass", "a graph alone (appendix A.1.1)"},
      {"box-glossy", "materials: microfacet alpha 0.1 everywhere", ""},
      {"highlight", "a highlight on a glossy floor, small light", ""},
      {"sponza-dabrovic", "Sponza (Dabrovic's, 66 thousand triangles)",
       "adaptive better at first, 2/32 the best (4.2.2)"},
      {"breakfast-room", "Breakfast Room, without its background", ""},
      {"courtyard", "10.4 million instanced triangles, directional light; in place of San Miguel",
       "no setting better than plain (4.2.3)"},
  };
  return scenes;
}

const std::vector<std::string>& default_mode_scenes() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const StudyScene& scene : study_scenes()) all.push_back(scene.name);
    for (const char* name : {"cornell", "covered", "glass", "cornell-glossy", "veach-plates"}) all.push_back(name);
    return all;
  }();
  return names;
}

std::vector<StudyScene> chosen_scenes(const BenchOptions& options) {
  if (options.scenes.empty()) return study_scenes();
  std::vector<StudyScene> scenes;
  for (const std::string& name : options.scenes) {
    const auto known = std::find_if(study_scenes().begin(), study_scenes().end(),
                                    [&](const StudyScene& scene) { return scene.name == name; });
    scenes.push_back(known != study_scenes().end() ? *known : StudyScene{name, "not of the study", ""});
  }
  return scenes;
}

std::vector<StudyMode> study_modes() {
  std::vector<StudyMode> modes;
  for (const auto& [name, mode, integrator] : kRenderModes) {
    if (integrator != Integrator::path) continue;  // the study is of counts
    if (mode == RenderMode::pt) {
      modes.insert(modes.begin(), StudyMode{{"plain", {}, {}, {}}, mode, ModeVariant::bounded, {}, {}});
    } else if (mode == RenderMode::adaptive) {
      add_adaptive(modes);
    } else if (!reuses(mode)) {  // pictures from scratch have nothing to reuse
      modes.push_back({{fmt::format("{} ours", name), {}, {}, {}}, mode, ModeVariant::bounded, {}, {}});
    }
  }
  return modes;
}

Result<StudyReport> run_study(BenchContext& context) {
  const BenchOptions& options = context.options();
  const std::vector<StudyMode> modes = study_modes();
  StudyReport report;
  for (const StudyMode& mode : modes) report.settings.push_back(mode.setting);
  RenderEngine engine(options.threads);
  for (const StudyScene& chosen : chosen_scenes(options)) {
    const auto opened = open_error_scene(options, chosen.name, engine);
    if (!opened) return opened.error();
    const std::optional<ErrorScene>& scene = *opened;
    if (!scene) continue;
    std::vector<Contender> contenders;
    for (const StudyMode& mode : modes) contenders.push_back(contender_of(engine, *scene, mode));
    auto curves = measure_curves(*scene, contenders, counts_up_to(options.samples), options.seeds);
    if (!curves) return curves.error();
    report.results.push_back({chosen, std::move(*curves)});
  }
  return report;
}

Status publish_study(const StudyReport& report, bool as_json, const std::string& folder, const std::string& name) {
  std::printf("%s\n", (as_json ? to_json(report) : to_markdown(report)).c_str());
  return write_reports(folder, {{name + ".json", to_json(report) + "\n"}, {name + ".md", to_markdown(report)}});
}

}  // namespace helio::bench
