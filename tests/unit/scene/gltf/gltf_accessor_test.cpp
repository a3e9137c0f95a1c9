// Accessors: types, normalisation, interleaving, sparse patches, and counts that nothing backs.
#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

// Loads a triangle whose TEXCOORD_0 is the accessor, and returns the coordinates.
template <class T>
std::vector<V2f> load_texcoords(const std::vector<T>& values, bool normalized, bool quantized) {
  GltfBuilder file;
  if (quantized) file.use("KHR_mesh_quantization", true);
  file.add_triangle();
  const int accessor = file.add_accessor(values, "VEC2", normalized ? json{{"normalized", true}} : json::object());
  // Rows of two bytes are padded to four in a vertex buffer; the stride is then explicit.
  if (sizeof(T) == 1) {
    std::vector<T> padded;
    for (std::size_t i = 0; i < values.size(); i += 2) padded.insert(padded.end(), {values[i], values[i + 1], 0, 0});
    const int view = file.add_view(padded.data(), padded.size());
    file.root["bufferViews"][view]["byteStride"] = 4;
    file.root["accessors"][accessor]["bufferView"] = view;
  }
  file.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = accessor;
  const SceneDescription scene = file.must_load();
  return scene.objects.empty() ? std::vector<V2f>{} : scene.objects[0].meshes[0].texcoords[0];
}

TEST(GltfAccessor, ComponentTypes) {
  // glTF 2.0, 3.11: unsigned c / max, signed max(c / max, -1).
  EXPECT_EQ(load_texcoords<float>({0, .25f, .5f, .75f, 1, 2}, false, false),
            (std::vector<V2f>{{0, .25f}, {.5f, .75f}, {1, 2}}));
  EXPECT_EQ(load_texcoords<std::uint8_t>({0, 255, 51, 102, 153, 204}, true, false),
            (std::vector<V2f>{{0, 1}, {51 / 255.0f, 102 / 255.0f}, {153 / 255.0f, 204 / 255.0f}}));
  EXPECT_EQ(load_texcoords<std::uint16_t>({0, 65535, 1, 2, 3, 4}, true, false),
            (std::vector<V2f>{{0, 1}, {1 / 65535.0f, 2 / 65535.0f}, {3 / 65535.0f, 4 / 65535.0f}}));
  EXPECT_EQ(load_texcoords<std::int8_t>({0, 127, -127, -128, 1, -1}, true, true),
            (std::vector<V2f>{{0, 1}, {-1, -1}, {1 / 127.0f, -1 / 127.0f}}));
  EXPECT_EQ(load_texcoords<std::int16_t>({0, 32767, -32767, -32768, 1, -1}, true, true),
            (std::vector<V2f>{{0, 1}, {-1, -1}, {1 / 32767.0f, -1 / 32767.0f}}));
  EXPECT_EQ(load_texcoords<std::uint16_t>({0, 65535, 1, 2, 3, 4}, false, true),
            (std::vector<V2f>{{0, 65535}, {1, 2}, {3, 4}}));
  EXPECT_EQ(load_texcoords<std::int8_t>({-128, 127, 1, 2, 3, 4}, false, true),
            (std::vector<V2f>{{-128, 127}, {1, 2}, {3, 4}}));
}

TEST(GltfAccessor, QuantizedFormatsNeedTheirExtension) {
  GltfBuilder file;
  file.add_triangle();
  file.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
      file.add_accessor<std::int16_t>(std::vector<std::int16_t>(9, 1), "VEC3", {{"normalized", true}});
  EXPECT_TRUE(contains(file.must_fail(), "attributes/NORMAL: names an accessor of VEC3 of normalized SHORT"));
}

TEST(GltfAccessor, Interleaved) {
  // Position and colour side by side: stride 28, colours from byte 12.
  const std::vector<float> data = {0, 0, 0, .1f, .2f, .3f, .4f, 1, 0, 0, .5f, .6f, .7f, .8f, 0, 1, 0, .9f, 1, 0, 1};
  GltfBuilder file;
  const int view = file.add_view(data.data(), data.size() * 4);
  file.root["bufferViews"][view]["byteStride"] = 28;
  file.root["accessors"] = json::parse(R"([
    {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
    {"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 3, "type": "VEC4"}])");
  file.add_mesh({{"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}}});
  const SceneDescription scene = file.must_load();
  const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
  EXPECT_EQ(mesh.positions, (std::vector<V3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.colors, (std::vector<V4f>{{.1f, .2f, .3f, .4f}, {.5f, .6f, .7f, .8f}, {.9f, 1, 0, 1}}));
}

TEST(GltfAccessor, SparseOverDataAndOverZeros) {
  for (const bool over_zeros : {false, true}) {
    GltfBuilder file;
    file.add_triangle();
    json& accessor = file.root["accessors"][0];
    if (over_zeros) accessor.erase("bufferView");
    const std::uint8_t indices[2] = {0, 2};
    const float values[6] = {7, 8, 9, 4, 5, 6};
    accessor["sparse"] = {{"count", 2},
                          {"indices", {{"bufferView", file.add_view(indices, 2)}, {"componentType", 5121}}},
                          {"values", {{"bufferView", file.add_view(values, 24)}}}};
    const SceneDescription scene = file.must_load();
    EXPECT_EQ(scene.objects.at(0).meshes.at(0).positions,
              (std::vector<V3f>{{7, 8, 9}, over_zeros ? V3f(0, 0, 0) : V3f(1, 0, 0), {4, 5, 6}}));
  }
}

TEST(GltfAccessor, SparseIndicesMustAscendAndStayInside) {
  for (const std::array<std::uint8_t, 2> indices : {std::array<std::uint8_t, 2>{1, 1}, {2, 1}, {1, 3}}) {
    GltfBuilder file;
    file.add_triangle();
    const float values[6] = {};
    file.root["accessors"][0]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", file.add_view(indices.data(), 2)}, {"componentType", 5121}}},
        {"values", {{"bufferView", file.add_view(values, 24)}}}};
    EXPECT_TRUE(contains(file.must_fail(), "/accessors/0/sparse/indices: index 1 is")) << file.must_fail();
  }
}

TEST(GltfAccessor, DataIsHeldAgainstItsDescription) {
  const auto edited = [](const char* key, json value) {
    GltfBuilder file;
    file.add_triangle();
    file.root["accessors"][0][key] = std::move(value);
    return file.must_fail();
  };
  // Three elements of 12 bytes in 36 bytes: a fourth, or an offset, leaves the view.
  EXPECT_TRUE(contains(edited("count", 4), "/accessors/0: 4 elements need 48 bytes from byte 0 of a view of 36"));
  EXPECT_TRUE(contains(edited("byteOffset", 4), "from byte 4 of a view of 36"));
  EXPECT_TRUE(contains(edited("byteOffset", 2), "from byte 2 of a view of 36"));
  EXPECT_TRUE(contains(edited("bufferView", 1), "but there are 1 bufferViews"));
  EXPECT_TRUE(contains(edited("componentType", 5124), "/accessors/0/componentType: is 5124"));
  EXPECT_TRUE(contains(edited("type", "VEC5"), "/accessors/0/type: is \"VEC5\""));
  EXPECT_TRUE(contains(edited("count", 9007199254740993.0), "/accessors/0/count"));
  EXPECT_TRUE(contains(edited("min", {0, 0}), "/accessors/0/min: has 2 elements, allowed: 3"));

  GltfBuilder nan;
  nan.add_mesh({{"attributes", {{"POSITION", nan.add_positions({0, 0, 0, 1, std::nanf(""), 0, 0, 1, 0})}}}});
  EXPECT_TRUE(contains(nan.must_fail(), "/accessors/0: element 1 is not finite"));

  GltfBuilder bounds;  // an integer outside its own bounds
  bounds.add_triangle();
  bounds.root["meshes"][0]["primitives"][0]["indices"] =
      bounds.add_accessor<std::uint8_t>({0, 1, 2}, "SCALAR", {{"max", {1}}, {"min", {0}}});
  EXPECT_TRUE(contains(bounds.must_fail(), "/accessors/1/max/0: is 1, but the data goes up to 2"));
}

TEST(GltfAccessor, CountsWithoutBytesAreHeldToTheMemoryLimit) {
  // No bufferView: all zero, and 4e9 elements of 12 bytes would be 48 GB.
  GltfBuilder file;
  file.add_triangle();
  file.root["accessors"][0].erase("bufferView");
  file.root["accessors"][0]["count"] = 4000000000u;
  const auto scene = file.load();
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(scene.error().where.ends_with("/accessors/0")) << scene.error().where;
  EXPECT_TRUE(contains(scene.error().message, "needs 48000000000 bytes")) << scene.error().message;
}

TEST(GltfAccessor, ReadingTheSameBytesOverAndOverIsRefused) {
  // 10,000 accessors over the same 1.2 MB would be 12 GB to look at; a file of some 2 MB may have 4 x (256 + 2 x 256).
  GltfBuilder file;
  file.add_mesh({{"attributes", {{"POSITION", file.add_positions(std::vector<float>(300000))}}}});
  for (int i = 0; i < 10000; ++i) file.root["accessors"].push_back(file.root["accessors"][0]);
  const auto scene = file.load();
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(contains(scene.error().message, "out of proportion")) << scene.error().message;
}

TEST(GltfAccessor, TheConfiguredMaximumIsObeyed) {
  // 300,000 vertices are 3.6 MB in the file and as much again in the scene; indices add 1.2 MB.
  GltfBuilder file;
  file.add_mesh({{"attributes", {{"POSITION", file.add_positions(std::vector<float>(900000, 1.0f))}}}});
  SceneLoadOptions options;
  options.max_memory_bytes = 10 << 20;
  EXPECT_TRUE(file.load(options).ok());
  options.max_memory_bytes = 6 << 20;
  const auto scene = file.load(options);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(contains(scene.error().message, "limit max_memory_bytes")) << scene.error().message;
  options.max_memory_bytes = 1 << 20;
  EXPECT_EQ(file.load(options).error().code, ErrorCode::resource_exhausted);
}

}  // namespace
}  // namespace helio::test
