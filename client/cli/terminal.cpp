#include "client/cli/terminal.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace helio::cli {

Terminal::Terminal(bool json) : json_(json), live_(isatty(STDERR_FILENO) == 1) {}

Terminal::~Terminal() {
  end_progress();
}

void Terminal::progress(const std::string& line) {
  if (!live_) return;
  const std::lock_guard lock(mutex_);
  const std::size_t blanks = shown_ > line.size() ? shown_ - line.size() : 0;
  std::fprintf(stderr, "\r%s%s", line.c_str(), std::string(blanks, ' ').c_str());
  std::fflush(stderr);
  shown_ = line.size();
}

void Terminal::end_progress() {
  const std::lock_guard lock(mutex_);
  clear_progress();
}

void Terminal::clear_progress() {
  if (shown_ == 0) return;
  std::fprintf(stderr, "\r%s\r", std::string(shown_, ' ').c_str());
  std::fflush(stderr);
  shown_ = 0;
}

void Terminal::warn(const std::string& text) {
  const std::lock_guard lock(mutex_);
  clear_progress();
  if (!json_) std::fprintf(stderr, "heliograph: warning: %s\n", single_line(text).c_str());
}

void Terminal::say(const std::string& text) {
  const std::lock_guard lock(mutex_);
  clear_progress();
  if (json_) return;
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

void Terminal::result(const Json& json) {
  const std::lock_guard lock(mutex_);
  clear_progress();
  if (!json_ || keeps_results_) return;
  // Names from scene files may hold bytes that are not UTF-8: replaced, not thrown at the user.
  std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  std::fflush(stdout);
}

int Terminal::fail(int exit_code, const std::string& text, Json json) {
  {
    const std::lock_guard lock(mutex_);
    clear_progress();
    std::fprintf(stderr, "heliograph: %s\n", single_line(text).c_str());
  }
  json["error"] = text;
  json["exit_code"] = exit_code;
  result(json);
  return exit_code;
}

std::string single_line(const std::string& text) {
  std::string line = text;
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return line;
}

std::string human_count(double count) {
  for (const auto& [unit, name] :
       {std::pair(1e12, " T"), std::pair(1e9, " G"), std::pair(1e6, " M"), std::pair(1e3, " k")}) {
    if (count >= unit) return fmt::format("{:.3g}{}", count / unit, name);
  }
  return fmt::format("{:.3g}", count);
}

std::string human_seconds(double seconds) {
  if (seconds < 100) return fmt::format("{:.{}f} s", seconds, seconds < 10 ? 2 : 1);
  if (!(seconds < 1e9)) return "over 30 years";
  const auto whole = static_cast<long long>(std::llround(seconds));
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string describe(const heliograph::v1::Progress& progress) {
  std::string line;
  if (progress.budget_used() > 0) line += fmt::format("{:3.0f} %  ", 100 * std::min(1.0, progress.budget_used()));
  line +=
      fmt::format("{} samples  {} samples/s", progress.samples_per_pixel(), human_count(progress.samples_per_second()));
  if (progress.error().known()) {
    line +=
        progress.error().all_black() ? "  all black so far" : fmt::format("  error {:.3g}", progress.error().rmse());
  }
  return line + "  " + human_seconds(progress.seconds());
}

}  // namespace helio::cli
