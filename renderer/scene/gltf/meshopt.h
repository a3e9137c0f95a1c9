// EXT_meshopt_compression: compressed buffer views to plain bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

// count * byte_stride bytes, already reserved by the caller. Errors (without `where`): invalid_argument.
Result<std::vector<std::uint8_t>> decode_meshopt(const MeshoptView& view, std::span<const std::uint8_t> compressed);

}  // namespace helio::gltf
