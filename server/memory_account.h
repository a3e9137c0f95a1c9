// What scenes, films, bundles and queues may hold together, counted before anything is allocated.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "renderer/base/result.h"

namespace helio {

class MemoryAccount;

// A share of the account, given back when it goes.
class Reservation {
 public:
  Reservation() = default;
  Reservation(Reservation&& other) noexcept { *this = std::move(other); }
  Reservation& operator=(Reservation&& other) noexcept;
  ~Reservation() { release(); }

  std::uint64_t bytes() const { return bytes_; }
  void release();

 private:
  friend class MemoryAccount;
  Reservation(MemoryAccount* account, std::uint64_t bytes) : account_(account), bytes_(bytes) {}

  MemoryAccount* account_ = nullptr;
  std::uint64_t bytes_ = 0;
};

// Thread safe. Outlives its reservations.
class MemoryAccount {
 public:
  explicit MemoryAccount(std::uint64_t limit) : limit_(limit) {}

  // resource_exhausted, naming max_memory, when less is left. `what` completes "... for WHAT".
  Result<Reservation> reserve(std::uint64_t bytes, const std::string& what);

  std::uint64_t limit() const { return limit_; }
  std::uint64_t used() const;
  std::uint64_t available() const { return limit_ - used(); }

 private:
  friend class Reservation;
  void give_back(std::uint64_t bytes);

  const std::uint64_t limit_;
  mutable std::mutex mutex_;
  std::uint64_t used_ = 0;
};

}  // namespace helio
