// What a person sees: one progress line, messages as single lines, JSON alone on stdout for scripts.
#pragma once

#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "heliograph/v1/types.pb.h"

namespace helio::cli {

using Json = nlohmann::ordered_json;

// Thread safe, but for show_progress(), which comes first.
class Terminal {
 public:
  explicit Terminal(bool json);
  ~Terminal();  // leaves no half line behind

  bool json() const { return json_; }

  // Whether the progress line is shown at all. At first: when stderr is a terminal.
  void show_progress(bool shown) { live_ = shown; }
  // result() prints nothing from now on: this is one part of what a command does.
  void keep_results() { keeps_results_ = true; }
  // Replaces the progress line, which starts with a carriage return.
  void progress(const std::string& line);
  void end_progress();

  // A line on stderr: "heliograph: warning: ...". Silent with --json, whose output carries them.
  void warn(const std::string& text);
  // A line for a reader on stdout; nothing with --json.
  void say(const std::string& text);
  // The result of the command on stdout; nothing without --json.
  void result(const Json& json);
  // "heliograph: ..." on stderr, one line whatever the text holds, and with --json `result` (plus "error" and
  // "exit_code") on stdout. Returns the exit code.
  int fail(int exit_code, const std::string& text, Json result = Json::object());

 private:
  void clear_progress();  // with the lock held

  bool json_;
  bool live_;
  bool keeps_results_ = false;
  std::mutex mutex_;
  std::size_t shown_ = 0;  // columns of the progress line
};

// " 42 %  27 samples  3.1 M samples/s  error 0.0123  2.4 s": budget used, samples per pixel, pace, standard error.
std::string describe(const heliograph::v1::Progress& progress);
std::string human_count(double count);      // 1234567 -> "1.23 M"
std::string human_seconds(double seconds);  // "0.42 s", "3 min 05 s"
std::string single_line(const std::string& text);

}  // namespace helio::cli
