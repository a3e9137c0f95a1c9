#include "server/base/access_control.h"

#include <utility>
#include <vector>

namespace helio {

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
      const CallerPtr now = tokens->by_digest(call.caller->digest);
      const bool stays = now && now->name == call.caller->name && now->role >= call.caller->role;
      if (!stays) ended.push_back(call.end);
    }
  }
  const grpc::Status status(grpc::StatusCode::UNAUTHENTICATED,
                            "the daemon's token file was changed: the token of this call is gone, or may do less");
  for (const auto& end : ended) end(status);
  return ok_status();
}

std::unique_ptr<AccessControl::Call> AccessControl::begin(CallerPtr caller,
                                                          std::function<void(const grpc::Status&)> end) {
  const std::lock_guard lock(mutex_);
  calls_.push_back({std::move(caller), std::move(end)});
  return std::unique_ptr<Call>(new Call(*this, std::prev(calls_.end())));
}

AccessControl::Call::~Call() {
  std::list<Entry> gone;  // what it holds goes without the lock
  const std::lock_guard lock(control_.mutex_);
  gone.splice(gone.begin(), control_.calls_, entry_);
}

}  // namespace helio
