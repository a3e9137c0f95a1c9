// Who may use the daemon: whoever names one of these tokens.
#pragma once

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

// None: everyone may. Holds digests alone. Thread safe.
class AccessTokens {
 public:
  // [kMinLength, kMaxLength] printable characters without spaces.
  static constexpr std::size_t kMinLength = 16, kMaxLength = 256;

  // A token a line; empty lines and those that begin with # do not count. invalid_argument names file and line: it
  // cannot be read, holds no token, or one that is too short or long; it never shows one.
  static Result<AccessTokens> read(const std::string& file);
  static AccessTokens of(std::string_view token);
  // 32 random characters for one run. internal: the machine gives no random bytes.
  static Result<std::string> make_random();

  bool empty() const { return digests_.empty(); }
  // Takes the same time for every token of one length.
  bool allow(std::string_view token) const;
  // The same of a header "Bearer TOKEN".
  bool allow_header(std::string_view authorization) const;

 private:
  std::vector<Sha256Digest> digests_;
};

inline constexpr char kAuthorizationKey[] = "authorization";  // of gRPC's metadata
std::string to_authorization(std::string_view token);

}  // namespace helio
