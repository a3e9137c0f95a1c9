// The tokens that are in force, and the calls under way of those who named one.
#pragma once

#include <grpcpp/support/status.h>

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "server/base/access_tokens.h"

namespace helio {

// Thread safe.
class AccessControl {
 public:
  // file: where the tokens are from; empty: they stay.
  explicit AccessControl(AccessTokens tokens = {}, std::string file = {});

  std::shared_ptr<const AccessTokens> tokens() const;
  bool empty() const { return tokens()->empty(); }
  // As of AccessTokens.
  CallerPtr find(std::string_view token) const { return tokens()->find(token); }
  CallerPtr find_header(std::string_view authorization) const { return tokens()->find_header(authorization); }
  // What a token of this name may have now; without limits where there is none of it.
  TokenQuotas quotas_of(const std::string& name) const;

  // Reads the file again, and ends the calls whose token is gone, or may do less than it could, with UNAUTHENTICATED.
  // On an error, as of AccessTokens::read(), everything stays as it is.
  Status reload();

  // A call under way, until this goes.
  class Call {
   public:
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    friend class AccessControl;
    struct Entry {
      CallerPtr caller;
      std::function<void(const grpc::Status&)> end;
    };
    Call(AccessControl& control, std::list<Entry>::iterator entry) : control_(control), entry_(entry) {}
    AccessControl& control_;
    const std::list<Entry>::iterator entry_;
  };
  // `end` ends the call: also within begin(), where the token has gone since the call was admitted. It may be called once
  // this call is over, so it owns or holds by weak_ptr what it uses.
  [[nodiscard]] std::unique_ptr<Call> begin(CallerPtr caller, std::function<void(const grpc::Status&)> end);

 private:
  const std::string file_;
  mutable std::mutex mutex_;
  std::shared_ptr<const AccessTokens> tokens_;
  std::list<Call::Entry> calls_;
};

}  // namespace helio
