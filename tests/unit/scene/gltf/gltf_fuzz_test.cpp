// Damaged files: every byte may be anything, and the loader answers with a scene or with an error. The sanitizer build
// of this test is what makes it strict.
#include <meshoptimizer.h>

#include <random>

#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

// One file with a bit of everything that is parsed from bytes.
std::vector<std::uint8_t> rich_file() {
  GltfBuilder file;
  for (const char* name : {"KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_materials_volume"}) file.use(name);
  file.use("EXT_meshopt_compression", true);
  file.add_triangle();
  json& primitive = file.root["meshes"][0]["primitives"][0];
  json& attributes = primitive["attributes"];
  attributes["NORMAL"] = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  attributes["TEXCOORD_0"] =
      file.add_accessor<std::uint16_t>({0, 0, 65535, 0, 0, 65535}, "VEC2", {{"normalized", true}});
  attributes["JOINTS_0"] = file.add_accessor<std::uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}, "VEC4");
  attributes["WEIGHTS_0"] = file.add_accessor<float>({1, 0, 0, 0, .5f, .5f, 0, 0, 1, 0, 0, 0}, "VEC4");
  primitive["indices"] = file.add_accessor<std::uint8_t>({0, 1, 2, 0}, "SCALAR");
  primitive["mode"] = 5;
  primitive["targets"] = {{{"POSITION", file.add_positions({0, 0, 1, 0, 0, 1, 0, 0, 1})}}};
  primitive["material"] = 0;
  const std::uint8_t at[1] = {1};
  const float to[3] = {2, 0, 0};
  file.root["accessors"][0]["sparse"] = {{"count", 1},
                                         {"indices", {{"bufferView", file.add_view(at, 1)}, {"componentType", 5121}}},
                                         {"values", {{"bufferView", file.add_view(to, 12)}}}};
  file.root["materials"] = json::parse(R"([{"extensions": {"KHR_materials_volume": {"thicknessFactor": 1}},
    "extras": {"heliograph": {"conductor": {"eta": [1, 1, 1], "k": [1, 1, 1]}}}}])");
  file.root["meshes"][0]["weights"] = {0.5};
  file.root["skins"] = {{{"joints", {1, 2}}}};
  file.root["nodes"][0]["skin"] = 0;
  file.add_node({{"children", {2}}});
  file.root["nodes"].push_back({{"translation", {0, 2, 0}}, {"mesh", 1}});
  file.root["meshes"].push_back({{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}});
  file.root["nodes"][2]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      file.add_accessor<float>({1, 0, 0, 2, 0, 0}, "VEC3");
  file.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}, {"spot", json::object()}}};
  file.add_node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  const int input = file.add_accessor<float>({0, 1}, "SCALAR", {{"min", {0}}, {"max", {1}}});
  const int output = file.add_accessor<float>(std::vector<float>(18, 1.0f), "VEC3");
  file.root["animations"] = {{{"samplers", {{{"input", input}, {"output", output}, {"interpolation", "CUBICSPLINE"}}}},
                              {"channels", {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}}}}}};
  // A compressed copy of the plain mesh's positions.
  const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(3, 12));
  bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), positions, 3, 12));
  const int compressed = file.add_view(bytes.data(), bytes.size());
  const json place = file.root["bufferViews"][compressed];
  file.root["bufferViews"].push_back({{"buffer", 0},
                                      {"byteLength", 36},
                                      {"byteStride", 12},
                                      {"extensions",
                                       {{"EXT_meshopt_compression",
                                         {{"buffer", 0},
                                          {"byteOffset", place["byteOffset"]},
                                          {"byteLength", bytes.size()},
                                          {"byteStride", 12},
                                          {"count", 3},
                                          {"mode", "ATTRIBUTES"}}}}}});
  file.root["accessors"].push_back({{"bufferView", compressed + 1},
                                    {"componentType", 5126},
                                    {"count", 3},
                                    {"type", "VEC3"},
                                    {"min", {0, 0, 0}},
                                    {"max", {1, 1, 0}}});
  file.add_mesh({{"attributes", {{"POSITION", file.root["accessors"].size() - 1}}}});
  return file.glb();
}

Result<SceneDescription> load(std::vector<std::uint8_t> bytes) {
  SceneLoadOptions options;
  options.time_s = 0.5;
  options.max_memory_bytes = 64 << 20;
  return load_scene(*make_memory_source({{"fuzz.glb", std::move(bytes)}}), "fuzz.glb", options);
}

void expect_answer(const Result<SceneDescription>& scene, std::uint32_t seed) {
  if (scene.ok()) {
    for (const Object& object : scene->objects)
      for (const TriangleMesh& mesh : object.meshes)
        for (const std::uint32_t index : mesh.indices) ASSERT_LT(index, mesh.positions.size()) << "seed " << seed;
  } else {
    ASSERT_FALSE(scene.error().message.empty()) << "seed " << seed;
    ASSERT_TRUE(scene.error().where.starts_with("fuzz.glb")) << "seed " << seed << ": " << scene.error().to_string();
  }
}

TEST(GltfFuzz, FlippedBytes) {
  const std::vector<std::uint8_t> good = rich_file();
  {
    const auto scene = load(good);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
  }
  int loaded = 0;
  for (std::uint32_t seed = 0; seed < 4000; ++seed) {
    std::mt19937 random(seed);
    std::vector<std::uint8_t> bytes = good;
    for (std::uint32_t n = 1 + random() % 4; n > 0; --n) {
      // Digits of the JSON are where counts and indices are: half of the flips make other digits of them.
      const std::size_t at = 12 + random() % (bytes.size() - 12);
      const bool digit = bytes[at] >= '0' && bytes[at] <= '9';
      bytes[at] = digit ? std::uint8_t('0' + random() % 10) : std::uint8_t(random());
    }
    const auto scene = load(std::move(bytes));
    loaded += scene.ok();
    expect_answer(scene, seed);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(loaded, 100);  // else the damage is all of one kind and tests little
  EXPECT_LT(loaded, 3900);
}

TEST(GltfFuzz, Truncations) {
  const std::vector<std::uint8_t> good = rich_file();
  for (std::size_t size = 0; size < good.size(); size += 7) {
    std::vector<std::uint8_t> bytes(good.begin(), good.begin() + std::ptrdiff_t(size));
    // A second time with headers that agree with the size, so that the JSON itself is what ends early.
    for (const bool patched : {false, true}) {
      if (patched && size < 24) continue;
      if (patched) {
        const std::size_t whole = size / 4 * 4;
        bytes.resize(whole);
        for (std::size_t i = 0; i < 4; ++i) {
          bytes[8 + i] = std::uint8_t(whole >> (8 * i));
          bytes[12 + i] = std::uint8_t((whole - 20) >> (8 * i));
        }
      }
      const auto scene = load(bytes);
      EXPECT_FALSE(scene.ok()) << size;
      expect_answer(scene, std::uint32_t(size));
    }
  }
}

// Whole values of the JSON replaced by ones of another type or size.
TEST(GltfFuzz, ReplacedValues) {
  const std::vector<std::uint8_t> good = rich_file();
  const std::size_t json_size = good[12] | good[13] << 8 | good[14] << 16;
  const json root = json::parse(good.begin() + 20, good.begin() + 20 + std::ptrdiff_t(json_size));
  const json flat = root.flatten();
  const json values[] = {-1,    0,      1,       2.5,  4294967295.0,  1e18,
                         1e300, "text", nullptr, true, json::array(), json::object()};
  std::uint32_t count = 0;
  for (const auto& [pointer, old] : flat.items()) {
    for (const json& value : values) {
      json edited = root;
      edited[json::json_pointer(pointer)] = value;
      std::string text = edited.dump();
      text.resize((text.size() + 3) / 4 * 4, ' ');
      std::vector<std::uint8_t> bytes(good.begin(), good.begin() + 20);
      bytes.insert(bytes.end(), text.begin(), text.end());
      bytes.insert(bytes.end(), good.begin() + 20 + std::ptrdiff_t(json_size), good.end());
      for (std::size_t i = 0; i < 4; ++i) {
        bytes[8 + i] = std::uint8_t(bytes.size() >> (8 * i));
        bytes[12 + i] = std::uint8_t(text.size() >> (8 * i));
      }
      expect_answer(load(std::move(bytes)), ++count);
      if (HasFatalFailure()) FAIL() << pointer << " = " << value.dump();
    }
  }
  EXPECT_GT(count, 1000u);
}

}  // namespace
}  // namespace helio::test
