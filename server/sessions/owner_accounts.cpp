#include "server/sessions/owner_accounts.h"

#include <cstdint>
#include <limits>

namespace helio {

// An account below the daemon's, and who makes room in it.
struct OwnerAccounts::Share final : RoomMaker {
  Share(OwnerAccounts& accounts, const std::string& name)
      : owner(name), reaper(accounts.reaper_), sessions(accounts.sessions_), account(accounts.memory_, name, this) {}

  bool make_room(std::uint64_t bytes) override {
    reaper.wait_until_idle();
    const std::uint64_t left = account.own_available();
    if (left >= bytes) return true;
    if (left + could_free() < bytes) return false;
    return sessions.make_room(bytes - left, &owner);
  }
  std::uint64_t could_free() const override { return sessions.idle_bytes(&owner); }

  const std::string owner;
  Reaper& reaper;
  SessionRegistry& sessions;
  MemoryAccount account;
};

MemoryAccount& OwnerAccounts::of(const std::string& name, const TokenQuotas& quotas) {
  if (name.empty()) return memory_;
  const std::lock_guard lock(mutex_);
  auto& share = shares_[name];
  if (!share) share = std::make_shared<Share>(*this, name);
  share->account.set_limit(quotas.memory.value_or(std::numeric_limits<std::uint64_t>::max()));
  return share->account;
}

}  // namespace helio
