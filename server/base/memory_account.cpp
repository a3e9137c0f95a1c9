#include "server/base/memory_account.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>

#include "server/base/log_format.h"
#include "server/base/retry.h"

namespace helio {

const char* to_string(MemoryOwner owner) {
  static constexpr const char* kNames[kMemoryOwners] = {
      "scenes",  "devices", "uploads",  "films",      "light_vertices", "previews",
      "display", "queues",  "pictures", "references", "checkpoints",    "other"};
  return kNames[std::size_t(owner)];
}

Reservation& Reservation::operator=(Reservation&& other) noexcept {
  if (this != &other) {
    release();
    account_ = std::exchange(other.account_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
    owner_ = other.owner_;
  }
  return *this;
}

void Reservation::release() {
  if (account_) account_->give_back(bytes_, owner_);
  account_ = nullptr;
  bytes_ = 0;
}

Result<Reservation> MemoryAccount::reserve(std::uint64_t bytes, const std::string& what, MemoryOwner owner) {
  if (!take(bytes, owner)) return refusal(bytes, what, bytes);
  return Reservation(this, bytes, owner);
}

Result<Reservation> MemoryAccount::reserve_with_room(std::uint64_t bytes, const std::string& what, MemoryOwner owner) {
  if (!obtain(bytes, owner)) return refusal(bytes, what, bytes);
  return Reservation(this, bytes, owner);
}

MemoryAccount::MemoryAccount(MemoryAccount& parent, std::string owner, RoomMaker* room)
    : parent_(&parent), owner_(std::move(owner)), room_(room), limit_(std::numeric_limits<std::uint64_t>::max()) {}

std::uint64_t MemoryAccount::limit() const {
  const std::lock_guard lock(mutex_);
  return limit_;
}

void MemoryAccount::set_limit(std::uint64_t limit) {
  const std::lock_guard lock(mutex_);
  limit_ = limit;
}

std::uint64_t MemoryAccount::own_available() const {
  const std::lock_guard lock(mutex_);
  return limit_ - std::min(used_, limit_);
}

std::uint64_t MemoryAccount::available() const {
  const std::uint64_t own = own_available();
  return parent_ ? std::min(own, parent_->available()) : own;
}

std::uint64_t MemoryAccount::obtainable() const {
  const std::uint64_t left = own_available();
  const std::uint64_t own = left + (room_ ? std::min(room_->could_free(), limit() - std::min(left, limit())) : 0);
  return parent_ ? std::min(own, parent_->obtainable()) : own;
}

std::uint64_t MemoryAccount::used() const {
  const std::lock_guard lock(mutex_);
  return used_;
}

std::uint64_t MemoryAccount::peak() const {
  const std::lock_guard lock(mutex_);
  return peak_;
}

std::array<std::uint64_t, kMemoryOwners> MemoryAccount::used_by_owner() const {
  const std::lock_guard lock(mutex_);
  return by_owner_;
}

bool MemoryAccount::take_own(std::uint64_t bytes, MemoryOwner owner) noexcept {
  const std::lock_guard lock(mutex_);
  if (used_ > limit_ || bytes > limit_ - used_) return false;
  used_ += bytes;
  by_owner_[std::size_t(owner)] += bytes;
  peak_ = std::max(peak_, used_);
  return true;
}

bool MemoryAccount::take(std::uint64_t bytes, MemoryOwner owner) noexcept {
  if (!take_own(bytes, owner)) return false;
  if (!parent_ || parent_->take(bytes, owner)) return true;
  give_back_own(bytes, owner);
  return false;
}

bool MemoryAccount::obtain_own(std::uint64_t bytes, MemoryOwner owner) {
  while (!take_own(bytes, owner)) {
    if (!room_ || bytes > limit() || !room_->make_room(bytes)) return false;
  }
  return true;
}

bool MemoryAccount::obtain(std::uint64_t bytes, MemoryOwner owner) {
  if (!obtain_own(bytes, owner)) return false;
  try {
    if (!parent_ || parent_->obtain(bytes, owner)) return true;
  } catch (...) {  // no memory to make room with
    give_back_own(bytes, owner);
    throw;
  }
  give_back_own(bytes, owner);
  return false;
}

void MemoryAccount::give_back_own(std::uint64_t bytes, MemoryOwner owner) noexcept {
  const std::lock_guard lock(mutex_);
  used_ -= bytes;
  by_owner_[std::size_t(owner)] -= bytes;
}

void MemoryAccount::give_back(std::uint64_t bytes, MemoryOwner owner) noexcept {
  if (parent_) parent_->give_back(bytes, owner);
  give_back_own(bytes, owner);
}

// What is larger than the limit never fits.
Error MemoryAccount::refusal(std::uint64_t bytes, const std::string& what, std::uint64_t in_all) const {
  const std::uint64_t left = own_available();
  if (parent_ && bytes <= left) return parent_->refusal(bytes, what, in_all);
  const std::string of = parent_ ? "quota memory of the token '" + owner_ + "'" : "max_memory";
  (parent_ ? *parent_ : *this).refusals_.fetch_add(1, std::memory_order_relaxed);
  spdlog::info("memory refused for={} bytes={} left={} limit={} by={}", logged(what), bytes, left, limit(), logged(of));
  return {ErrorCode::resource_exhausted,
          fmt::format("{}: {} bytes are needed for {}, {} of {} are left", of, bytes, what, left, limit()),
          {},
          in_all <= limit() ? kRetrySeconds : 0};
}

bool GrowingReservation::grow(std::uint64_t bytes) noexcept {
  try {
    if (!account_.obtain(bytes, owner_)) return false;
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
  account_.give_back(bytes, owner_);
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
    if (!account_.take(missing, owner_)) return account_.refusal(missing, what, bytes);
    held_ += missing;
  }
  held_ -= bytes;
  return Reservation(&account_, bytes, owner_);
}

}  // namespace helio
