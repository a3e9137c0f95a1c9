#include "server/memory_account.h"

#include <spdlog/fmt/fmt.h>

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
  const std::lock_guard lock(mutex_);
  if (bytes > limit_ - used_) {
    return Error{
        ErrorCode::resource_exhausted,
        fmt::format("max_memory: {} bytes are needed for {}, {} of {} are left", bytes, what, limit_ - used_, limit_),
        {}};
  }
  used_ += bytes;
  return Reservation(this, bytes);
}

std::uint64_t MemoryAccount::used() const {
  const std::lock_guard lock(mutex_);
  return used_;
}

void MemoryAccount::give_back(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  used_ -= bytes;
}

}  // namespace helio
