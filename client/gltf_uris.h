// Which other files a glTF document names, found without loading it.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace helio {

// Every distinct string under a key "uri" (buffers, images) or "image" (the environment map of extras.heliograph) that
// is not a data: URI, in the order of appearance, as written (still percent-encoded). A document that is not JSON gives
// what was read up to the fault: the server reports the fault with its place, once it has the file. Memory does not
// grow with embedded data beyond one string.
std::vector<std::string> find_gltf_uris(std::istream& json);

// "%20" -> " "; a '%' without two hexadecimal digits stays as it is.
std::string percent_decode(const std::string& text);

// The path that a loader resolves the URI to: percent-decoded, without "." and inner "..". None when it would leave the
// folder that it starts from, or names a scheme, a drive, a root or a backslash. Only files with such a path are
// uploaded: a scene file must not be able to fetch others from the client's disk.
std::optional<std::string> relative_path_of(const std::string& uri);

}  // namespace helio
