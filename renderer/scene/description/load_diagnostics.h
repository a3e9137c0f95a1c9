// Everything that a load has to say: failures (all of them, with their places) and the lines of the LoadReport.
#pragma once

#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

class Diagnostics {
 public:
  // `file` is the scene's path as given; places below are JSON pointers into it ("/accessors/3/count").
  explicit Diagnostics(std::string file, bool strict = false) : file_(std::move(file)), strict_(strict) {}

  void fail(const std::string& place, std::string message, ErrorCode code = ErrorCode::invalid_argument);
  // Adds an error made elsewhere; its `where`, when it has one, is kept in front of the message.
  void fail(const std::string& place, const Error& error);
  // A slip: the file breaks a rule of its format, but its meaning is beyond doubt. A warning that names the place and
  // says how it is read. A strict load is refused for it once everything has been looked at, so that one load finds all
  // slips. scenes/README.md has the table of what is a slip and what stays a failure.
  void tolerate(const std::string& place, const std::string& slip, const std::string& reading);
  // Loading cannot go on. Slips never stop it.
  bool failed() const { return count_ != 0; }
  // The load ends in an error: it failed, or it is strict and found slips. Ask when everything has been looked at.
  bool refused() const { return failed() || (strict_ && !slips_.empty()); }
  // True when more failures would only be counted: whoever looks for problems one by one may stop.
  bool crowded() const { return failures_.size() >= kMaxFailures; }
  static constexpr std::size_t kMaxFailures = 16;
  static constexpr std::size_t kMaxSlips = 64;
  static constexpr std::size_t kMaxMessage = 1600;  // what gRPC carries, less a place

  // The first failure's place and code; the message holds the others too, and the slips of a strict load, as far as they
  // fit into kMaxMessage bytes, and how many more there are.
  // Precondition: refused().
  Error to_error() const;

  // Lists are capped at kMaxLines each; the report counts what is left out. The same line is kept once.
  static constexpr std::size_t kMaxLines = 64;
  void warn(const std::string& place, const std::string& message);
  void notice(const std::string& message);
  void unread(const std::string& place);
  LoadReport take_report() { return std::move(report_); }

 private:
  std::string file_;
  bool strict_ = false;
  std::vector<Error> failures_, slips_;
  std::size_t count_ = 0;
  LoadReport report_;
};

}  // namespace helio
