#include "renderer/scene/gltf_diagnostics.h"

#include <algorithm>

namespace helio::gltf {

namespace {

void add_line(std::vector<std::string>& lines, std::string line) {
  if (lines.size() > Diagnostics::kMaxLines) return;
  if (lines.size() == Diagnostics::kMaxLines) line = "... and more of this kind";
  if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(std::move(line));
}

}  // namespace

void Diagnostics::fail(const std::string& place, std::string message, ErrorCode code) {
  for (const Error& known : failures_)
    if (known.where == file_ + place && known.message == message) return;
  ++count_;
  if (failures_.size() < kMaxFailures) failures_.push_back({code, std::move(message), file_ + place});
}

void Diagnostics::fail(const std::string& place, const Error& error) {
  fail(place, error.to_string(), error.code);
}

Error Diagnostics::to_error() const {
  Error error = failures_.front();
  for (std::size_t i = 1; i < failures_.size(); ++i) error.message += "; " + failures_[i].to_string();
  if (count_ > failures_.size()) error.message += "; and " + std::to_string(count_ - failures_.size()) + " more";
  return error;
}

void Diagnostics::warn(const std::string& place, const std::string& message) {
  add_line(report_.warnings, place.empty() ? message : place + ": " + message);
}

void Diagnostics::notice(const std::string& message) {
  add_line(report_.notices, message);
}

void Diagnostics::unread(const std::string& place) {
  add_line(report_.unread, place);
}

}  // namespace helio::gltf
