// Counts what a load holds against a limit, before anything is allocated.
//
// The limit is the smaller of a configured maximum and an allowance that grows with the bytes actually read from the
// scene's files: a small file cannot claim much memory, whatever counts it declares. What is counted is taken from a
// ledger too, which other loads draw on at the same time; it stays there when the budget goes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>

#include "renderer/base/memory_ledger.h"
#include "renderer/base/result.h"

namespace helio {

class MemoryBudget {
 public:
  // What any file may take, and what it may take besides for each of its bytes. 256 covers flat images and
  // entropy-coded meshes; honest files of this kind stay below 100.
  static constexpr std::uint64_t kBaseAllowance = 256ull << 20;
  static constexpr std::uint64_t kAllowancePerByte = 256;

  explicit MemoryBudget(std::uint64_t max_bytes, MemoryLedger* ledger = nullptr)
      : max_bytes_(max_bytes), ledger_(ledger) {}

  // Tells that a file was read; raises the allowance, once per file however often it is read.
  void add_source_file(const std::string& path, std::uint64_t bytes) {
    if (files_.insert(path).second) source_bytes_ += bytes;
  }

  // Precondition of every allocation whose size a file decides. Nothing is counted when it fails.
  // Errors: resource_exhausted, naming the limit that was met.
  Status reserve(std::uint64_t bytes, const std::string& where) {
    if (bytes > remaining()) return refuse(bytes, where);
    return take(bytes, where);
  }
  // For sizes that no file's size bounds: only the configured maximum counts.
  Status reserve_configured(std::uint64_t bytes, const std::string& where) {
    if (bytes > remaining_configured()) return refuse(bytes, where);
    return take(bytes, where);
  }
  // As reserve for count elements of size bytes each, without overflow.
  Status reserve(std::uint64_t count, std::uint64_t size, const std::string& where) {
    if (size != 0 && count > UINT64_MAX / size) return refuse(UINT64_MAX, where);
    return reserve(count * size, where);
  }
  void release(std::uint64_t bytes) {
    bytes = std::min(bytes, used_);
    used_ -= bytes;
    if (ledger_) ledger_->shrink(bytes);
  }

  std::uint64_t limit() const {
    const std::uint64_t most = (UINT64_MAX - kBaseAllowance) / kAllowancePerByte;
    return std::min(max_bytes_, kBaseAllowance + kAllowancePerByte * std::min(source_bytes_, most));
  }
  std::uint64_t used() const { return used_; }
  // What the configured maximum leaves, whatever the allowance: the bound for reading one more file.
  std::uint64_t remaining_configured() const { return max_bytes_ - std::min(max_bytes_, used_); }
  std::uint64_t remaining() const { return limit() - std::min(limit(), used_); }

 private:
  Status take(std::uint64_t bytes, const std::string& where) {
    if (ledger_ && !ledger_->grow(bytes)) {
      Error error = ledger_->refusal(bytes, "the scene");
      error.where = where;
      return error;
    }
    used_ += bytes;
    return ok_status();
  }
  Error refuse(std::uint64_t bytes, const std::string& where) const {
    const bool configured = limit() == max_bytes_;
    return {ErrorCode::resource_exhausted,
            "needs " + std::to_string(bytes) + " bytes where " + std::to_string(remaining()) + " are left of " +
                std::to_string(limit()) +
                (configured
                     ? " (limit max_memory_bytes)"
                     : " (a load of " + std::to_string(source_bytes_) + " bytes of files may take " +
                           std::to_string(kBaseAllowance) + " and " + std::to_string(kAllowancePerByte) + " per byte)"),
            where};
  }

  std::uint64_t max_bytes_;
  MemoryLedger* ledger_;  // null: none
  std::set<std::string> files_;
  std::uint64_t source_bytes_ = 0;
  std::uint64_t used_ = 0;
};

}  // namespace helio
