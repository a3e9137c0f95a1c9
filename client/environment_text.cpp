#include "client/environment_text.h"

#include <charconv>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "renderer/base/text.h"

namespace helio {

namespace {

constexpr double kMaxRadiance = std::numeric_limits<float>::max();

// The number that all of `text` is ("nan" and "inf" are numbers); infinite when a double cannot hold it.
std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return std::nullopt;
  if (problem == std::errc::result_out_of_range) return std::numeric_limits<double>::infinity();
  return problem == std::errc() ? std::optional(value) : std::nullopt;
}

bool looks_like_a_number(std::string_view part) {
  return parse_number(part) || part.find_first_not_of("0123456789+-.eE") == std::string_view::npos;
}

}  // namespace

Result<bool> names_environment_map(const std::string& text) {
  if (text.empty()) return false;
  const std::vector<std::string_view> parts = comma_separated(text);
  bool in_range = parts.size() == 3;
  for (const std::string_view part : parts) {
    if (!looks_like_a_number(part)) return true;
    const std::optional<double> number = parse_number(part);
    in_range = in_range && number && *number >= 0 && *number <= kMaxRadiance;
  }
  if (in_range) return false;
  return Error{ErrorCode::invalid_argument,
               "'" + text + "' is not R,G,B: three numbers in [0, 3.4e38], separated by commas", "environment"};
}

}  // namespace helio
