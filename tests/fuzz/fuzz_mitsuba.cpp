// Mitsuba scenes and the mesh files they name, from bytes to a scene that rays can be traced in.
//
// The input is a scene or, by how it begins, a mesh: XML goes first, "ply" and everything else are read by a scene that
// names them.
#include <cstdlib>
#include <string>

#include "renderer/scene/scene_loader.h"
#include "renderer/trace/render_scene.h"

namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

std::string scene_of(const char* type, const char* file) {
  return std::string("<scene version='3.0.0'><shape type='") + type + "'><string name='filename' value='" + file +
         "'/></shape></scene>";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> input(data, data + size);
  const bool xml = size > 0 && data[0] == '<', ply = size > 2 && data[0] == 'p' && data[1] == 'l';
  const auto source = helio::make_memory_source(
      {{"fuzz.xml", xml ? input : bytes_of(ply ? scene_of("ply", "mesh.ply") : scene_of("obj", "mesh.obj"))},
       {"part.xml", bytes_of("<scene version='3.0.0'><shape type='cube'/></scene>")},
       {"mesh.ply", ply ? input : bytes_of(kPly)},
       {"mesh.obj", xml || ply ? bytes_of(kTriangle) : input}});
  helio::SceneLoadOptions options;
  options.max_memory_bytes = 32 << 20;
  auto scene = helio::load_scene(*source, "fuzz.xml", options);
  if (!scene) {
    if (scene.error().message.empty()) std::abort();
    return 0;
  }
  for (const helio::Object& object : scene->objects) {
    for (const helio::TriangleMesh& mesh : object.meshes) {
      for (const std::uint32_t index : mesh.indices) {
        if (index >= mesh.positions.size()) std::abort();
      }
    }
  }
  for (const helio::Material& material : scene->materials) {
    if (material.model != helio::MaterialModel::blend) continue;
    const int count = int(scene->materials.size());
    if (material.blend.first < 0 || material.blend.first >= count) std::abort();
    if (material.blend.second < 0 || material.blend.second >= count) std::abort();
  }
  helio::RenderSceneOptions build;
  build.threads = 1;
  build.rays = helio::RayMode::robust;  // measuring leaks would take most of the time
  const auto built = helio::RenderScene::build(std::move(*scene), build);
  if (!built && built.error().message.empty()) std::abort();
  return 0;
}
