// `helio_bench study`: the scenes and settings of Schalk's study (2018, chapter 4.2), the paper's rule beside ours.
#pragma once

#include "renderer/frame/render_settings.h"
#include "tests/bench/bench_context.h"
#include "tests/bench/reports/study_report.h"

namespace helio::bench {

// The scenes that are measured when none is named.
const std::vector<StudyScene>& study_scenes();

// What `adaptive` and `reuse` measure when no scene is named: those of the study, then those of the error curves.
const std::vector<std::string>& default_mode_scenes();

// A setting with what it sets.
struct StudyMode {
  StudySetting setting;
  RenderMode mode;
  ModeVariant variant = ModeVariant::bounded;
  AdaptiveSettings adaptive;
  ReprojectionSettings reprojection;
};

// Those asked for, with what the study knows of them.
std::vector<StudyScene> chosen_scenes(const BenchOptions& options);

// Every mode of render_modes.h, plain path tracing first: mode adaptive by the settings of the paper's table 1 and, in
// our variant, by the same minima where it allows them. Modes that reuse pictures are for study_turns.h.
std::vector<StudyMode> study_modes();

Result<StudyReport> run_study(BenchContext& context);

// Prints the report (`as_json`: JSON, else markdown) and writes NAME.json and NAME.md into `folder`, which is made;
// empty: nothing is written.
Status publish_study(const StudyReport& report, bool as_json, const std::string& folder, const std::string& name);

}  // namespace helio::bench
