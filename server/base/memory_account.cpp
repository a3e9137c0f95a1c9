#include "server/base/memory_account.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/base/retry.h"

namespace helio {

Reservation& Reservation::operator=(Reservation&& other) noexcept {
  if (this != &other) {
    release();
    account_ = std::exchange(other.account_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
  }
  return *this;
}

void Reservation::release() {
  if (account_) account_->give_back(bytes_);
  account_ = nullptr;
  bytes_ = 0;
}

Result<Reservation> MemoryAccount::reserve(std::uint64_t bytes, const std::string& what) {
  if (!take(bytes)) return refusal(bytes, what, bytes);
  return Reservation(this, bytes);
}

Result<Reservation> MemoryAccount::reserve_with_room(std::uint64_t bytes, const std::string& what) {
  if (!obtain(bytes)) return refusal(bytes, what, bytes);
  return Reservation(this, bytes);
}

std::uint64_t MemoryAccount::obtainable() const {
  const std::uint64_t left = available();
  return left + (room_ ? std::min(room_->could_free(), limit_ - left) : 0);
}

std::uint64_t MemoryAccount::used() const {
  const std::lock_guard lock(mutex_);
  return used_;
}

std::uint64_t MemoryAccount::peak() const {
  const std::lock_guard lock(mutex_);
  return peak_;
}

bool MemoryAccount::take(std::uint64_t bytes) noexcept {
  const std::lock_guard lock(mutex_);
  if (bytes > limit_ - used_) return false;
  used_ += bytes;
  peak_ = std::max(peak_, used_);
  return true;
}

bool MemoryAccount::obtain(std::uint64_t bytes) {
  while (!take(bytes)) {
    if (!room_ || bytes > limit_ || !room_->make_room(bytes)) return false;
  }
  return true;
}

void MemoryAccount::give_back(std::uint64_t bytes) noexcept {
  const std::lock_guard lock(mutex_);
  used_ -= bytes;
}

// What is larger than the limit never fits.
Error MemoryAccount::refusal(std::uint64_t bytes, const std::string& what, std::uint64_t in_all) const {
  return {ErrorCode::resource_exhausted,
          fmt::format("max_memory: {} bytes are needed for {}, {} of {} are left", bytes, what, available(), limit_),
          {},
          in_all <= limit_ ? kRetrySeconds : 0};
}

bool GrowingReservation::grow(std::uint64_t bytes) noexcept {
  try {
    if (!account_.obtain(bytes)) return false;
  } catch (const std::exception&) {
    return false;  // no memory even to make room with
  }
  const std::lock_guard lock(mutex_);
  held_ += bytes;
  return true;
}

void GrowingReservation::shrink(std::uint64_t bytes) noexcept {
  const std::lock_guard lock(mutex_);
  bytes = std::min(bytes, held_);
  held_ -= bytes;
  account_.give_back(bytes);
}

std::uint64_t GrowingReservation::held() const {
  const std::lock_guard lock(mutex_);
  return held_;
}

Error GrowingReservation::refusal(std::uint64_t bytes, const std::string& what) const {
  return account_.refusal(bytes, what, held() + bytes);
}

Result<Reservation> GrowingReservation::split(std::uint64_t bytes, const std::string& what) {
  const std::lock_guard lock(mutex_);
  if (bytes > held_) {
    const std::uint64_t missing = bytes - held_;
    if (!account_.take(missing)) return account_.refusal(missing, what, bytes);
    held_ += missing;
  }
  held_ -= bytes;
  return Reservation(&account_, bytes);
}

}  // namespace helio
