// What each token holds of the daemon's memory, for its quota.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/base/access_tokens.h"
#include "server/base/memory_account.h"
#include "server/base/reaper.h"
#include "server/sessions/session_registry.h"

namespace helio {

// Thread safe. Outlives what is reserved.
class OwnerAccounts {
 public:
  // The last two may be constructed later.
  OwnerAccounts(MemoryAccount& memory, Reaper& reaper, SessionRegistry& sessions)
      : memory_(memory), reaper_(reaper), sessions_(sessions) {}

  // The share of whoever has this name, under these quotas from now on; the whole account where the name is empty.
  // Where the quota is short, sessions of the same owner to which nobody listens make room.
  MemoryAccount& of(const std::string& name, const TokenQuotas& quotas);

 private:
  struct Share;

  MemoryAccount& memory_;
  Reaper& reaper_;
  SessionRegistry& sessions_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Share>> shares_;
};

}  // namespace helio
