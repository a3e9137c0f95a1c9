// Looks over the chunks of a DWA-compressed file before the library may allocate by what they say. Internal to the
// codec.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "renderer/base/result.h"

namespace helio {

// Each DWA chunk begins with the sizes of its parts; OpenEXR 3.1 allocates what they claim. Ok when every chunk lies in
// the file and no size exceeds what `chunk_bytes` of uncompressed pixels can need; else invalid_argument.
// `offsets_at` is where the table of `chunks` offsets begins.
Status scan_dwa_chunks(std::span<const std::uint8_t> bytes, std::size_t offsets_at, std::size_t chunks,
                       std::uint64_t chunk_bytes);

}  // namespace helio
