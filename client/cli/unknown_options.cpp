#include <CLI/CLI.hpp>

#include "client/cli/command.h"
#include "client/cli/options.h"

namespace helio::cli {

namespace {

// Longest common start of two names: enough to guess what "--sample" was meant to be.
std::size_t common_start(const std::string& a, const std::string& b) {
  std::size_t length = 0;
  while (length < a.size() && length < b.size() && a[length] == b[length]) ++length;
  return length;
}

// The command's option whose name starts most like `flag`; empty when none shares more than a letter or two.
std::string closest_option(const CLI::App& app, const std::string& flag) {
  std::string best;
  std::size_t longest = 4;  // "--" and more than two letters
  for (const CLI::Option* option : app.get_options()) {
    const std::size_t length = common_start(option->get_name(), flag);
    if (length > longest) {
      longest = length;
      best = option->get_name();
    }
  }
  return best;
}

}  // namespace

void report_unknown(const CLI::App& app, OptionReader& reader) {
  for (const std::string& argument : app.remaining()) {
    if (argument.rfind('-', 0) != 0) {
      reader.problems().add("'" + argument + "'", "is one argument too many");
      continue;
    }
    const std::string flag = argument.substr(0, argument.find('='));
    const std::string guess = closest_option(app, flag);
    reader.problems().add(flag, "is not an option of " + app.get_name() +
                                    (guess.empty() ? "; --help lists them" : "; did you mean " + guess + "?"));
  }
}

}  // namespace helio::cli
