// The table of a preset: published figures beside those of the comparisons in its folder.
#pragma once

#include <optional>
#include <string>
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
  std::string remark = {};  // why a cell is empty; empty: none is
};

// An experiment, and what came of it.
struct PresetResult {
  Experiment experiment;
  std::string file;     // found for it; empty: none
  std::string folder;   // relative to the preset's
  std::string problem;  // why there is no record, or no whole one; empty: there is
  std::optional<pb::CompareRecord> record;
  std::vector<PresetRow> rows = {};  // fill_rows()
};

// Rows for every published figure, and for each mode and budget of a measure of which the paper has no figure of that
// mode. Errors along a camera path are those of its last view; times are means over all views. The interval of a ratio
// is that of the two means, combined as of independent ones on a logarithmic scale.
void fill_rows(PresetResult& result);

// "schalk" ...: all presets.
std::vector<std::string> preset_names();
std::optional<Preset> find_preset(const std::string& name);

}  // namespace helio::cli
