#include "server/base/access_tokens.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <fstream>

namespace helio {
namespace {

constexpr std::string_view kScheme = "Bearer ";

Sha256Digest digest_of(std::string_view token) {
  Sha256 hash;
  hash.update(token);
  return hash.finish();
}

bool well_formed(std::string_view token) {
  return token.size() >= AccessTokens::kMinLength && token.size() <= AccessTokens::kMaxLength &&
         std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 127; });
}

}  // namespace

std::optional<std::vector<TokenLine>> read_token_lines(const std::string& file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  std::vector<TokenLine> lines;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    line.erase(line.find_last_not_of(" \t\r") + 1);
    if (!line.empty() && line.front() != '#') lines.push_back({number, line});
  }
  return lines;
}

Result<AccessTokens> AccessTokens::read(const std::string& file) {
  const auto lines = read_token_lines(file);
  if (!lines) return Error{ErrorCode::invalid_argument, "'" + file + "' cannot be read; allowed: a file", "token-file"};
  AccessTokens tokens;
  for (const auto& [number, line] : *lines) {
    if (!well_formed(line)) {
      return Error{ErrorCode::invalid_argument,
                   "line " + std::to_string(number) + " of '" + file + "' has " + std::to_string(line.size()) +
                       " bytes; allowed: " + std::to_string(kMinLength) + " to " + std::to_string(kMaxLength) +
                       " printable characters without spaces",
                   "token-file"};
    }
    tokens.digests_.push_back(digest_of(line));
  }
  if (!tokens.empty()) return tokens;
  return Error{ErrorCode::invalid_argument, "'" + file + "' holds no token; allowed: one a line", "token-file"};
}

AccessTokens AccessTokens::of(std::string_view token) {
  AccessTokens tokens;
  tokens.digests_.push_back(digest_of(token));
  return tokens;
}

Result<std::string> AccessTokens::make_random() {
  std::array<unsigned char, 16> bytes;
  if (RAND_bytes(bytes.data(), int(bytes.size())) != 1) {
    return Error{ErrorCode::internal, "the machine gives no random bytes", {}};
  }
  return to_hex(bytes);
}

bool AccessTokens::allow(std::string_view token) const {
  if (digests_.empty()) return true;
  const Sha256Digest digest = digest_of(token.substr(0, kMaxLength + 1));
  bool found = false;
  for (const Sha256Digest& known : digests_) found |= CRYPTO_memcmp(known.data(), digest.data(), digest.size()) == 0;
  return found;
}

bool AccessTokens::allow_header(std::string_view authorization) const {
  if (digests_.empty()) return true;
  return authorization.starts_with(kScheme) && allow(authorization.substr(kScheme.size()));
}

std::string to_authorization(std::string_view token) {
  return std::string(kScheme) + std::string(token);
}

}  // namespace helio
