// heliograph compare --preset: the comparisons of a paper, one after the other, and their table.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "client/cli/command_context.h"
#include "client/cli/options.h"

namespace helio::cli {

struct PresetOptions {
  TextOption name, scenes, only;
};
void add_preset_options(CLI::App& app, PresetOptions& options);

// Runs one comparison by the words behind `heliograph compare`, and returns its exit code. What is wrong is told by
// then.
using RunComparison = std::function<int(const std::vector<std::string>& words)>;

// `output`: checked by the caller; `given`: the options of the command line. Adds problems to the context where options
// do not go with a preset, and refuses then, before anything is rendered. An experiment that fails is told of in its
// table while the others go on, unless the command was interrupted, its flags were refused, or the server is lost.
int run_preset(const PresetOptions& options, const std::vector<GivenOption>& given, const std::filesystem::path& output,
               CommandContext& context, const RunComparison& run);

extern const char* const kPresetHelp;

}  // namespace helio::cli
