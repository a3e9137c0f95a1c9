// URIs of buffers and images: data URIs (RFC 2397) and relative references (RFC 3986).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/description/memory_budget.h"

namespace helio::gltf {

struct DataUri {
  std::string media_type;  // lower case, without parameters; empty when not given
  std::vector<std::uint8_t> bytes;
};

bool is_data_uri(std::string_view uri);
// The bytes are reserved in `budget`. Errors (without `where`): invalid_argument, resource_exhausted.
Result<DataUri> decode_data_uri(std::string_view uri, MemoryBudget& budget);

// True for "http://..." and the like: something that no FileSource can hold.
bool has_scheme(std::string_view uri);

// "a/b.gltf" and "../c%20d.png" to "c d.png". ".." that would leave the root stays in the path, for the FileSource to
// refuse. Errors (without `where`): invalid_argument for an empty URI, an empty scheme or a broken escape.
Result<std::string> resolve_uri(std::string_view base_file, std::string_view uri);

}  // namespace helio::gltf
