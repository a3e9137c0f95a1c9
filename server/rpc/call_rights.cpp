#include "server/rpc/call_rights.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>

namespace helio {
namespace {

constexpr CallRight kRights[] = {
    {"GetServerInfo", Role::view, Belonging::none},
    {"ListScenes", Role::view, Belonging::none},
    {"DescribeScene", Role::view, Belonging::none},
    {"ListFiles", Role::view, Belonging::none},
    {"ListSessions", Role::view, Belonging::none},
    {"WatchFrames", Role::view, Belonging::none},  // takes the place of another listener only in the owner's session
    {"ListJobs", Role::view, Belonging::none},
    {"GetJob", Role::view, Belonging::none},
    {"WatchJob", Role::view, Belonging::none},
    {"GetResult", Role::view, Belonging::none},

    {"LoadScene", Role::render, Belonging::none},
    {"EditScene", Role::render, Belonging::none},  // makes another scene
    {"UnloadScene", Role::render, Belonging::scene},
    {"CreateSession", Role::render, Belonging::none},
    {"UpdateSession", Role::render, Belonging::session},
    {"StreamFrames", Role::render, Belonging::session},
    {"CloseSession", Role::render, Belonging::session},
    {"RunJob", Role::render, Belonging::none},
    {"CancelJob", Role::render, Belonging::job},
    {"SubmitJob", Role::render, Belonging::none},
    {"PauseJob", Role::render, Belonging::job},
    {"ResumeJob", Role::render, Belonging::job},
    {"SetJobPriority", Role::render, Belonging::job},
    {"Compare", Role::render, Belonging::none},
    {"LoadReference", Role::render, Belonging::none},
    {"ReplaySample", Role::render, Belonging::none},
};

}  // namespace

std::span<const CallRight> call_rights() {
  return kRights;
}

Status check_role(const Caller& caller, std::string_view rpc) {
  const auto found = std::find_if(std::begin(kRights), std::end(kRights), [&](const auto& r) { return r.rpc == rpc; });
  const Role least = found == std::end(kRights) ? Role::admin : found->least;
  if (caller.role >= least) return ok_status();
  return Error{ErrorCode::permission_denied,
               fmt::format("the token '{}' has the role {}; {} needs {}", caller.name, to_string(caller.role), rpc,
                           to_string(least)),
               {}};
}

Status check_owner(const Caller& caller, const std::string& owner, const std::string& what) {
  if (caller.role == Role::admin || (!owner.empty() && owner == caller.name)) return ok_status();
  return Error{ErrorCode::permission_denied,
               fmt::format("{} belongs to {}, not to the token '{}', which has the role {}; this needs admin", what,
                           owner.empty() ? "nobody who has a token" : "the token '" + owner + "'", caller.name,
                           to_string(caller.role)),
               {}};
}

std::string asker(const Caller& caller, const std::string& peer) {
  return caller.name.empty() ? peer : caller.name + " (" + peer + ")";
}

}  // namespace helio
