// The files that make up a scene on the client's disk, ready to be uploaded.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

struct LocalSceneFile {
  std::string name;  // within the bundle: relative, '/'-separated, unique
  std::string path;  // on this machine's disk
  std::uint64_t bytes = 0;
};

struct LocalScene {
  std::string main_file;  // name of the scene file; always files[0].name
  std::vector<LocalSceneFile> files;
  std::string environment;  // what LoadScene.Begin wants: "", "R,G,B" or the name of a bundled map

  std::uint64_t total_bytes() const;
};

// The scene file and every file that it names ("uri"s of .gltf and of the JSON of a .glb, "filename"s of .xml).
// Names that leave the scene's folder and files that do not exist are left out: the server, which knows whether they
// matter, reports them.
// `environment`: empty, "R,G,B" (see environment_text.h), or a map on this disk, which joins the bundle.
// Errors: not_found (scene file), invalid_argument (environment; where is "environment").
Result<LocalScene> collect_local_scene(const std::string& scene_path, const std::string& environment);

}  // namespace helio
