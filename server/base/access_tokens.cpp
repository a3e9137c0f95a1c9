#include "server/base/access_tokens.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <limits>
#include <sstream>

#include "renderer/codec/atomic_file.h"
#include "server/base/byte_size.h"

namespace helio {
namespace {

constexpr std::string_view kScheme = "Bearer ";
constexpr std::string_view kHash = "sha256:";
constexpr std::size_t kMaxName = 64;
constexpr std::uint64_t kMaxFileBytes = 16 << 20;
constexpr const char* kForm =
    "a token alone (16 to 256 printable characters without spaces), or "
    "NAME ROLE sha256:HEX [sessions=N] [jobs=N] [memory=SIZE]";

bool well_formed(std::string_view token) {
  return token.size() >= AccessTokens::kMinLength && token.size() <= AccessTokens::kMaxLength &&
         std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 127; });
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(text.find_first_of(" \t", begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    text.remove_prefix(end);
  }
}

bool read_digest(std::string_view text, Sha256Digest& digest) {
  if (text.size() != kHash.size() + 2 * digest.size() || !text.starts_with(kHash)) return false;
  text.remove_prefix(kHash.size());
  for (std::size_t i = 0; i < digest.size(); ++i) {
    const auto [end, error] = std::from_chars(text.data() + 2 * i, text.data() + 2 * i + 2, digest[i], 16);
    if (error != std::errc() || end != text.data() + 2 * i + 2) return false;
  }
  return true;
}

// "jobs=4"; what is wrong with it, empty: nothing.
std::string read_quota(std::string_view word, TokenQuotas& quotas) {
  const std::size_t equals = word.find('=');
  const std::string_view name = word.substr(0, equals);
  const std::string value(equals == std::string_view::npos ? std::string_view() : word.substr(equals + 1));
  std::optional<std::uint64_t>* const quota = name == "sessions" ? &quotas.sessions
                                              : name == "jobs"   ? &quotas.jobs
                                              : name == "memory" ? &quotas.memory
                                                                 : nullptr;
  if (!quota) return fmt::format("'{}'; allowed: sessions=N, jobs=N, memory=SIZE", word.substr(0, 64));
  if (quota->has_value()) return fmt::format("{} comes twice", name);
  std::uint64_t number = 0;
  std::string problem;
  if (name == "memory") {
    problem = read_bytes(value, 0, number);
  } else {
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    const bool fits = error == std::errc() && end == value.data() + value.size() && number <= 1000000;
    if (!fits) problem = fmt::format("'{}'; allowed: [0, 1000000]", value.substr(0, 64));
  }
  if (!problem.empty()) return fmt::format("{}: {}", name, problem);
  *quota = number;
  return {};
}

// What is wrong with the line, without what it holds of a token; empty: nothing.
std::string read_line(const TokenLine& line, Caller& caller) {
  const std::vector<std::string_view> words = words_of(line.text);
  if (words.size() == 1) {
    if (line.text.starts_with(kHash)) return fmt::format("has a hash without a name; allowed: {}", kForm);
    caller.digest = AccessTokens::digest_of(line.text);
    caller.name = std::string(AccessTokens::kUnnamed) + to_hex(caller.digest).substr(0, 12);
    return well_formed(line.text) ? std::string() : fmt::format("has {} bytes; allowed: {}", line.text.size(), kForm);
  }
  // Until its hash is found the line may hold a token, which no message shows.
  if (words.size() < 3 || !is_token_name(words[0])) return fmt::format("has no known form; allowed: {}", kForm);
  caller.name = words[0];
  const std::optional<Role> role = read_role(words[1]);
  if (!role) return "has no role as its second word; allowed: view, render, admin";
  caller.role = *role;
  if (!read_digest(words[2], caller.digest))
    return "has no hash as its third word; allowed: sha256: and 64 hexadecimal digits";
  if (caller.name.starts_with(AccessTokens::kUnnamed))
    return fmt::format("is called '{}', as tokens without a name are; allowed: another name", caller.name);
  for (std::size_t i = 3; i < words.size(); ++i) {
    const std::string problem = read_quota(words[i], caller.quotas);
    if (!problem.empty()) return fmt::format("of '{}' has a bad quota: {}", caller.name, problem);
  }
  return {};
}

}  // namespace

const char* to_string(Role role) {
  switch (role) {
    case Role::view:
      return "view";
    case Role::render:
      return "render";
    case Role::admin:
      return "admin";
  }
  return "";
}

std::optional<Role> read_role(std::string_view text) {
  for (const Role role : {Role::view, Role::render, Role::admin}) {
    if (text == to_string(role)) return role;
  }
  return std::nullopt;
}

bool is_token_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxName && std::all_of(name.begin(), name.end(), [](char c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    return letter || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
  });
}

std::string to_token_line(const Caller& caller) {
  std::string line = fmt::format("{} {} {}{}", caller.name, to_string(caller.role), kHash, to_hex(caller.digest));
  if (caller.quotas.sessions) line += fmt::format(" sessions={}", *caller.quotas.sessions);
  if (caller.quotas.jobs) line += fmt::format(" jobs={}", *caller.quotas.jobs);
  if (caller.quotas.memory) line += fmt::format(" memory={}", *caller.quotas.memory);
  return line;
}

std::optional<std::vector<TokenLine>> read_token_lines(const std::string& file) {
  const auto bytes = read_whole_file(file, kMaxFileBytes);  // neither a pipe nor a device
  if (!bytes) return std::nullopt;
  std::istringstream in(std::string(bytes->begin(), bytes->end()));
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
  if (!lines) {
    return Error{ErrorCode::invalid_argument, "'" + file + "' cannot be read; allowed: a file of at most 16 MiB",
                 "token-file"};
  }
  AccessTokens tokens;
  const auto wrong = [&](const TokenLine& line, const std::string& problem) {
    return Error{ErrorCode::invalid_argument, fmt::format("line {} of '{}' {}", line.number, file, problem),
                 "token-file"};
  };
  for (const TokenLine& line : *lines) {
    auto caller = std::make_shared<Caller>();
    const std::string problem = read_line(line, *caller);
    if (!problem.empty()) return wrong(line, problem);
    if (tokens.by_name(caller->name)) return wrong(line, "names '" + caller->name + "' again; allowed: each name once");
    if (tokens.by_digest(caller->digest)) return wrong(line, "holds a token that is there already; allowed: each once");
    tokens.callers_.push_back(std::move(caller));
  }
  if (!tokens.empty()) return tokens;
  return Error{ErrorCode::invalid_argument, "'" + file + "' holds no token; allowed: one a line", "token-file"};
}

AccessTokens AccessTokens::of(std::string_view token) {
  AccessTokens tokens;
  auto caller = std::make_shared<Caller>();
  caller->digest = digest_of(token);
  tokens.callers_.push_back(std::move(caller));
  return tokens;
}

Result<std::string> AccessTokens::make_random() {
  std::array<unsigned char, 16> bytes;
  if (RAND_bytes(bytes.data(), int(bytes.size())) != 1) {
    return Error{ErrorCode::internal, "the machine gives no random bytes", {}};
  }
  return to_hex(bytes);
}

Sha256Digest AccessTokens::digest_of(std::string_view token) {
  Sha256 hash;
  hash.update(token);
  return hash.finish();
}

CallerPtr AccessTokens::find(std::string_view token) const {
  static const CallerPtr everyone = std::make_shared<const Caller>();
  if (callers_.empty()) return everyone;
  const Sha256Digest digest = digest_of(token.substr(0, kMaxLength + 1));
  std::size_t found = callers_.size();
  for (std::size_t i = 0; i < callers_.size(); ++i) {
    if (CRYPTO_memcmp(callers_[i]->digest.data(), digest.data(), digest.size()) == 0) found = i;
  }
  return found < callers_.size() ? callers_[found] : nullptr;
}

CallerPtr AccessTokens::find_header(std::string_view authorization) const {
  if (callers_.empty()) return find({});
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == std::tolower(b); };
  const std::string_view scheme = authorization.substr(0, kScheme.size());  // its case does not count (RFC 9110, 11.1)
  const bool bearer = std::equal(scheme.begin(), scheme.end(), kScheme.begin(), kScheme.end(), same);
  return bearer ? find(authorization.substr(kScheme.size())) : nullptr;
}

CallerPtr AccessTokens::by_name(const std::string& name) const {
  const auto found = std::find_if(callers_.begin(), callers_.end(), [&](const auto& c) { return c->name == name; });
  return found == callers_.end() ? nullptr : *found;
}

CallerPtr AccessTokens::by_digest(const Sha256Digest& digest) const {
  const auto found = std::find_if(callers_.begin(), callers_.end(), [&](const auto& c) { return c->digest == digest; });
  return found == callers_.end() ? nullptr : *found;
}

std::string to_authorization(std::string_view token) {
  return std::string(kScheme) + std::string(token);
}

}  // namespace helio
