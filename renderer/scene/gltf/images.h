// A file's images: which are needed, their bytes, and decoding.
#pragma once

#include <vector>

#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/gltf/buffers.h"

namespace helio::gltf {

struct LoadedImages {
  std::vector<Image> images;
  std::vector<int> index;  // by image of the document: its place in `images`, or -1 when it was not needed
};

// Decodes the needed images (one flag per image of the document) and looks at the headers of the others, so that a
// broken file is refused whether it shows or not. glTF allows PNG and JPEG.
LoadedImages load_images(const Document& document, const std::vector<bool>& needed, const BufferStore& buffers,
                         const FileSource& source, const std::string& scene_file, MemoryBudget& budget,
                         Diagnostics& diagnostics);

}  // namespace helio::gltf
