// SHA-256 of byte streams and files.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "renderer/base/result.h"

namespace helio {

using Sha256Digest = std::array<std::uint8_t, 32>;

class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void update(std::span<const std::uint8_t> bytes);
  void update(std::string_view text);
  Sha256Digest finish();  // once

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct FileHash {
  Sha256Digest sha256{};
  std::uint64_t bytes = 0;
};
// Reads the file in pieces. not_found: it cannot be opened; internal: reading failed.
Result<FileHash> hash_file(const std::string& path);

std::string to_hex(std::span<const std::uint8_t> bytes);

}  // namespace helio
