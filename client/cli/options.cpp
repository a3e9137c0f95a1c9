#include "client/cli/options.h"

#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <system_error>

namespace helio::cli {

namespace {

template <class T>
bool parse_whole(std::string_view text, T& value) {
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size();
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  std::size_t start = 0;
  for (std::size_t end; (end = text.find(separator, start)) != std::string_view::npos; start = end + 1) {
    parts.push_back(text.substr(start, end - start));
  }
  parts.push_back(text.substr(start));
  return parts;
}

std::string quoted(const std::string& text) {
  return "'" + text + "'";
}

}  // namespace

CLI::App* add_command(CLI::App& parent, const std::string& name, const std::string& help, const std::string& footer) {
  return parent.add_subcommand(name, help)->footer(footer);
}

CLI::App* add_command_group(CLI::App& parent, const std::string& name, const std::string& help) {
  return parent.add_subcommand(name, help)->require_subcommand(1);
}

void allow_unknown(CLI::App& app) {
  app.allow_extras();
}

bool TextOption::given() const {
  return option && option->count() > 0;
}

void add_text(CLI::App& app, TextOption& option, const std::string& name, const std::string& value_name,
              const std::string& help) {
  option.option = app.add_option(name, option.text, help)->type_name(value_name);
}

void add_text_or_none(CLI::App& app, TextOption& option, const std::string& name, const std::string& value_name,
                      const std::string& help) {
  option.option = app.add_option(name, option.text, help)->type_name("[" + value_name + "]")->expected(0, 1);
}

void add_texts(CLI::App& app, std::vector<std::string>& values, const std::string& name, const std::string& value_name,
               const std::string& help) {
  app.add_option(name, values, help)->type_name(value_name)->allow_extra_args(false);
}

void add_words(CLI::App& app, std::vector<std::string>& values, const std::string& name, const std::string& help) {
  app.add_option(name, values, help)->type_name("");
}

std::vector<GivenOption> given_options(const CLI::App& app) {
  std::vector<GivenOption> all;
  for (const CLI::Option* option : app.get_options()) {
    if (option->count() == 0) continue;
    const bool flag = option->get_items_expected_max() == 0;
    all.push_back({option->get_name(), flag ? std::vector<std::string>() : option->results()});
  }
  return all;
}

void add_flag(CLI::App& app, bool& given, const std::string& name, const std::string& help) {
  app.add_flag(name, given, help);
}

void OptionReader::problem(const TextOption& option, const std::string& message) {
  problems_.add(option.option->get_name(), message);
}

std::optional<std::uint64_t> OptionReader::integer(const TextOption& option, std::uint64_t low, std::uint64_t high) {
  if (!option.given()) return std::nullopt;
  std::uint64_t value = 0;
  if (parse_whole(option.text, value) && value >= low && value <= high) return value;
  problem(option, fmt::format("{} is not an integer in [{}, {}]", quoted(option.text), low, high));
  return std::nullopt;
}

std::optional<int> OptionReader::signed_integer(const TextOption& option, int low, int high) {
  if (!option.given()) return std::nullopt;
  int value = 0;
  if (parse_whole(option.text, value) && value >= low && value <= high) return value;
  problem(option, fmt::format("{} is not an integer in [{}, {}]", quoted(option.text), low, high));
  return std::nullopt;
}

std::optional<double> OptionReader::number(const TextOption& option, const NumberRange& range) {
  if (!option.given()) return std::nullopt;
  double value = 0;
  if (parse_whole(option.text, value) && range.contains(value)) return value;
  problem(option, fmt::format("{} is not a number in {}", quoted(option.text), range.to_string()));
  return std::nullopt;
}

std::optional<std::pair<int, int>> OptionReader::size(const TextOption& option) {
  if (!option.given()) return std::nullopt;
  const auto parts = split(option.text, 'x');
  int width = 0, height = 0;
  if (parts.size() == 2 && parse_whole(parts[0], width) && parse_whole(parts[1], height) && width > 0 && height > 0) {
    return std::pair(width, height);
  }
  problem(option, quoted(option.text) + " is not WIDTHxHEIGHT in pixels, such as 1280x720, each at least 1");
  return std::nullopt;
}

std::optional<PixelRect> OptionReader::rect(const TextOption& option) {
  if (!option.given()) return std::nullopt;
  const auto parts = split(option.text, ',');
  PixelRect r;
  if (parts.size() == 4 && parse_whole(parts[0], r.x0) && parse_whole(parts[1], r.y0) && parse_whole(parts[2], r.x1) &&
      parse_whole(parts[3], r.y1) && r.x0 >= 0 && r.y0 >= 0 && !r.empty()) {
    return r;
  }
  problem(option, quoted(option.text) + " is not x0,y0,x1,y1 in pixels with 0 <= x0 < x1 and 0 <= y0 < y1");
  return std::nullopt;
}

std::optional<V3d> OptionReader::vector(const TextOption& option) {
  if (!option.given()) return std::nullopt;
  const auto parts = split(option.text, ',');
  V3d v;
  if (parts.size() == 3 && parse_whole(parts[0], v.x) && parse_whole(parts[1], v.y) && parse_whole(parts[2], v.z) &&
      is_finite(v)) {
    return v;
  }
  problem(option, quoted(option.text) + " is not three finite numbers separated by commas");
  return std::nullopt;
}

std::optional<std::pair<double, double>> OptionReader::pair(const TextOption& option, const NumberRange& range) {
  if (!option.given()) return std::nullopt;
  const auto parts = split(option.text, ',');
  double x = 0, y = 0;
  if (parts.size() == 2 && parse_whole(parts[0], x) && parse_whole(parts[1], y) && range.contains(x) &&
      range.contains(y)) {
    return std::pair(x, y);
  }
  problem(option, quoted(option.text) + " is not two numbers in " + range.to_string() + ", separated by a comma");
  return std::nullopt;
}

std::optional<std::string> OptionReader::choice(const TextOption& option, const std::vector<std::string>& names) {
  if (!option.given()) return std::nullopt;
  if (std::find(names.begin(), names.end(), option.text) != names.end()) return option.text;
  problem(option, quoted(option.text) + " is none of " + join(names, ", "));
  return std::nullopt;
}

std::vector<std::string> OptionReader::choices(const TextOption& option, const std::vector<std::string>& names) {
  std::vector<std::string> chosen;
  if (!option.given()) return chosen;
  for (const std::string_view part : split(option.text, ',')) {
    if (std::find(names.begin(), names.end(), part) == names.end()) {
      problem(option, quoted(std::string(part)) + " is none of " + join(names, ", "));
    } else {
      chosen.emplace_back(part);
    }
  }
  return chosen;
}

std::optional<std::string> OptionReader::text(const TextOption& option) {
  if (!option.given()) return std::nullopt;
  if (!option.text.empty()) return option.text;
  problem(option, "must not be empty");
  return std::nullopt;
}

std::optional<std::string> OptionReader::output_file(const TextOption& option) {
  const std::optional<std::string> path = text(option);
  if (!path) return std::nullopt;
  std::error_code ignored;
  const std::filesystem::path file(*path);
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder, ignored)) {
    problem(option, "the folder " + quoted(folder.string()) + " does not exist");
    return std::nullopt;
  }
  if (std::filesystem::is_directory(file, ignored) || !file.has_filename()) {
    problem(option, quoted(*path) + " is a folder, not a file");
    return std::nullopt;
  }
  if (std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored)) {
    problem(option, quoted(*path) + " is a device or a pipe; allowed: a file, which is there or not");
    return std::nullopt;
  }
  return path;
}

std::string join(const std::vector<std::string>& names, const std::string& separator) {
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : separator) + name;
  return joined;
}

}  // namespace helio::cli
