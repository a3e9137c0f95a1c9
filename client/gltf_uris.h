// Which other files a glTF document names, found without loading it.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace helio {

// Every distinct string under a key "uri" that is not a data: URI, in the order of appearance, as written (still
// percent-encoded). A document that is not JSON gives what was read up to the fault: the server reports the fault with
// its place, once it has the file. Memory does not grow with embedded data beyond one string.
std::vector<std::string> find_gltf_uris(std::istream& json);

// "%20" -> " "; a '%' without two hexadecimal digits stays as it is.
std::string percent_decode(const std::string& text);

// A relative path that stays below the folder it starts from: no scheme, no leading '/', no drive letter, no backslash,
// no "..", not empty. Only such files are uploaded: a scene file must not be able to fetch others from the
// client's disk.
bool is_safe_relative_path(const std::string& path);

}  // namespace helio
