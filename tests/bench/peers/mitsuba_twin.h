// A glTF binary as a Mitsuba XML file of diffuse materials (mitsuba_twin.py), which both renderers read.
#pragma once

#include <filesystem>
#include <string>

#include "renderer/base/result.h"

namespace helio::bench {

struct TwinRequest {
  std::filesystem::path glb;
  int width = 0, height = 0;  // of the film, in pixels
  std::string sky;            // radiance "R,G,B" of a constant environment; empty: none
};

// The XML file, with its meshes and images in `folder`, which is made. `python` has numpy. failed_precondition: the
// script refused the file, and said on stderr why.
Result<std::filesystem::path> write_mitsuba_twin(const std::string& python, const TwinRequest& request,
                                                 const std::filesystem::path& folder);

}  // namespace helio::bench
