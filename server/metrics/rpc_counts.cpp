#include "server/metrics/rpc_counts.h"

#include <algorithm>
#include <utility>

namespace helio {

namespace {

constexpr const char* kNames[RpcCounts::kCodes] = {
    "OK",        "CANCELLED",          "UNKNOWN",           "INVALID_ARGUMENT",    "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS",     "PERMISSION_DENIED", "RESOURCE_EXHAUSTED",  "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",       "UNIMPLEMENTED",     "INTERNAL",            "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};
constexpr int kUnknown = 2;

}  // namespace

RpcCounts::RpcCounts(std::vector<std::string> methods) : methods_(std::move(methods)) {
  std::sort(methods_.begin(), methods_.end());
  methods_.push_back("other");
  counts_ = std::make_unique<std::array<std::atomic<std::uint64_t>, kCodes>[]>(methods_.size());
}

std::size_t RpcCounts::method_of(std::string_view path) const {
  const std::size_t slash = path.rfind('/');
  const std::string_view name = slash == std::string_view::npos ? path : path.substr(slash + 1);
  const auto others = methods_.end() - 1;
  const auto found = std::lower_bound(methods_.begin(), others, name);
  return std::size_t((found != others && *found == name ? found : others) - methods_.begin());
}

void RpcCounts::count(std::size_t method, int code) noexcept {
  const int known = code >= 0 && code < kCodes ? code : kUnknown;
  counts_[method][std::size_t(known)].fetch_add(1, std::memory_order_relaxed);
}

const char* RpcCounts::code_name(int code) {
  return kNames[code];
}

}  // namespace helio
