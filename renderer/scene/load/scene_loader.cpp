#include "renderer/scene/load/scene_loader.h"

#include <algorithm>

#include "renderer/scene/description/default_camera.h"
#include "renderer/scene/gltf/document/container.h"
#include "renderer/scene/gltf/loader.h"
#include "renderer/scene/images/environment.h"
#include "renderer/scene/mitsuba/document.h"
#include "renderer/scene/mitsuba/loader.h"

namespace helio {

namespace {

bool looks_like_gltf(std::span<const std::uint8_t> bytes, const std::string& path) {
  if (gltf::looks_like_glb(bytes) || path.ends_with(".gltf") || path.ends_with(".glb")) return true;
  const auto first = std::find_if(bytes.begin(), bytes.end(),
                                  [](std::uint8_t c) { return c != ' ' && c != '\t' && c != '\r' && c != '\n'; });
  return first != bytes.end() && *first == '{';
}

bool has_light(const SceneDescription& scene) {
  if (!scene.lights.empty() || scene.environment) return true;
  for (const Object& object : scene.objects) {
    const auto emits = [&](int material) { return !is_black(scene.materials[std::size_t(material)].emission); };
    for (const TriangleMesh& mesh : object.meshes)
      if (emits(mesh.material)) return true;
    for (const Sphere& sphere : object.spheres)
      if (emits(sphere.material)) return true;
  }
  return false;
}

}  // namespace

Result<std::vector<std::string>> referenced_files(std::span<const std::uint8_t> scene_bytes, std::string_view name) {
  const std::string file(name);
  if (!looks_like_gltf(scene_bytes, file) && looks_like_mitsuba(scene_bytes, file))
    return mitsuba::mitsuba_file_names(scene_bytes, file);
  return gltf_referenced_files(scene_bytes, name);
}

Result<SceneDescription> load_scene(const FileSource& source, const std::string& path,
                                    const SceneLoadOptions& options) {
  MemoryBudget budget(options.max_memory_bytes, options.ledger);
  Result<std::vector<std::uint8_t>> file = source.read(path, options.max_memory_bytes);
  if (!file.ok()) return file.error();
  budget.add_source_file(path, file->size());
  if (Status s = budget.reserve(file->size(), path); !s.ok()) return s.error();
  const bool gltf = looks_like_gltf(*file, path);
  if (!gltf && !looks_like_mitsuba(*file, path))
    return Error{ErrorCode::invalid_argument, "the format is not known; glTF 2.0 (.gltf, .glb) and Mitsuba (.xml) are",
                 path + "@0"};

  Result<SceneDescription> loaded = gltf ? load_gltf(*file, path, source, options, budget)
                                         : load_mitsuba(*file, path, source, options, budget);
  if (!loaded.ok()) return loaded;
  SceneDescription& scene = *loaded;
  if (!options.environment.empty()) {
    Result<Environment> environment = parse_environment(
        options.environment, options.environment_source, budget.remaining_configured(), scene.images,
        &scene.report.notices,
        [&](std::uint64_t bytes) { return budget.reserve_configured(bytes, options.environment); });
    if (!environment.ok()) return environment.error();
    scene.environment = *environment;
  } else if (!has_light(scene)) {
    scene.environment = Environment{};
    scene.report.notices.emplace_back("no light in the file: a constant environment of radiance 1 is used");
  }
  const bool mapped = scene.environment && scene.environment->image >= 0;
  const std::uint64_t map_bytes = mapped ? scene.images[std::size_t(scene.environment->image)].bytes() : 0;
  scene.memory_limit =
      std::min(options.max_memory_bytes - std::min(options.max_memory_bytes, map_bytes), budget.limit());
  if (scene.cameras.empty()) {
    scene.cameras.push_back(frame_bounds(scene_bounds(scene)));
    scene.report.notices.emplace_back("no camera in the file: the bounding box is framed");
  }
  return loaded;
}

}  // namespace helio
