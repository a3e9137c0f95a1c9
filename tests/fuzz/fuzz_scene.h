// What the fuzzers of scene formats ask of any bytes: a scene that rays can be traced in, or an error that says where.
#pragma once

#include <cstdlib>
#include <string>

#include "renderer/scene/load/scene_loader.h"
#ifndef HELIO_FUZZ_LOAD_ONLY
#include "renderer/trace/scene/render_scene.h"
#endif

namespace helio::fuzz {

// Aborts where the loader breaks its word. Errors must name `main_file` or one of `others` first.
inline void load_and_build(const FileSource& source, const std::string& main_file, const std::string& others = {}) {
  SceneLoadOptions options;
  options.time_s = 0.5;
  options.max_memory_bytes = 32 << 20;
  auto scene = load_scene(source, main_file, options);
  if (!scene) {
    const Error& error = scene.error();
    const bool placed = error.where.starts_with(main_file) || (!others.empty() && error.where.starts_with(others));
    if (error.message.empty() || !placed) std::abort();
    return;
  }
  for (const Object& object : scene->objects) {
    for (const TriangleMesh& mesh : object.meshes) {
      for (const std::uint32_t index : mesh.indices) {
        if (index >= mesh.positions.size()) std::abort();
      }
    }
  }
  const int materials = int(scene->materials.size());
  for (const Material& material : scene->materials) {
    if (material.model != MaterialModel::blend) continue;
    for (const int index : {material.blend.first, material.blend.second}) {
      if (index < 0 || index >= materials) std::abort();
    }
  }
#ifndef HELIO_FUZZ_LOAD_ONLY
  RenderSceneOptions build;
  build.threads = 1;
  build.rays = RayMode::robust;  // measuring leaks would take most of the time
  const auto built = RenderScene::build(std::move(*scene), build);
  if (!built && built.error().message.empty()) std::abort();
#endif
}

}  // namespace helio::fuzz
