#include "server/sessions/idle_room.h"

namespace helio {

bool IdleRoom::make_room(std::uint64_t bytes) {
  reaper_.wait_until_idle();
  const std::uint64_t left = memory_.available();
  if (left >= bytes) return true;
  // Nothing is ended in vain.
  if (left + could_free() < bytes) return false;
  return scenes_.evict_edited() || (spare_ && spare_->free_some()) || sessions_.make_room(bytes - left);
}

std::uint64_t IdleRoom::could_free() const {
  return scenes_.evictable_bytes() + (spare_ ? spare_->could_free() : 0) + sessions_.idle_bytes();
}

}  // namespace helio
