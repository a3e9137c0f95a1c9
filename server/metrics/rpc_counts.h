// Calls that have ended, by method and status code.
#pragma once

#include <atomic>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace helio {

// Thread safe; counting takes neither a lock nor memory.
class RpcCounts {
 public:
  static constexpr int kCodes = 17;  // of gRPC: [0, 16]

  // Names of methods without their service. Calls of others are counted as "other".
  explicit RpcCounts(std::vector<std::string> methods);

  // For count(): of "/heliograph.v1.RenderService/StreamFrames".
  std::size_t method_of(std::string_view path) const;
  // A code that is none of gRPC's counts as UNKNOWN.
  void count(std::size_t method, int code) noexcept;

  std::size_t methods() const { return methods_.size(); }
  const std::string& name(std::size_t method) const { return methods_[method]; }
  std::uint64_t value(std::size_t method, int code) const {
    return counts_[method][std::size_t(code)].load(std::memory_order_relaxed);
  }
  static const char* code_name(int code);  // "RESOURCE_EXHAUSTED"

 private:
  std::vector<std::string> methods_;  // sorted, and "other" at last
  std::unique_ptr<std::array<std::atomic<std::uint64_t>, kCodes>[]> counts_;
};

}  // namespace helio
