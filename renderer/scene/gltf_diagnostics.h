// Everything that a load has to say: failures (all of them, with their places) and the lines of the LoadReport.
#pragma once

#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/scene_description.h"

namespace helio::gltf {

class Diagnostics {
 public:
  // `file` is the scene's path as given; places below are JSON pointers into it ("/accessors/3/count").
  explicit Diagnostics(std::string file) : file_(std::move(file)) {}

  void fail(const std::string& place, std::string message, ErrorCode code = ErrorCode::invalid_argument);
  // Adds an error made elsewhere; its `where`, when it has one, is kept in front of the message.
  void fail(const std::string& place, const Error& error);
  bool failed() const { return count_ != 0; }
  // True when more failures would only be counted: whoever looks for problems one by one may stop.
  bool crowded() const { return failures_.size() >= kMaxFailures; }
  static constexpr std::size_t kMaxFailures = 16;

  // The first failure's place and code; the message holds the others too. Precondition: failed().
  Error to_error() const;

  // Lists are capped at kMaxLines each; one more line then says that there were others. The same line is kept once.
  static constexpr std::size_t kMaxLines = 64;
  void warn(const std::string& place, const std::string& message);
  void notice(const std::string& message);
  void unread(const std::string& place);
  LoadReport take_report() { return std::move(report_); }

 private:
  std::string file_;
  std::vector<Error> failures_;
  std::size_t count_ = 0;
  LoadReport report_;
};

}  // namespace helio::gltf
