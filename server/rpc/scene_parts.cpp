#include "server/rpc/scene_parts.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "renderer/scene/load/scene_edit.h"
#include "renderer/trace/scene/scene_data.h"
#include "server/rpc/scene_messages.h"

namespace helio {
namespace {

constexpr std::size_t kMaxParts = 1024;  // of each kind: keeps the answer below the message limit

const char* to_string(PunctualKind kind) {
  switch (kind) {
    case PunctualKind::point:
      return "point";
    case PunctualKind::spot:
      return "spot";
    case PunctualKind::directional:
      return "directional";
    case PunctualKind::projector:
      return "projector";
  }
  return "";
}

void write(const Instance& instance, const Object& object, pb::DescribeSceneResponse::Object& message) {
  message.set_name(printable(instance.name, kMaxName));
  for (int i = 0; i < 12; ++i) message.add_transform(instance.to_world[i % 4][i / 4]);
  std::uint64_t triangles = 0;
  for (const TriangleMesh& mesh : object.meshes) triangles += mesh.triangle_count();
  message.set_triangles(triangles);
  if (!object.meshes.empty()) {
    message.set_material(std::uint32_t(object.meshes.front().material));
  } else if (!object.spheres.empty()) {
    message.set_material(std::uint32_t(object.spheres.front().material));
  }
}

void write(const Material& material, pb::DescribeSceneResponse::Material& message) {
  message.set_name(printable(material.name, kMaxName));
  message.set_model(to_string(material.model));
  const EditableValues has = editable_values(material.model);
  const MaterialValues values = material_values(material);
  if (has.base_color) write_vector(values.base_color, *message.mutable_base_color());
  if (has.emission) write_vector(values.emission, *message.mutable_emission());
  if (has.roughness) message.set_roughness(values.roughness);
}

void write(const PunctualLight& light, pb::DescribeSceneResponse::Light& message) {
  message.set_name(printable(light.name, kMaxName));
  message.set_kind(to_string(light.kind));
  write_vector(light.intensity, *message.mutable_intensity());
}

// Calls `add(item)` for those that the answer has room for.
template <class Item, class Add>
void list(const std::vector<Item>& items, std::uint32_t first, const char* field, Problems& problems, Add&& add) {
  if (first > items.size()) {
    problems.add(field, fmt::format("{}; allowed: [0, {}]", first, items.size()));
    return;
  }
  for (std::size_t i = first; i < std::min(items.size(), first + kMaxParts); ++i) add(items[i]);
}

}  // namespace

Result<pb::DescribeSceneResponse> to_scene_parts(const LoadedScene& loaded, const pb::DescribeSceneRequest& which) {
  const SceneDescription& scene = loaded.snapshot->description();
  const std::vector<Object>& objects = loaded.snapshot->impl().assets->objects;
  pb::DescribeSceneResponse parts;
  Problems problems;
  list(scene.instances, which.first_object(), "first_object", problems,
       [&](const Instance& item) { write(item, objects[std::size_t(item.object)], *parts.add_objects()); });
  list(scene.materials, which.first_material(), "first_material", problems,
       [&](const Material& item) { write(item, *parts.add_materials()); });
  list(scene.lights, which.first_light(), "first_light", problems,
       [&](const PunctualLight& item) { write(item, *parts.add_lights()); });
  if (!problems.empty()) return problems.to_error();
  parts.set_object_total(std::uint32_t(scene.instances.size()));
  parts.set_material_total(std::uint32_t(scene.materials.size()));
  parts.set_light_total(std::uint32_t(scene.lights.size()));
  if (scene.environment) write_vector(scene.environment->radiance, *parts.mutable_environment());
  return parts;
}

pb::ListFilesResponse to_list(const SceneRoots::List& list) {
  pb::ListFilesResponse message;
  for (const SceneRoots::Entry& entry : list.entries) {
    if (printable(entry.path, entry.path.size()) != entry.path) continue;  // no string of protobuf's could name it
    pb::ListFilesResponse::Entry& told = *message.add_entries();
    told.set_path(entry.path);
    told.set_folder(entry.folder);
    told.set_bytes(entry.bytes);
    told.set_environment(entry.environment);
  }
  message.set_total(std::uint32_t(list.total));
  return message;
}

}  // namespace helio
