#include <CLI/CLI.hpp>
#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/exit_code.h"
#include "client/cli/terminal.h"

namespace helio::cli {

int run_words(const std::function<Command(CLI::App& root)>& add, const std::vector<std::string>& words) {
  CLI::App root("", "heliograph");
  const Command command = add(root);
  std::vector<std::string> reversed(words.rbegin(), words.rend());  // as CLI11 takes them
  reversed.push_back(command.app->get_name());
  try {
    root.parse(reversed);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "heliograph: %s\n", single_line(error.what()).c_str());
    return kUsage;
  }
  return command.run();
}

}  // namespace helio::cli
