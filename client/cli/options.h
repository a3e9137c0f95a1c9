// Flags as text, and their validation: every problem of a command line is found before anything is reported.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/number_range.h"
#include "renderer/base/result.h"

// CLI11's header makes every file that includes it five times as slow to compile: options.cpp stands between.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace helio::cli {

// A command under `parent`; `footer` is the end of its --help.
CLI::App* add_command(CLI::App& parent, const std::string& name, const std::string& help, const std::string& footer);
// One that does nothing itself: the name of one of its own commands has to follow.
CLI::App* add_command_group(CLI::App& parent, const std::string& name, const std::string& help);
// What the command does not know is left to report_unknown().
void allow_unknown(CLI::App& app);

// An option with one value. It must not move once it is added to an app.
struct TextOption {
  std::string text;
  CLI::Option* option = nullptr;

  bool given() const;
};

void add_text(CLI::App& app, TextOption& option, const std::string& name, const std::string& value_name,
              const std::string& help);
// An option that may be given without a value: its text is empty then.
void add_text_or_none(CLI::App& app, TextOption& option, const std::string& name, const std::string& value_name,
                      const std::string& help);
// An option that may be repeated, with a value each time.
void add_texts(CLI::App& app, std::vector<std::string>& values, const std::string& name, const std::string& value_name,
               const std::string& help);
// All words that are no options, any number of them.
void add_words(CLI::App& app, std::vector<std::string>& values, const std::string& name, const std::string& help);
// An option as it stands on the command line; a flag has no value.
struct GivenOption {
  std::string name;  // "--samples"
  std::vector<std::string> values;
};
std::vector<GivenOption> given_options(const CLI::App& app);

void add_flag(CLI::App& app, bool& given, const std::string& name, const std::string& help);

// Each reader returns none when the option is absent, and adds a problem (name, value, allowed range) and returns none
// when its value does not fit.
class OptionReader {
 public:
  explicit OptionReader(Problems& problems) : problems_(problems) {}

  std::optional<std::uint64_t> integer(const TextOption& option, std::uint64_t low, std::uint64_t high);
  std::optional<int> signed_integer(const TextOption& option, int low, int high);
  std::optional<double> number(const TextOption& option, const NumberRange& range);
  std::optional<std::pair<int, int>> size(const TextOption& option);  // WIDTHxHEIGHT
  std::optional<PixelRect> rect(const TextOption& option);            // x0,y0,x1,y1
  std::optional<V3d> vector(const TextOption& option);                // x,y,z
  std::optional<std::pair<double, double>> pair(const TextOption& option, const NumberRange& range);  // x,y
  std::optional<std::string> choice(const TextOption& option, const std::vector<std::string>& names);
  // Comma-separated, each one of the names.
  std::vector<std::string> choices(const TextOption& option, const std::vector<std::string>& names);
  std::optional<std::string> text(const TextOption& option);  // not empty
  // A file to be written: not a folder, and its folder exists.
  std::optional<std::string> output_file(const TextOption& option);

  void problem(const TextOption& option, const std::string& message);
  Problems& problems() { return problems_; }

 private:
  Problems& problems_;
};

std::string join(const std::vector<std::string>& names, const std::string& separator);

}  // namespace helio::cli
