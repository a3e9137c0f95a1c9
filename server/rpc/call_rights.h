// What each rpc of RenderService asks of its caller: the one table.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "renderer/base/result.h"
#include "server/base/access_tokens.h"

namespace helio {

// Belongs to the token that made it; others act on it with the role admin alone.
enum class Belonging { none, session, job, scene };

struct CallRight {
  std::string_view rpc;
  Role least;         // the role that suffices
  Belonging acts_on;  // whose thing it changes or ends
};
std::span<const CallRight> call_rights();

// permission_denied: the caller's role is less than the rpc asks for. An rpc that is not in the table asks for admin.
Status check_role(const Caller& caller, std::string_view rpc);
// permission_denied: what is named, "session 's-1'", belongs to another token, and the caller is no admin. owner: name
// of its token; empty: nobody's.
Status check_owner(const Caller& caller, const std::string& owner, const std::string& what);

// Who asks, for events and logs: the token's name and the address that it calls from.
std::string asker(const Caller& caller, const std::string& peer);

}  // namespace helio
