// What is written down of a scene so that it can be loaded again, and its form on the disk.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/codec/sha256.h"
#include "renderer/scene/load/scene_edit.h"
#include "server/scenes/scene_registry.h"

namespace helio {

struct SceneRecipe {
  std::string scene_id, loaded_id;  // the same when it was not edited
  double time_s = 0;
  std::string animation, environment;
  std::string main_file;                      // absolute; of an upload, a name in the bundle
  std::map<std::string, Sha256Digest> files;  // by absolute path, or by name in the bundle
  bool upload = false;
  SceneChanges changes;

  // What the recipe keeps of the upload, by SHA-256, hexadecimal, each once; none of a scene from disk.
  std::vector<std::string> blobs() const;
};

SceneRecipe make_recipe(const LoadedScene& scene);

// A sealed message of scene_recipe.proto: numbers keep their bits, and names may be any bytes.
std::vector<std::uint8_t> encode_recipe(const SceneRecipe& recipe);
// internal: the bytes are damaged or of a version that this program does not know.
Result<SceneRecipe> decode_recipe(std::span<const std::uint8_t> bytes);

}  // namespace helio
