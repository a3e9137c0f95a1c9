#include "client/cli/progress_option.h"

namespace helio::cli {

namespace {

const std::vector<std::string> kNames = {"auto", "always", "never"};

}  // namespace

void add_progress_option(CLI::App& app, TextOption& option) {
  add_text(app, option, "--progress", "WHEN",
           "Progress line on stderr: " + join(kNames, ", ") + ". Default: auto, when stderr is a terminal");
}

void read_progress(const TextOption& option, OptionReader& reader, Terminal& terminal) {
  const std::string when = reader.choice(option, kNames).value_or("auto");
  if (when != "auto") terminal.show_progress(when == "always");
}

}  // namespace helio::cli
