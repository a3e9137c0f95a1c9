// The table of a preset as a page, as CSV, as lines and as JSON.
#pragma once

#include <string>
#include <vector>

#include "client/cli/presets/preset_table.h"
#include "client/cli/terminal.h"

namespace helio::cli {

// One HTML file that needs no network; links lead to the reports of the experiments.
std::string preset_page(const Preset& preset, const std::vector<PresetResult>& results);
// A header, then a line for each row, numbers in full precision (RFC 4180).
std::string preset_csv(const Preset& preset, const std::vector<PresetResult>& results);
std::vector<std::string> preset_lines(const std::vector<PresetResult>& results);
// The members preset, paper, hardware, notes and experiments with their rows.
void add_preset(Json& json, const Preset& preset, const std::vector<PresetResult>& results);

// "cornell-teapot.glb, in place of the paper's scene: ..."; of an experiment none of whose files is there, those that
// are looked up.
std::string stand_in_text(const PresetResult& result);

// "'san-miguel.glb', 'courtyard.glb'".
std::string candidates_text(const Experiment& experiment);

extern const char* const kFewPixelsNote;
extern const char* const kDisturbedNote;

extern const char* const kPresetJsonHelp;

}  // namespace helio::cli
