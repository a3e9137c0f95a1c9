#include "server/base/byte_size.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>

namespace helio {

constexpr std::uint64_t kMaxBytes = 1ull << 50;

std::string read_bytes(const std::string& text, std::uint64_t low, std::uint64_t& value) {
  static const std::string kSuffixes = "KMGT";
  std::string digits = text;
  unsigned shift = 0;
  if (!digits.empty()) {
    if (const auto suffix = kSuffixes.find(digits.back()); suffix != std::string::npos) {
      shift = 10 * (unsigned(suffix) + 1);
      digits.pop_back();
    }
  }
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool whole = error == std::errc() && end == digits.data() + digits.size();
  if (!whole || number > (kMaxBytes >> shift) || (number << shift) < low) {
    return fmt::format("'{}'; allowed: bytes from {} to {}, suffixes K, M, G, T", text, low, kMaxBytes);
  }
  value = number << shift;
  return "";
}

}  // namespace helio
