#include "renderer/scene/description/load_diagnostics.h"

#include <algorithm>

namespace helio {

namespace {

void add_line(std::vector<std::string>& lines, std::size_t& left_out, std::string line) {
  if (std::find(lines.begin(), lines.end(), line) != lines.end()) return;
  if (lines.size() == Diagnostics::kMaxLines)
    ++left_out;
  else
    lines.push_back(std::move(line));
}

bool holds(const std::vector<Error>& errors, const std::string& where, const std::string& message) {
  return std::any_of(errors.begin(), errors.end(),
                     [&](const Error& known) { return known.where == where && known.message == message; });
}

}  // namespace

void Diagnostics::fail(const std::string& place, std::string message, ErrorCode code) {
  if (holds(failures_, file_ + place, message)) return;
  ++count_;
  if (failures_.size() < kMaxFailures) failures_.push_back({code, std::move(message), file_ + place});
}

void Diagnostics::fail(const std::string& place, const Error& error) {
  fail(place, error.to_string(), error.code);
}

void Diagnostics::tolerate(const std::string& place, const std::string& slip, const std::string& reading) {
  warn(place, slip + "; " + reading);
  if (holds(slips_, file_ + place, slip)) return;
  ++report_.slips;
  if (slips_.size() < kMaxSlips) slips_.push_back({ErrorCode::invalid_argument, slip, file_ + place});
}

Error Diagnostics::to_error() const {
  std::vector<Error> errors = failures_;
  std::size_t count = count_;
  if (strict_) {
    errors.insert(errors.end(), slips_.begin(), slips_.end());
    count += report_.slips;
  }
  Error error = errors.front();
  std::size_t told = 1;
  for (; told < errors.size(); ++told) {
    const std::string next = "; " + errors[told].to_string();
    if (error.message.size() + next.size() > kMaxMessage) break;
    error.message += next;
  }
  if (count > told) error.message += "; and " + std::to_string(count - told) + " more";
  return error;
}

void Diagnostics::warn(const std::string& place, const std::string& message) {
  add_line(report_.warnings, report_.more_warnings, place.empty() ? message : place + ": " + message);
}

void Diagnostics::notice(const std::string& message) {
  add_line(report_.notices, report_.more_notices, message);
}

void Diagnostics::unread(const std::string& place) {
  add_line(report_.unread, report_.more_unread, place);
}

}  // namespace helio
