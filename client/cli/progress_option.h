// --progress: when the progress line is shown.
#pragma once

#include "client/cli/options.h"
#include "client/cli/terminal.h"

namespace helio::cli {

void add_progress_option(CLI::App& app, TextOption& option);

// Sets the terminal to what the option says; without one it stays as it is, showing progress on a terminal only.
void read_progress(const TextOption& option, OptionReader& reader, Terminal& terminal);

}  // namespace helio::cli
