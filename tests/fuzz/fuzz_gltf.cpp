// glTF and GLB files, from bytes to a scene that rays can be traced in.
#include <cstdlib>

#include "renderer/scene/scene_loader.h"
#include "renderer/trace/render_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto source = helio::make_memory_source({{"fuzz.gltf", {data, data + size}}});
  helio::SceneLoadOptions options;
  options.time_s = 0.5;
  options.max_memory_bytes = 32 << 20;
  auto scene = helio::load_scene(*source, "fuzz.gltf", options);
  if (!scene) {
    if (scene.error().message.empty() || !scene.error().where.starts_with("fuzz.gltf")) std::abort();
    return 0;
  }
  for (const helio::Object& object : scene->objects) {
    for (const helio::TriangleMesh& mesh : object.meshes) {
      for (const std::uint32_t index : mesh.indices) {
        if (index >= mesh.positions.size()) std::abort();
      }
    }
  }
  helio::RenderSceneOptions build;
  build.threads = 1;
  build.rays = helio::RayMode::robust;  // measuring leaks would take most of the time
  const auto built = helio::RenderScene::build(std::move(*scene), build);
  if (!built && built.error().message.empty()) std::abort();
  return 0;
}
