#include "server/base/access_control.h"

#include <utility>
#include <vector>

namespace helio {
namespace {

// Whether a caller whom earlier tokens admitted may go on under these.
bool may_go_on(const AccessTokens& tokens, const Caller& caller) {
  const CallerPtr now = tokens.by_digest(caller.digest);
  return now && now->name == caller.name && now->role >= caller.role;
}

grpc::Status token_changed() {
  return {grpc::StatusCode::UNAUTHENTICATED,
          "the daemon's token file was changed: the token of this call is gone, or may do less"};
}

}  // namespace

AccessControl::AccessControl(AccessTokens tokens, std::string file)
    : file_(std::move(file)), tokens_(std::make_shared<const AccessTokens>(std::move(tokens))) {}

std::shared_ptr<const AccessTokens> AccessControl::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

TokenQuotas AccessControl::quotas_of(const std::string& name) const {
  const CallerPtr caller = name.empty() ? nullptr : tokens()->by_name(name);
  return caller ? caller->quotas : TokenQuotas();
}

Status AccessControl::reload() {
  if (file_.empty()) return ok_status();
  auto read = AccessTokens::read(file_);
  if (!read) return read.error();
  const auto tokens = std::make_shared<const AccessTokens>(std::move(*read));
  std::vector<std::function<void(const grpc::Status&)>> ended;  // called without the lock
  {
    const std::lock_guard lock(mutex_);
    tokens_ = tokens;
    for (const Call::Entry& call : calls_) {
      if (!may_go_on(*tokens, *call.caller)) ended.push_back(call.end);
    }
  }
  for (const auto& end : ended) end(token_changed());
  return ok_status();
}

std::unique_ptr<AccessControl::Call> AccessControl::begin(CallerPtr caller,
                                                          std::function<void(const grpc::Status&)> end) {
  std::unique_lock lock(mutex_);
  const bool stays = file_.empty() || may_go_on(*tokens_, *caller);  // since it was admitted
  calls_.push_back({std::move(caller), end});
  std::unique_ptr<Call> call(new Call(*this, std::prev(calls_.end())));
  lock.unlock();
  if (!stays) end(token_changed());
  return call;
}

AccessControl::Call::~Call() {
  std::list<Entry> gone;  // what it holds goes without the lock
  const std::lock_guard lock(control_.mutex_);
  gone.splice(gone.begin(), control_.calls_, entry_);
}

}  // namespace helio
