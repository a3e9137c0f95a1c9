#include "client/report/number_text.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace helio::report {
namespace {

constexpr double kSmallest = 1e-3, kLargest = 1e6;  // that are printed without an exponent
constexpr int kDigits = 3;

}  // namespace

std::string number(double value) {
  if (!std::isfinite(value)) return "unknown";
  if (value == 0) return "0";
  // Rounded first: 999.6 has four digits before the point.
  const std::string scientific = fmt::format("{:.{}e}", value, kDigits - 1);
  const std::size_t mark = scientific.find('e');
  const int exponent = std::stoi(scientific.substr(mark + 1));
  if (std::abs(value) < kSmallest || std::abs(value) >= kLargest) {
    return fmt::format("{}e{}", scientific.substr(0, mark), exponent);
  }
  const double rounded = std::stod(scientific);
  return fmt::format("{:.{}f}", rounded, std::max(0, kDigits - 1 - exponent));
}

std::string plain_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "unknown";
}

std::string interval_text(const heliograph::v1::CompareInterval& interval) {
  if (!interval.known()) return {};
  return "[" + number(interval.low()) + ", " + number(interval.high()) + "]";
}

std::string counted(std::uint64_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace helio::report
