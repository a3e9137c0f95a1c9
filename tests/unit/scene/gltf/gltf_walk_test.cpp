// Every glTF beside the repository loads, or is refused for the reason that this table gives; instances and triangles
// of some are counted by hand from their JSON.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "renderer/scene/load/scene_loader.h"
#include "tests/support/shared_data.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

struct Refusal {
  const char* file;  // how the path ends
  ErrorCode code;
  const char* where;    // how Error::where ends
  const char* message;  // part of it
};

constexpr Refusal kRefused[] = {
    {"BoxTextured-glTF-techniqueWebGL/BoxTextured.gltf", ErrorCode::unimplemented, "/extensionsRequired/0",
     "KHR_technique_webgl"},
    {"BoxWithInfinites.glb", ErrorCode::invalid_argument, "/accessors/2", "not finite"},
    // Three of its views lie behind the end of its buffer.
    {"IncorrectVertexArrays/Cube.gltf", ErrorCode::invalid_argument, "/bufferViews/2", "buffer of 514"},
    {"AllIndicesOutOfRange.gltf", ErrorCode::invalid_argument, "/accessors/0/max/0", "65535"},
    {"IndexOutOfRange/IndexOutOfRange.gltf", ErrorCode::invalid_argument, "/meshes/0/primitives/0/indices",
     "24 vertices"},
    {"MissingBin/BoxTextured.gltf", ErrorCode::not_found, "/buffers/0/uri", "BoxTextured0.bin"},
    {"RecursiveNodes.gltf", ErrorCode::invalid_argument, "/nodes/0", "ancestor"},
    {"sceneWrongType.gltf", ErrorCode::invalid_argument, "/scene", "hello"},
    {"TestNoRootNode/NoScene.gltf", ErrorCode::invalid_argument, "/scene", "there are 0 scenes"},
    {"wrongTypes/badArray.gltf", ErrorCode::invalid_argument, "/meshes/0/primitives", "expected an array"},
    {"wrongTypes/badExtension.gltf", ErrorCode::invalid_argument, "/extensions/KHR_texture_transform",
     "expected an object"},
    {"wrongTypes/badNumber.gltf", ErrorCode::invalid_argument, "/normalTexture", "expected a number"},
    {"wrongTypes/badObject.gltf", ErrorCode::invalid_argument, "/pbrMetallicRoughness", "expected an object"},
    {"wrongTypes/badString.gltf", ErrorCode::invalid_argument, "/scenes/0/name", "expected a string"},
    {"wrongTypes/badUint.gltf", ErrorCode::invalid_argument, "/baseColorTexture/index", "-1"},
};

struct Content {
  const char* file;
  std::size_t objects, instances, triangles, images, cameras;
};

// From the files' JSON: meshes with triangles, nodes with them, sum of counts / 3 (strips and fans: count - 2).
constexpr Content kContents[] = {
    {"02_shared_mesh.gltf", 1, 2, 12, 0, 1},
    // 1900 instances by EXT_mesh_gpu_instancing of two meshes.
    {"24_gpu_instancing.gltf", 2, 1900, 4034, 0, 1},
    {"Mesh_PrimitiveMode_03.gltf", 0, 0, 0, 0, 1},  // line strip
    {"Mesh_PrimitiveMode_04.gltf", 1, 1, 2, 0, 1},  // strip
    {"Mesh_PrimitiveMode_05.gltf", 1, 1, 2, 0, 1},  // fan
    {"Mesh_PrimitiveMode_13.gltf", 1, 1, 2, 0, 1},  // list, indexed
    {"draco/2CylinderEngine.gltf", 29, 67, 65311, 0, 1},
    {"2CylinderEngine.glb", 29, 67, 75730, 0, 1},
    {"cameras/Cameras.gltf", 1, 1, 2, 0, 2},
    {"breakfast-room.glb", 54, 54, 278562, 3, 1},
    {"breakfast-room-draco.glb", 54, 54, 278562, 3, 1},
    {"cornell-bunny.glb", 7, 7, 69465, 0, 1},
    {"cornell-bunny-draco.glb", 7, 7, 69465, 0, 1},
    {"cornell-bunny-meshopt.glb", 7, 7, 69465, 0, 1},
    {"cornell-bunny-quantized.glb", 7, 7, 69465, 0, 1},
    {"cornell-glossy-boxes-separate.gltf", 8, 8, 38, 0, 1},
    {"cornell-glossy-boxes-sparse.glb", 8, 8, 38, 0, 1},
    {"cornell-dragon-full-meshopt.glb", 7, 7, 871426, 0, 1},
    {"sponza-dabrovic-meshopt.glb", 38, 38, 75469, 10, 1},
    {"kitchen-partial-meshopt.glb", 286, 286, 1021809, 11, 1},
};

template <class Table>
auto find_in(const Table& table, const std::string& name) -> decltype(&table[0]) {
  for (const auto& row : table)
    if (name.ends_with(std::string("/") + row.file)) return &row;
  return nullptr;
}

std::vector<std::string> gltf_files(const fs::path& root) {
  std::set<std::string> names;
  for (const char* folder : {"gltf-features", "gltf-variants", "glb", "bench", "kitchen-partial"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() == ".gltf" || entry.path().extension() == ".glb")
        names.insert(fs::relative(entry.path(), root).generic_string());
    }
  }
  return {names.begin(), names.end()};
}

void check_description(const SceneDescription& scene, const std::string& name) {
  ASSERT_FALSE(scene.cameras.empty()) << name;
  ASSERT_FALSE(scene.materials.empty()) << name;
  for (const Instance& instance : scene.instances) ASSERT_LT(std::size_t(instance.object), scene.objects.size());
  for (const Object& object : scene.objects) {
    for (const TriangleMesh& mesh : object.meshes) {
      const std::size_t vertices = mesh.positions.size();
      ASSERT_TRUE(mesh.material >= 0 && std::size_t(mesh.material) < scene.materials.size()) << name;
      ASSERT_TRUE(mesh.normals.empty() || mesh.normals.size() == vertices) << name;
      ASSERT_TRUE(mesh.tangents.empty() || mesh.tangents.size() == vertices) << name;
      ASSERT_TRUE(mesh.colors.empty() || mesh.colors.size() == vertices) << name;
      for (const V3f& normal : mesh.normals) ASSERT_NEAR(length(normal), 1, 1e-5) << name;
      for (const auto& set : mesh.texcoords) ASSERT_TRUE(set.empty() || set.size() == vertices) << name;
      for (const std::uint32_t index : mesh.indices) ASSERT_LT(index, vertices) << name;
    }
  }
}

TEST(GltfWalk, EveryFileLoadsOrIsRefusedForAKnownReason) {
  HELIO_SHARED_OR_SKIP(root, "scenes");
  std::size_t refusals = 0, contents = 0, files = 0;
  for (const std::string& name : gltf_files(root)) {
    SCOPED_TRACE(name);
    ++files;
    const fs::path path = root / name;
    const auto source = make_directory_source(path.parent_path().string());
    const Result<SceneDescription> scene = load_scene(*source, path.filename().string(), {});
    if (const Refusal* refusal = find_in(kRefused, name)) {
      ++refusals;
      ASSERT_FALSE(scene.ok());
      EXPECT_EQ(scene.error().code, refusal->code) << scene.error().to_string();
      EXPECT_TRUE(scene.error().where.ends_with(refusal->where)) << scene.error().where;
      EXPECT_NE(scene.error().message.find(refusal->message), std::string::npos) << scene.error().message;
      continue;
    }
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    check_description(*scene, name);
    if (const Content* content = find_in(kContents, name)) {
      ++contents;
      std::size_t triangles = 0;
      for (const Object& object : scene->objects)
        for (const TriangleMesh& mesh : object.meshes) triangles += mesh.triangle_count();
      EXPECT_EQ(scene->objects.size(), content->objects);
      EXPECT_EQ(scene->instances.size(), content->instances);
      EXPECT_EQ(triangles, content->triangles);
      EXPECT_EQ(scene->images.size(), content->images);
      EXPECT_EQ(scene->cameras.size(), content->cameras);
    }
  }
  EXPECT_EQ(refusals, std::size(kRefused));
  EXPECT_EQ(contents, std::size(kContents));
  EXPECT_GE(files, 95u);
}

// The scenes of this repository load without a word.
TEST(GltfWalk, OwnScenes) {
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(HELIO_SOURCE_DIR "/scenes")) {
    const fs::path& path = entry.path();
    if (path.extension() != ".gltf" && path.extension() != ".glb") continue;
    ++files;
    const auto source = make_directory_source(path.parent_path().string());
    const Result<SceneDescription> scene = load_scene(*source, path.filename().string(), {});
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_TRUE(scene->report.warnings.empty()) << path << ": " << scene->report.warnings.front();
    EXPECT_TRUE(scene->report.unread.empty()) << path << ": " << scene->report.unread.front();
    EXPECT_FALSE(scene->cameras.empty() || scene->instances.empty()) << path;
  }
  EXPECT_GE(files, 6);
}

// Compression and quantization must not move anything: bounds of the variants against the plain file.
TEST(GltfWalk, VariantsHaveTheGeometryOfTheOriginal) {
  HELIO_SHARED_OR_SKIP(root, "scenes");
  const auto bounds_of = [&](const char* folder, const char* file) {
    const auto source = make_directory_source((root / folder).string());
    const Result<SceneDescription> scene = load_scene(*source, file, {});
    EXPECT_TRUE(scene.ok()) << file << ": " << (scene.ok() ? "" : scene.error().to_string());
    Box3d box;
    for (const Instance& instance : scene->instances)
      for (const TriangleMesh& mesh : scene->objects[std::size_t(instance.object)].meshes)
        for (const V3f& p : mesh.positions) box.extendBy(V3d(p) * instance.to_world);
    return box;
  };
  const Box3d plain = bounds_of("glb", "cornell-bunny.glb");
  const double tolerance = 2e-3 * length(plain.size());  // 14 bits and fewer of the box's diagonal
  for (const char* variant : {"cornell-bunny-draco.glb", "cornell-bunny-meshopt.glb", "cornell-bunny-quantized.glb"}) {
    const Box3d box = bounds_of("gltf-variants", variant);
    EXPECT_LT(length(box.min - plain.min), tolerance) << variant;
    EXPECT_LT(length(box.max - plain.max), tolerance) << variant;
  }
  const Box3d boxes = bounds_of("glb", "cornell-glossy-boxes.glb");
  for (const char* variant : {"cornell-glossy-boxes-separate.gltf", "cornell-glossy-boxes-sparse.glb"})
    EXPECT_EQ(bounds_of("gltf-variants", variant).size(), boxes.size()) << variant;
}

}  // namespace
}  // namespace helio::test
