// Primitives: topologies, indices, colours, directions, morph targets, compression.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include "renderer/scene/gltf/topology.h"
#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

using Indices = std::vector<std::uint32_t>;

// Five points of a zigzag, drawn with the mode, indexed or not.
TriangleMesh load_mode(int mode, const std::vector<std::uint8_t>& indices = {}) {
  GltfBuilder file;
  json primitive = {{"attributes", {{"POSITION", file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0})}}},
                    {"mode", mode}};
  if (!indices.empty()) primitive["indices"] = file.add_accessor(indices, "SCALAR");
  file.add_mesh(primitive);
  const SceneDescription scene = file.must_load();
  if (scene.objects.empty()) {
    EXPECT_TRUE(scene.instances.empty());
    EXPECT_FALSE(scene.report.warnings.empty());
    return {};
  }
  return scene.objects[0].meshes[0];
}

TEST(GltfGeometry, Topologies) {
  for (const int mode : {0, 1, 2, 3}) EXPECT_TRUE(load_mode(mode).indices.empty()) << mode;
  // Five vertices: one triangle and two left over; three of a strip, every other turned; three of a fan around the
  // first.
  EXPECT_EQ(load_mode(4).indices, (Indices{0, 1, 2}));
  EXPECT_EQ(load_mode(5).indices, (Indices{0, 1, 2, 1, 3, 2, 2, 3, 4}));
  EXPECT_EQ(load_mode(6).indices, (Indices{1, 2, 0, 2, 3, 0, 3, 4, 0}));
  EXPECT_EQ(load_mode(4, {4, 3, 2, 2, 1, 0}).indices, (Indices{4, 3, 2, 2, 1, 0}));
  EXPECT_EQ(load_mode(5, {4, 3, 2, 1}).indices, (Indices{4, 3, 2, 3, 1, 2}));
  EXPECT_EQ(load_mode(6, {4, 3, 2, 1}).indices, (Indices{3, 2, 4, 2, 1, 4}));
  // 0 1 2 2 3 4: the two middle triangles repeat an index; they only join (0 1 2) to (2 3 4), the fourth, turned.
  EXPECT_EQ(load_mode(5, {0, 1, 2, 2, 3, 4}).indices, (Indices{0, 1, 2, 2, 4, 3}));
}

TEST(GltfGeometry, AStripKeepsItsOrientation) {
  // All triangles of the zigzag face +z: (b - a) x (c - a) has a positive z.
  const TriangleMesh mesh = load_mode(5);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const V3f a = mesh.positions[mesh.indices[i]], b = mesh.positions[mesh.indices[i + 1]],
              c = mesh.positions[mesh.indices[i + 2]];
    EXPECT_GT(cross(b - a, c - a).z, 0) << i;
  }
}

TEST(GltfGeometry, IndicesAreChecked) {
  const auto fail = [](std::vector<std::uint16_t> indices) {
    GltfBuilder file;
    file.add_triangle();
    file.root["meshes"][0]["primitives"][0]["indices"] = file.add_accessor(indices, "SCALAR");
    return file.must_fail();
  };
  EXPECT_TRUE(contains(fail({0, 1, 3}), "indices: index 2 is 3, but the primitive has 3 vertices"));
  EXPECT_TRUE(contains(fail({0, 65535, 2}), "index 1 is the primitive restart value 65535"));
}

TEST(GltfGeometry, ColorsOfThreeAndFourComponents) {
  GltfBuilder file;
  file.add_triangle();
  // Normalised bytes; rows of three are padded to four.
  const std::uint8_t rgb[12] = {255, 0, 51, 0, 0, 255, 102, 0, 0, 0, 153, 0};
  const int view = file.add_view(rgb, 12);
  file.root["bufferViews"][view]["byteStride"] = 4;
  file.root["accessors"].push_back(
      {{"bufferView", view}, {"componentType", 5121}, {"normalized", true}, {"count", 3}, {"type", "VEC3"}});
  file.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 1;
  EXPECT_EQ(file.must_load().objects.at(0).meshes.at(0).colors,
            (std::vector<V4f>{{1, 0, .2f, 1}, {0, 1, .4f, 1}, {0, 0, .6f, 1}}));
  // Floats outside [0, 1] are clamped.
  file.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      file.add_accessor<float>({2, -1, .5f, .25f, 0, 0, 0, 3, 1, 1, 1, 1}, "VEC4");
  EXPECT_EQ(file.must_load().objects.at(0).meshes.at(0).colors[0], V4f(1, 0, .5f, .25f));
}

TEST(GltfGeometry, NormalsAndTangentsAreUnit) {
  GltfBuilder file;
  file.add_triangle();
  json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
  attributes["NORMAL"] = file.add_accessor<float>({0, 3, 0, 0, 0, 0, 3, 0, 4}, "VEC3");
  attributes["TANGENT"] = file.add_accessor<float>({2, 0, 0, -1, 0, 1, 0, 1, 0, 0, -5, 1}, "VEC4");
  const SceneDescription scene = file.must_load();
  const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
  // The second has no length: it is that of its triangle, +z.
  EXPECT_EQ(mesh.normals[0], V3f(0, 1, 0));
  EXPECT_EQ(mesh.normals[1], V3f(0, 0, 1));
  EXPECT_LT(length(mesh.normals[2] - V3f(.6f, 0, .8f)), 1e-6);
  EXPECT_EQ(mesh.tangents[0], V4f(1, 0, 0, -1));
  EXPECT_EQ(mesh.tangents[2], V4f(0, 0, -1, 1));
  EXPECT_TRUE(contains(scene.report.warnings, "1 normals of length zero"));
}

TEST(GltfGeometry, MorphTargets) {
  GltfBuilder file;
  file.add_triangle();
  json& primitive = file.root["meshes"][0]["primitives"][0];
  primitive["attributes"]["NORMAL"] = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  primitive["targets"] = {{{"POSITION", file.add_positions({0, 0, 1, 0, 0, 1, 0, 0, 1})}},
                          {{"POSITION", file.add_positions({2, 0, 0, 0, 0, 0, 0, 0, 0})},
                           {"NORMAL", file.add_accessor<float>({1, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3")}}};
  EXPECT_EQ(file.must_load().objects.at(0).meshes.at(0).positions[0], V3f(0, 0, 0));  // weights default to 0
  file.root["meshes"][0]["weights"] = {0.5, 0.25};
  const SceneDescription scene = file.must_load();
  const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
  // (0 0 0) + .5 (0 0 1) + .25 (2 0 0); the normal is (.25 0 1) made unit: length sqrt(17) / 4.
  EXPECT_EQ(mesh.positions[0], V3f(.5f, 0, .5f));
  EXPECT_EQ(mesh.positions[1], V3f(1, 0, .5f));
  EXPECT_LT(length(mesh.normals[0] - V3f(1, 0, 4) / std::sqrt(17.0f)), 1e-6);
  // The node's weights replace the mesh's; nodes of one shape share an object, another shape gets its own.
  file.add_node({{"mesh", 0}});
  file.add_node({{"mesh", 0}, {"weights", {1, 0}}});
  const SceneDescription three = file.must_load();
  ASSERT_EQ(three.instances.size(), 3u);
  ASSERT_EQ(three.objects.size(), 2u);
  EXPECT_EQ(three.instances[0].object, three.instances[1].object);
  EXPECT_EQ(three.objects[std::size_t(three.instances[2].object)].meshes[0].positions[0], V3f(0, 0, 1));
}

TEST(GltfGeometry, QuantizedPositions) {
  GltfBuilder file;
  file.use("KHR_mesh_quantization", true);
  const std::int16_t data[12] = {0, 0, 0, 0, 100, 0, 0, 0, 0, -200, 0, 0};
  const int view = file.add_view(data, sizeof data);
  file.root["bufferViews"][view]["byteStride"] = 8;
  file.root["accessors"].push_back({{"bufferView", view},
                                    {"componentType", 5122},
                                    {"count", 3},
                                    {"type", "VEC3"},
                                    {"min", {0, -200, 0}},
                                    {"max", {100, 0, 0}}});
  file.add_mesh({{"attributes", {{"POSITION", 0}}}});
  EXPECT_EQ(file.must_load().objects.at(0).meshes.at(0).positions,
            (std::vector<V3f>{{0, 0, 0}, {100, 0, 0}, {0, -200, 0}}));
}

// ---- EXT_meshopt_compression ---------------------------------------------------------------------------------------

void compress_view(GltfBuilder& file, int view, const std::vector<unsigned char>& bytes, json description) {
  // The plain bytes are not there: the view points into a fallback buffer without data.
  const int compressed = file.add_view(bytes.data(), bytes.size());
  const json place = file.root["bufferViews"][compressed];
  description.update({{"buffer", 0}, {"byteOffset", place["byteOffset"]}, {"byteLength", bytes.size()}});
  json& target = file.root["bufferViews"][view];
  target["buffer"] = 1;
  target["extensions"]["EXT_meshopt_compression"] = std::move(description);
  if (!file.root.contains("buffers"))
    file.root["buffers"].push_back(
        {{"byteLength", 1 << 20}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
}

TEST(GltfGeometry, Meshopt) {
  GltfBuilder file;
  file.use("EXT_meshopt_compression", true);
  const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const std::vector<std::uint32_t> indices = {0, 1, 2, 2, 1, 3};
  json primitive = {{"attributes", {{"POSITION", file.add_positions(positions)}}},
                    {"indices", file.add_accessor(indices, "SCALAR")}};
  std::vector<unsigned char> vertex_bytes(meshopt_encodeVertexBufferBound(4, 12));
  vertex_bytes.resize(meshopt_encodeVertexBuffer(vertex_bytes.data(), vertex_bytes.size(), positions.data(), 4, 12));
  std::vector<unsigned char> index_bytes(meshopt_encodeIndexBufferBound(6, 4));
  index_bytes.resize(meshopt_encodeIndexBuffer(index_bytes.data(), index_bytes.size(), indices.data(), 6));
  compress_view(file, 0, vertex_bytes, {{"byteStride", 12}, {"count", 4}, {"mode", "ATTRIBUTES"}});
  compress_view(file, 1, index_bytes, {{"byteStride", 4}, {"count", 6}, {"mode", "TRIANGLES"}});
  file.add_mesh(primitive);
  const SceneDescription scene = file.must_load();
  const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
  EXPECT_EQ(mesh.positions[3], V3f(1, 1, 0));
  ASSERT_EQ(mesh.indices.size(), 6u);
  // The codec may rotate a triangle's corners, never turn it: each still faces +z.
  for (int t = 0; t < 2; ++t) {
    const std::uint32_t* c = &mesh.indices[std::size_t(3 * t)];
    EXPECT_GT(cross(mesh.positions[c[1]] - mesh.positions[c[0]], mesh.positions[c[2]] - mesh.positions[c[0]]).z, 0);
  }

  // Every truncation and a count that the view does not have are refused.
  json& meshopt = file.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"];
  for (std::size_t size = 1; size < vertex_bytes.size(); ++size) {
    meshopt["byteLength"] = size;
    EXPECT_TRUE(contains(file.must_fail(), "EXT_meshopt_compression")) << size;
  }
  meshopt["byteLength"] = vertex_bytes.size();
  meshopt["count"] = 5;
  EXPECT_TRUE(contains(file.must_fail(), "is not the view's byteLength 48"));
}

TEST(GltfGeometry, MeshoptFilters) {
  // Octahedral: (0 0 1) and (1 0 0) as signed bytes (x y one w); one is 127. Exponential: 2^e * m, e in the high byte.
  GltfBuilder file;
  file.use("EXT_meshopt_compression", true);
  file.use("KHR_mesh_quantization", true);
  const std::int8_t octahedral[12] = {0, 0, 127, 0, 127, 0, 127, 0, 0, 127, 127, 0};
  const auto exponential = [](int e, int m) { return std::uint32_t(e) << 24 | (std::uint32_t(m) & 0xffffff); };
  // 3 * 2^0, 5 * 2^-1 = 2.5, -1 * 2^2 = -4, then zeros.
  const std::uint32_t positions[9] = {exponential(0, 3), exponential(255, 5), exponential(2, -1), 0, 0, 0, 0, 0, 0};

  const int position = file.add_positions(std::vector<float>(9));
  const int normal_view = file.add_view(octahedral, 12);
  file.root["bufferViews"][normal_view]["byteStride"] = 4;
  file.root["accessors"].push_back(
      {{"bufferView", normal_view}, {"componentType", 5120}, {"normalized", true}, {"count", 3}, {"type", "VEC3"}});
  std::vector<unsigned char> position_bytes(meshopt_encodeVertexBufferBound(3, 12));
  position_bytes.resize(meshopt_encodeVertexBuffer(position_bytes.data(), position_bytes.size(), positions, 3, 12));
  std::vector<unsigned char> normal_bytes(meshopt_encodeVertexBufferBound(3, 4));
  normal_bytes.resize(meshopt_encodeVertexBuffer(normal_bytes.data(), normal_bytes.size(), octahedral, 3, 4));
  compress_view(file, 0, position_bytes,
                {{"byteStride", 12}, {"count", 3}, {"mode", "ATTRIBUTES"}, {"filter", "EXPONENTIAL"}});
  compress_view(file, normal_view, normal_bytes,
                {{"byteStride", 4}, {"count", 3}, {"mode", "ATTRIBUTES"}, {"filter", "OCTAHEDRAL"}});
  file.add_mesh({{"attributes", {{"POSITION", position}, {"NORMAL", 1}}}});
  const SceneDescription scene = file.must_load();
  const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
  EXPECT_EQ(mesh.positions[0], V3f(3, 2.5f, -4));
  EXPECT_LT(length(mesh.normals[0] - V3f(0, 0, 1)), 0.01);
  EXPECT_LT(length(mesh.normals[1] - V3f(1, 0, 0)), 0.01);
  EXPECT_LT(length(mesh.normals[2] - V3f(0, 1, 0)), 0.01);
}

// ---- KHR_draco_mesh_compression ------------------------------------------------------------------------------------

// A quad of two triangles with texture coordinates, encoded by the method.
std::vector<char> encode_draco(int method) {
  const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const float uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const int faces[2][3] = {{0, 1, 2}, {0, 2, 3}};
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int uv = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  for (int f = 0; f < 2; ++f) {
    const int* c = faces[f];
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(f), corners[c[0]], corners[c[1]], corners[c[2]]);
    builder.SetAttributeValuesForFace(uv, draco::FaceIndex(f), uvs[c[0]], uvs[c[1]], uvs[c[2]]);
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {buffer.data(), buffer.data() + buffer.size()};
}

GltfBuilder draco_file(const std::vector<char>& bytes) {
  GltfBuilder file;
  file.use("KHR_draco_mesh_compression", true);
  const int view = file.add_view(bytes.data(), bytes.size());
  file.root["accessors"] = json::parse(R"([
    {"componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
    {"componentType": 5126, "count": 4, "type": "VEC2"}, {"componentType": 5123, "count": 6, "type": "SCALAR"}])");
  file.add_mesh({{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}},
                 {"indices", 2},
                 {"extensions",
                  {{"KHR_draco_mesh_compression",
                    {{"bufferView", view}, {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}}}}}});
  return file;
}

TEST(GltfGeometry, Draco) {
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const SceneDescription scene = draco_file(encode_draco(method)).must_load();
    const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
    ASSERT_EQ(mesh.positions.size(), 4u);
    ASSERT_EQ(mesh.triangle_count(), 2u);
    double area = 0;
    for (std::size_t i = 0; i < 6; i += 3) {
      const V3f& a = mesh.positions[mesh.indices[i]];
      area += 0.5 * cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a).z;
    }
    EXPECT_NEAR(area, 1, 1e-5);          // the unit square, facing +z
    for (std::size_t v = 0; v < 4; ++v)  // here each coordinate is its position
      EXPECT_LT((mesh.texcoords[0][v] - V2f(mesh.positions[v].x, mesh.positions[v].y)).length(), 1e-5);
  }
}

TEST(GltfGeometry, BrokenDracoIsRefused) {
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const std::vector<char> good = encode_draco(method);
    for (std::size_t size = 1; size < good.size(); ++size) {
      const auto scene = draco_file({good.begin(), good.begin() + std::ptrdiff_t(size)}).load();
      ASSERT_FALSE(scene.ok()) << size;
    }
    // The counts follow the 11-byte header (edgebreaker: and one byte); 2^34 faces are refused before decoding.
    std::vector<char> huge = good;
    const std::size_t at = method == draco::MESH_SEQUENTIAL_ENCODING ? 11 : 13;
    huge.erase(huge.begin() + std::ptrdiff_t(at));
    huge.insert(huge.begin() + std::ptrdiff_t(at), {'\xff', '\xff', '\xff', '\xff', '\x3f'});
    const auto scene = draco_file(huge).load();
    ASSERT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().code, ErrorCode::resource_exhausted) << scene.error().to_string();
  }
  GltfBuilder wrong = draco_file(encode_draco(draco::MESH_SEQUENTIAL_ENCODING));
  wrong.root["accessors"][0]["count"] = 5;
  wrong.root["accessors"][1]["count"] = 5;
  EXPECT_TRUE(contains(wrong.must_fail(), "has 4 vertices, the accessors say 5"));
}

}  // namespace
}  // namespace helio::test
