// What the text of --environment and of LoadScene's environment says.
#pragma once

#include <string>

#include "renderer/base/result.h"

namespace helio {

// True: the text names a map. False: it is empty (the scene's own) or a colour "R,G,B".
// invalid_argument: every part between the commas looks like a number, so that a colour is meant, but they are not
// three numbers in [0, 3.4e38].
Result<bool> names_environment_map(const std::string& text);

}  // namespace helio
