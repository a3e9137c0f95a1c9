// Small glTF files made in memory: a JSON tree to edit, and one buffer that grows as accessors are added.
//
//   GltfBuilder file;
//   file.add_triangle();               // mesh 0, one triangle, under node 0 of scene 0
//   file.root["nodes"][0]["scale"] = {2, 2, 2};
//   const SceneDescription scene = file.must_load();
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "renderer/scene/load/scene_loader.h"

namespace helio::test {

using nlohmann::json;

template <class T>
constexpr int component_type_of() {
  if constexpr (std::is_same_v<T, std::int8_t>) return 5120;
  if constexpr (std::is_same_v<T, std::uint8_t>) return 5121;
  if constexpr (std::is_same_v<T, std::int16_t>) return 5122;
  if constexpr (std::is_same_v<T, std::uint16_t>) return 5123;
  if constexpr (std::is_same_v<T, std::uint32_t>) return 5125;
  if constexpr (std::is_same_v<T, float>) return 5126;
}

class GltfBuilder {
 public:
  GltfBuilder() { root["asset"]["version"] = "2.0"; }

  // Appends bytes to the buffer, 4-byte aligned; returns the view's index.
  int add_view(const void* data, std::size_t size) {
    buffer_.resize((buffer_.size() + 3) / 4 * 4);
    root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", size}});
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    buffer_.insert(buffer_.end(), bytes, bytes + size);
    return int(root["bufferViews"].size()) - 1;
  }

  // Tightly packed accessor of its own view; `extra` is merged into it.
  template <class T>
  int add_accessor(const std::vector<T>& values, const char* type, json extra = json::object()) {
    static const std::map<std::string, int> kComponents = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    json accessor = {{"bufferView", add_view(values.data(), values.size() * sizeof(T))},
                     {"componentType", component_type_of<T>()},
                     {"count", values.size() / std::size_t(kComponents.at(type))},
                     {"type", type}};
    accessor.update(extra);
    root["accessors"].push_back(accessor);
    return int(root["accessors"].size()) - 1;
  }

  // A POSITION accessor; its bounds, which glTF wants, are loose.
  int add_positions(const std::vector<float>& values) {
    return add_accessor(values, "VEC3", {{"min", {-1e9, -1e9, -1e9}}, {"max", {1e9, 1e9, 1e9}}});
  }

  // A mesh of one primitive, under a new root node of scene 0. Returns the node's index.
  int add_mesh(json primitive) {
    root["meshes"].push_back({{"primitives", json::array({std::move(primitive)})}});
    return add_node({{"mesh", root["meshes"].size() - 1}});
  }
  int add_node(json node) {
    root["nodes"].push_back(std::move(node));
    root["scenes"][0]["nodes"].push_back(root["nodes"].size() - 1);
    return int(root["nodes"].size()) - 1;
  }
  // (0 0 0) (1 0 0) (0 1 0)
  int add_triangle() { return add_mesh({{"attributes", {{"POSITION", add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0})}}}}); }

  void use(const char* extension, bool required = false) {
    root["extensionsUsed"].push_back(extension);
    if (required) root["extensionsRequired"].push_back(extension);
  }

  std::vector<std::uint8_t> glb() const {
    json final = root;
    if (!buffer_.empty() && !final.contains("buffers")) final["buffers"] = json::array();
    if (!buffer_.empty()) final["buffers"].insert(final["buffers"].begin(), json{{"byteLength", buffer_.size()}});
    std::string text = final.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::vector<std::uint8_t> bin = buffer_;
    bin.resize((bin.size() + 3) / 4 * 4);
    std::vector<std::uint8_t> out;
    const auto u32 = [&](std::size_t v) {
      for (int i = 0; i < 4; ++i) out.push_back(std::uint8_t(v >> (8 * i)));
    };
    u32(0x46546c67), u32(2), u32(20 + text.size() + (bin.empty() ? 0 : 8 + bin.size()));
    u32(text.size()), u32(0x4e4f534a);
    out.insert(out.end(), text.begin(), text.end());
    if (!bin.empty()) {
      u32(bin.size()), u32(0x004e4942);
      out.insert(out.end(), bin.begin(), bin.end());
    }
    return out;
  }

  // Loads it as "test.glb", beside `others`.
  Result<SceneDescription> load(const SceneLoadOptions& options = {}, std::vector<NamedFile> others = {}) const {
    others.push_back({"test.glb", glb()});
    return load_scene(*make_memory_source(std::move(others)), "test.glb", options);
  }
  SceneDescription must_load(const SceneLoadOptions& options = {}) const {
    Result<SceneDescription> scene = load(options);
    EXPECT_TRUE(scene.ok()) << scene.error().to_string();
    return scene.ok() ? std::move(*scene) : SceneDescription{};
  }
  // The error's line; fails the test when the file loads.
  std::string must_fail(const SceneLoadOptions& options = {}) const {
    const Result<SceneDescription> scene = load(options);
    EXPECT_FALSE(scene.ok()) << "loads, but should not";
    return scene.ok() ? "" : scene.error().to_string();
  }

  json root;

 private:
  std::vector<std::uint8_t> buffer_;
};

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
inline bool contains(const std::vector<std::string>& lines, const std::string& part) {
  for (const std::string& line : lines)
    if (contains(line, part)) return true;
  return false;
}

}  // namespace helio::test
