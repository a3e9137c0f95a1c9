// SHA-256 of a file, read in pieces.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "renderer/base/result.h"

namespace helio {

struct FileHash {
  std::array<std::uint8_t, 32> sha256{};
  std::uint64_t bytes = 0;
};

// not_found: the file cannot be opened; internal: reading failed.
Result<FileHash> sha256_of_file(const std::string& path);

}  // namespace helio
