// A scene of two files, from disk or as an upload, and a registry to load it with.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "server/scenes/scene_registry.h"
#include "tests/service/process.h"

namespace helio::test {

// A triangle that shines; `glow` is its radiance.
inline std::string triangle_gltf(int glow = 1) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "tri", "mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
 "materials": [{"name": "light", "emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength":
   {"emissiveStrength": )" + std::to_string(glow) + R"(}}}], "extensionsUsed": ["KHR_materials_emissive_strength"],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
   "min": [0, 0, 0], "max": [1, 1, 0]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "triangle.bin", "byteLength": 36}]})";
}

inline std::string triangle_bin() {
  const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::string bytes(sizeof(positions), '\0');
  std::memcpy(bytes.data(), positions, sizeof(positions));
  return bytes;
}

inline SceneBundle make_bundle(const std::string& main_file,
                               const std::vector<std::pair<std::string, std::string>>& files) {
  SceneBundle bundle;
  bundle.main_file = main_file;
  for (const auto& [name, bytes] : files) {
    bundle.files.push_back({name, {bytes.begin(), bytes.end()}});
    Sha256 hash;
    hash.update(bytes);
    bundle.digests[name] = hash.finish();
  }
  return bundle;
}

inline SceneBundle triangle_bundle(int glow = 1) {
  return make_bundle("triangle.gltf", {{"triangle.gltf", triangle_gltf(glow)}, {"triangle.bin", triangle_bin()}});
}

// What a daemon would load with.
class SceneLoads {
 public:
  explicit SceneLoads(const std::vector<std::string>& roots = {})
      : scenes(*SceneRoots::open(roots), {1 << 20, 1 << 30, 100, 1}, memory) {}

  std::shared_ptr<const LoadedScene> load(SceneRequest request) {
    auto loaded = scenes.load(std::move(request), never);
    EXPECT_TRUE(loaded) << loaded.error().to_string();
    return loaded ? loaded->scene : nullptr;
  }
  std::shared_ptr<const LoadedScene> load(SceneBundle bundle) {
    SceneRequest request;
    request.files = std::move(bundle);
    return load(std::move(request));
  }
  std::shared_ptr<const LoadedScene> load(const std::string& path) {
    SceneRequest request;
    request.files = path;
    return load(std::move(request));
  }
  std::shared_ptr<const LoadedScene> edit(const std::string& id, const std::vector<SceneEdit>& edits) {
    auto lease = scenes.acquire(id, "");
    EXPECT_TRUE(lease.ok());
    auto edited = scenes.edit(*lease, edits, never);
    EXPECT_TRUE(edited) << edited.error().to_string();
    return edited ? edited->scene : nullptr;
  }

  CancelToken never;
  MemoryAccount memory{1ull << 30};
  SceneRegistry scenes;
};

}  // namespace helio::test
