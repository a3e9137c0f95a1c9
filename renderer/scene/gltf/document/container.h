// The outermost layer of a glTF file: plain JSON, or a GLB with its chunks (glTF 2.0 specification, section 4.4).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "renderer/base/result.h"

namespace helio::gltf {

struct Container {
  std::span<const std::uint8_t> json;
  std::size_t json_offset = 0;  // where the JSON starts in the file, for messages
  bool is_glb = false;
  std::optional<std::span<const std::uint8_t>> bin;  // the GLB's binary chunk
  std::vector<std::string> warnings;
  std::vector<std::pair<std::size_t, std::string>> slips;  // byte, broken rule of the format that leaves no doubt
};

// True when the bytes carry the GLB magic.
bool looks_like_glb(std::span<const std::uint8_t> file);

// Views into `file`; nothing is copied. Without the magic the whole file is JSON, unless expect_glb.
// Errors: invalid_argument with "name@byte".
Result<Container> open_container(std::span<const std::uint8_t> file, const std::string& name, bool expect_glb);

}  // namespace helio::gltf
