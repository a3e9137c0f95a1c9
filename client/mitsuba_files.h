// Names of the files that a Mitsuba scene (.xml) needs.
#pragma once

#include <string>
#include <vector>

namespace helio {

// What <include> and the properties called filename name, files of included files too, as written, each once.
// Below a <path> of the scene the names of what lies there come too.
// `folder`: of the scene file, with a slash at its end, or "". Parameters ("$name") with a <default> are replaced. What
// cannot be read or parsed adds nothing: the server reports it.
std::vector<std::string> find_mitsuba_files(const std::string& scene_path, const std::string& folder);

}  // namespace helio
