// The report of `helio_bench study`: Schalk's comparison of settings (2018, chapter 4.2), repeated.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/bench/reports/error_report.h"

namespace helio::bench {

// A scene of the study, the property that it stands for and what the paper's text says of it. Its graphs are pictures:
// the text has words, no numbers.
struct StudyScene {
  std::string name, property, paper;
};

// One way to render, as it is compared with plain path tracing.
struct StudySetting {
  std::string name;                             // "paper 4/32"
  std::optional<int> min_samples, max_samples;  // of mode adaptive; max: of the paper's rule alone
  std::optional<double>
      paper_probability;  // the least probability of a further sample, as the paper's table 1 prints it
};

struct StudyResult {
  StudyScene scene;
  std::vector<CurveReport> curves;  // one per setting, in their order; the first is plain path tracing
};

struct StudyReport {
  std::string title = "Settings of adaptive sampling, after Schalk (2018), chapter 4.2";
  std::vector<StudySetting> settings;  // never empty; the first is plain path tracing
  std::vector<StudyResult> results;
};

// A measure of one setting at one of its points over that of plain path tracing in the same time (value_at). NaN: not
// known.
double over_plain(const StudyResult& result, std::size_t setting, std::size_t point,
                  Interval CurvePointReport::*measure);

// {"title", "settings": [...], "scenes": [{"scene", "property", "paper", "curves": [as error_report.h has them, each
// with "over_plain": one object of ratios a point]}]}; what is not known is null.
std::string to_json(const StudyReport& report);

// Markdown: the paper's table 1 with medians and worst cases over the scenes, then a table a scene. Below 1 is better
// than plain path tracing in the same time.
std::string to_markdown(const StudyReport& report);

}  // namespace helio::bench
