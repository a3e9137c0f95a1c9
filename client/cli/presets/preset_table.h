// The table of a preset: published figures beside those of the comparisons in its folder.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/presets/preset.h"
#include "heliograph/v1/compare.pb.h"

namespace helio::cli {

namespace pb = heliograph::v1;

struct PresetRow {
  std::string mode;      // the paper's words, or ours where the paper has no such mode
  std::string our_mode;  // empty: none
  std::uint32_t samples = 0;
  std::string measure, view;
  std::optional<PublishedFigure> published;
  std::uint32_t baseline_samples = 0;  // of the first mode's row that the ratios are to; 0: none
  double published_ratio = kUnpublished, published_seconds_ratio = kUnpublished;
  std::optional<pb::CompareInterval> ours = {}, seconds = {}, ratio = {}, seconds_ratio = {};
  // As of ComparePoint: `ours`, or one of the two values of `ratio`, is decided by a few pixels; units of `seconds`, or
  // of the times of `seconds_ratio`, were disturbed.
  bool few_pixels = false, ratio_few_pixels = false, disturbed = false, ratio_disturbed = false;
  std::string remark = {};  // why a cell is empty; empty: none is
};

// An experiment, and what came of it.
struct PresetResult {
  Experiment experiment;
  std::optional<SceneFile> scene;  // the first of the experiment's files that is there
  std::string file;                // its path; empty: none is there
  std::string folder;              // relative to the preset's
  std::string problem;             // why there is no record, or no whole one; empty: there is
  std::optional<pb::CompareRecord> record;
  std::vector<PresetRow> rows = {};  // fill_rows()
};

// Rows for every published figure, and for each mode and budget of a measure of which the paper has no figure of that
// mode. Errors along a camera path are those of its last view; times are means over all views. Ratios are those of
// SeedRatios, as compare computes them; the ratio of times is of geometric means over seeds.
void fill_rows(PresetResult& result);

// Seconds, or frames per second.
bool is_of_time(const std::string& measure);

// Units of the record that are disturbed, and all that there are.
std::pair<std::uint64_t, std::uint64_t> disturbed_units(const PresetResult& result);

// "schalk" ...: all presets.
std::vector<std::string> preset_names();
std::optional<Preset> find_preset(const std::string& name);

}  // namespace helio::cli
