// Who may use the daemon, and for what: whoever names a token of its token file.
//
// A line of the file is a token alone, which has every right, or
//
//   NAME ROLE sha256:HEX [sessions=N] [jobs=N] [memory=SIZE]
//
// with the hash of a token, so that the file tells nobody a secret. `heliograph token` writes such lines.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/codec/sha256.h"

namespace helio {

// A line of a token file that counts: not empty, and not begun with #.
struct TokenLine {
  int number = 0;    // from 1
  std::string text;  // without white space at its end
};
// Nothing: the file cannot be read.
std::optional<std::vector<TokenLine>> read_token_lines(const std::string& file);

// Each has the rights of those before it.
enum class Role {
  view,    // looks and watches
  render,  // loads, edits and renders, and acts on what belongs to the same token
  admin,   // acts on what belongs to others, too
};
const char* to_string(Role role);
std::optional<Role> read_role(std::string_view text);  // nothing: none of them

// How much a token may have at a time; nothing: as much as the daemon's limits allow.
struct TokenQuotas {
  std::optional<std::uint64_t> sessions;  // open ones
  std::optional<std::uint64_t> jobs;      // that wait, are paused or run, kept ones and others, comparisons included
  std::optional<std::uint64_t> memory;    // bytes of films, queues and uploads
  bool operator==(const TokenQuotas&) const = default;
};

// Who calls.
struct Caller {
  std::string name;  // of the token; empty: the daemon has no token file
  Role role = Role::admin;
  TokenQuotas quotas;
  Sha256Digest digest{};  // of the token
};
using CallerPtr = std::shared_ptr<const Caller>;

// [1, 64] letters, digits and "._-".
bool is_token_name(std::string_view name);
// The line of a token: what the file holds of it.
std::string to_token_line(const Caller& caller);

// None: everyone may, and everything. Holds digests alone. Immutable, so thread safe.
class AccessTokens {
 public:
  // [kMinLength, kMaxLength] printable characters without spaces.
  static constexpr std::size_t kMinLength = 16, kMaxLength = 256;

  // Begins the names of tokens that stand alone in their line; the first 12 digits of their hash follow.
  static constexpr std::string_view kUnnamed = "unnamed-";

  // Empty lines and those that begin with # do not count. invalid_argument names file and line, and never shows a token:
  // the file cannot be read or holds none, a line is neither form, or names or tokens come twice.
  static Result<AccessTokens> read(const std::string& file);
  static AccessTokens of(std::string_view token);  // with every right, and without a name
  // 32 random characters. internal: the machine gives no random bytes.
  static Result<std::string> make_random();
  static Sha256Digest digest_of(std::string_view token);

  bool empty() const { return callers_.empty(); }
  // Whose token it is; null: nobody's. Takes the same time for every token of one length.
  CallerPtr find(std::string_view token) const;
  // The same of a header "Bearer TOKEN".
  CallerPtr find_header(std::string_view authorization) const;
  bool allow(std::string_view token) const { return find(token) != nullptr; }
  bool allow_header(std::string_view authorization) const { return find_header(authorization) != nullptr; }

  CallerPtr by_name(const std::string& name) const;       // null: there is none
  CallerPtr by_digest(const Sha256Digest& digest) const;  // null: there is none
  const std::vector<CallerPtr>& callers() const { return callers_; }

 private:
  std::vector<CallerPtr> callers_;
};

inline constexpr char kAuthorizationKey[] = "authorization";  // of gRPC's metadata
std::string to_authorization(std::string_view token);

}  // namespace helio
