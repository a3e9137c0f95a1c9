#include "renderer/scene/gltf/loader.h"

#include <algorithm>
#include <map>

#include "renderer/scene/description/material_slots.h"
#include "renderer/scene/gltf/animation.h"
#include "renderer/scene/gltf/document/container.h"
#include "renderer/scene/gltf/document/document.h"
#include "renderer/scene/gltf/document/uri.h"
#include "renderer/scene/gltf/geometry.h"
#include "renderer/scene/gltf/images.h"
#include "renderer/scene/gltf/morph.h"
#include "renderer/scene/gltf/pose.h"
#include "renderer/scene/gltf/skin.h"
#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/image_decoder.h"

namespace helio {

namespace gltf {
namespace {

class SceneBuilder {
 public:
  SceneBuilder(const Document& document, const BufferStore& buffers, const FileSource& source,
               const std::string& scene_file, const SceneLoadOptions& options, MemoryBudget& budget,
               Diagnostics& diagnostics)
      : document_(document),
        buffers_(buffers),
        source_(source),
        scene_file_(scene_file),
        options_(options),
        budget_(budget),
        diagnostics_(diagnostics),
        reader_(document, buffers, budget, diagnostics) {}

  SceneDescription build() {
    scene_.materials = document_.materials;
    mesh_used_.resize(document_.meshes.size());
    material_used_.resize(document_.materials.size());
    reader_.check_all();
    const int animation = choose_animation(document_, options_.animation, diagnostics_);
    if (!diagnostics_.failed()) report_animations(animation);
    if (!diagnostics_.failed()) pose_ = evaluate_pose(document_, animation, options_.time_s, reader_, diagnostics_);
    if (!diagnostics_.failed()) add_nodes();
    if (!diagnostics_.failed()) check_unused_meshes();
    if (!diagnostics_.failed()) add_default_material();
    if (!diagnostics_.failed()) add_images();
    return std::move(scene_);
  }

 private:
  void report_animations(int played) {
    for (std::size_t i = 0; i < document_.animations.size(); ++i)
      scene_.animations.push_back(animation_name(document_, i));
    if (played >= 0) scene_.animation = scene_.animations[std::size_t(played)];
    if (scene_.animations.size() < 2) return;
    const std::string names = list_animations(document_, played);
    if (played < 0)
      diagnostics_.notice("no animation moves anything; there are " + names);
    else
      diagnostics_.notice("animation \"" + scene_.animation + "\" is played; the others, not played: " + names);
  }

  // ---- nodes -------------------------------------------------------------------------------------------------------

  std::vector<int> root_nodes() {
    int chosen = document_.scene;
    if (chosen < 0 && !document_.scenes.empty()) {
      chosen = 0;
      diagnostics_.notice("no default scene: the first one is rendered");
    }
    if (chosen >= 0) {
      scene_.name = document_.scenes[std::size_t(chosen)].name;
      return document_.scenes[std::size_t(chosen)].nodes;
    }
    if (!document_.nodes.empty()) diagnostics_.notice("no scene: all nodes are rendered");
    std::vector<int> roots;
    for (std::size_t i = 0; i < document_.nodes.size(); ++i)
      if (document_.nodes[i].parent < 0) roots.push_back(int(i));
    return roots;
  }

  void add_nodes() {
    std::vector<int> stack = root_nodes();
    std::reverse(stack.begin(), stack.end());
    std::vector<bool> visited(document_.nodes.size());  // a scene may name a root twice
    while (!stack.empty() && !diagnostics_.failed()) {
      const std::size_t at = std::size_t(stack.back());
      stack.pop_back();
      if (visited[at]) continue;
      visited[at] = true;
      add_node(at);
      const std::vector<int>& children = document_.nodes[at].children;
      stack.insert(stack.end(), children.rbegin(), children.rend());
    }
  }

  void add_node(std::size_t index) {
    const Node& node = document_.nodes[index];
    const std::string name = node.name.empty() ? "node " + std::to_string(index) : node.name;
    const std::string place = std::string() / "nodes" / index;
    if (node.mesh >= 0) add_mesh(index, name, place);
    if (node.sphere) add_sphere(*node.sphere, index, name);
    if (node.camera >= 0) add_camera(node, looking(index), name);
    if (node.light >= 0) add_light(node, looking(index), name, place);
  }

  void add_mesh(std::size_t index, const std::string& name, const std::string& place) {
    const Node& node = document_.nodes[index];
    mesh_used_[std::size_t(node.mesh)] = true;
    if (node.skin >= 0) {
      add_skinned(index, name, place);
      return;
    }
    const int object = find_object(node.mesh, pose_.weights[index]);
    if (object < 0) return;
    if (node.instancing)
      add_gpu_instances(*node.instancing, object, index, name, place);
    else
      add_instance(name, object, pose_.to_world[index], pose_.mirrored[index], place);
  }

  // The object of a mesh in the shape that the weights give it, made once. -1: it has no triangles, or a failure.
  int find_object(int mesh, const std::vector<float>& weights) {
    const std::pair key(mesh, is_morphed(weights) ? weights : std::vector<float>());
    const auto [found, added] = objects_.try_emplace(key, -1);
    if (added) found->second = add_object(read_mesh(std::size_t(mesh), key.second, std::nullopt), mesh);
    return found->second;
  }

  std::vector<PrimitiveGeometry> read_mesh(std::size_t index, std::span<const float> weights,
                                           std::optional<std::size_t> joint_count) {
    std::vector<PrimitiveGeometry> result;
    const Mesh& mesh = document_.meshes[index];
    for (std::size_t p = 0; p < mesh.primitives.size() && !diagnostics_.failed(); ++p) {
      const std::string place = std::string() / "meshes" / index / "primitives" / p;
      std::optional<PrimitiveGeometry> geometry =
          read_primitive(mesh.primitives[p], place, weights, joint_count, buffers_, reader_, diagnostics_);
      if (geometry) result.push_back(std::move(*geometry));
    }
    return result;
  }

  int add_object(std::vector<PrimitiveGeometry> geometry, int mesh) {
    if (geometry.empty() || diagnostics_.failed()) return -1;
    Object object;
    object.name = document_.meshes[std::size_t(mesh)].name;
    if (object.name.empty()) object.name = "mesh " + std::to_string(mesh);
    for (PrimitiveGeometry& part : geometry) {
      for (const V3f& p : part.mesh.positions) {
        if (!is_finite(p)) {
          diagnostics_.fail(std::string() / "meshes" / std::size_t(mesh),
                            "its morph targets or joints move a vertex to infinity");
          return -1;
        }
      }
      if (part.mesh.material >= 0) material_used_[std::size_t(part.mesh.material)] = true;
      object.meshes.push_back(std::move(part.mesh));
    }
    scene_.objects.push_back(std::move(object));
    return int(scene_.objects.size()) - 1;
  }

  void add_skinned(std::size_t index, const std::string& name, const std::string& place) {
    const Node& node = document_.nodes[index];
    const Skin& skin = document_.skins[std::size_t(node.skin)];
    auto [found, added] = joints_.try_emplace(node.skin);
    if (added && !joint_matrices(skin, pose_.to_world, reader_, found->second)) return;
    if (node.instancing) diagnostics_.warn(place, "instancing of a skinned mesh is ignored");
    std::vector<PrimitiveGeometry> parts = read_mesh(std::size_t(node.mesh), pose_.weights[index], skin.joints.size());
    // A skinned mesh's own node does not move it; its joints already lead to the world.
    const M44d& joint = pose_.to_world[std::size_t(skin.joints.front())];
    const V3d origin(joint[3][0], joint[3][1], joint[3][2]);
    for (PrimitiveGeometry& part : parts) {
      apply_skin(found->second, origin, part);
      budget_.release(part.skin.weights.size() * 8);
      part.skin = {};
    }
    const int object = add_object(std::move(parts), node.mesh);
    M44d to_world;
    to_world.setTranslation(origin);
    if (object >= 0) add_instance(name, object, to_world, false, place);
  }

  void add_instance(const std::string& name, int object, const M44d& to_world, bool mirrored,
                    const std::string& place) {
    if (Status s = budget_.reserve(sizeof(Instance) + name.size(), ""); !s.ok())
      diagnostics_.fail(place, s.error());
    else
      scene_.instances.push_back({name, object, to_world, mirrored});
  }

  void add_gpu_instances(const GpuInstancing& instancing, int object, std::size_t node, const std::string& name,
                         const std::string& place) {
    if (Status s = budget_.reserve(instancing.count, sizeof(Instance) + name.size(), ""); !s.ok())
      return diagnostics_.fail(place / "extensions" / "EXT_mesh_gpu_instancing", s.error());
    std::vector<V3f> translations, scales;
    std::vector<V4f> rotations;
    const std::uint64_t used_before = budget_.used();
    if ((instancing.translation >= 0 && !reader_.read(instancing.translation, translations)) ||
        (instancing.scale >= 0 && !reader_.read(instancing.scale, scales)) ||
        (instancing.rotation >= 0 && !reader_.read(instancing.rotation, rotations)))
      return;
    scene_.instances.reserve(scene_.instances.size() + instancing.count);
    for (std::size_t i = 0; i < instancing.count; ++i) {
      Trs trs;
      if (!translations.empty()) trs.translation = V3d(translations[i]);
      if (!scales.empty()) trs.scale = V3d(scales[i]);
      if (!rotations.empty()) {
        const V4f& q = rotations[i];
        const double length = std::sqrt(double(q.x) * q.x + double(q.y) * q.y + double(q.z) * q.z + double(q.w) * q.w);
        if (!check_unit_rotation(std::string() / "accessors" / std::size_t(instancing.rotation), i, length,
                                 diagnostics_))
          return;
        trs.rotation = {q.x / length, q.y / length, q.z / length, q.w / length};
      }
      scene_.instances.push_back(
          {name, object, to_matrix(trs) * pose_.to_world[node], is_mirrored(trs) != pose_.mirrored[node]});
    }
    budget_.release(budget_.used() - used_before);
  }

  // The frame of a camera or light, which looks along -z of its node.
  M44d looking(std::size_t index) {
    const M44d& m = pose_.to_world[index];
    const V3d up(m[1][0], m[1][1], m[1][2]), back(m[2][0], m[2][1], m[2][2]);
    if (length(cross(up, back)) > 1e-9 * length(up) * length(back)) return m;
    if (unflattened_.empty()) unflattened_ = unflattened(document_, pose_);
    M44d to_world = unflattened_[index];
    for (int axis = 0; axis < 3; ++axis) to_world[3][axis] = m[3][axis];
    for (int i = 0; i < 12; ++i)
      if (!std::isfinite(to_world[i / 4][i % 4])) return m;
    return to_world;
  }

  void add_sphere(const Sphere& sphere, std::size_t node, const std::string& name) {
    Object object;
    object.name = name;
    object.spheres.push_back(sphere);
    if (sphere.material >= 0) material_used_[std::size_t(sphere.material)] = true;
    scene_.objects.push_back(std::move(object));
    scene_.instances.push_back(
        {name, int(scene_.objects.size()) - 1, pose_.to_world[node], pose_.mirrored[node]});
  }

  void add_camera(const Node& node, const M44d& to_world, const std::string& name) {
    CameraDescription camera = document_.cameras[std::size_t(node.camera)];
    if (!node.name.empty() || camera.name.empty()) camera.name = name;
    camera.to_world = to_world;
    scene_.cameras.push_back(std::move(camera));
  }

  void add_light(const Node& node, const M44d& to_world, const std::string& name, const std::string& place) {
    PunctualLight light = document_.lights[std::size_t(node.light)];
    if (!node.name.empty() || light.name.empty()) light.name = name;
    light.position = V3d(to_world[3][0], to_world[3][1], to_world[3][2]);
    const V3d axis(-to_world[2][0], -to_world[2][1], -to_world[2][2]);
    const double length = helio::length(axis);
    if (light.kind != PunctualKind::point && !(length > 1e-30)) {
      diagnostics_.warn(place, "its light has no direction, because the node is scaled to nothing: left out");
      return;
    }
    if (light.kind != PunctualKind::point) light.direction = V3f(axis / length);
    scene_.lights.push_back(std::move(light));
  }

  // ---- what is left ------------------------------------------------------------------------------------------------

  // A broken mesh is refused whether the scene shows it or not; nothing of it is kept.
  void check_unused_meshes() {
    std::size_t unused = 0;
    const std::uint64_t used_before = budget_.used();
    for (std::size_t m = 0; m < document_.meshes.size() && !diagnostics_.failed(); ++m) {
      if (mesh_used_[m]) continue;
      ++unused;
      read_mesh(m, {}, std::nullopt);
    }
    // All of it counts until here, so that many meshes over the same bytes cannot take for ever.
    budget_.release(budget_.used() - used_before);
    if (unused != 0) diagnostics_.notice(std::to_string(unused) + " meshes are not in the scene");
  }

  void add_default_material() {
    const int fallback = int(scene_.materials.size());
    bool needed = scene_.materials.empty();
    for (Object& object : scene_.objects) {
      for (TriangleMesh& mesh : object.meshes) {
        needed |= mesh.material < 0;
        if (mesh.material < 0) mesh.material = fallback;
      }
      for (Sphere& sphere : object.spheres) {
        needed |= sphere.material < 0;
        if (sphere.material < 0) sphere.material = fallback;
      }
    }
    if (!needed) return;
    scene_.materials.emplace_back();
    scene_.materials.back().name = "default";
  }

  void add_images() {
    std::vector<bool> needed(document_.images.size());
    for (std::size_t m = 0; m < document_.materials.size(); ++m) {
      if (!material_used_[m]) continue;
      for_each_texture_slot(document_.materials[m], [&](const TextureSlot& slot) {
        if (slot.present()) needed[std::size_t(slot.image)] = true;
      });
    }
    const bool own_environment = document_.environment && options_.environment.empty();
    if (own_environment && document_.environment->image >= 0) needed[std::size_t(document_.environment->image)] = true;

    LoadedImages loaded = load_images(document_, needed, buffers_, source_, scene_file_, budget_, diagnostics_);
    scene_.images = std::move(loaded.images);
    for (Material& material : scene_.materials) {
      for_each_texture_slot(material, [&](TextureSlot& slot) {
        if (slot.present()) slot.image = loaded.index[std::size_t(slot.image)];
      });
    }
    if (own_environment && !diagnostics_.failed()) add_environment(loaded.index);
  }

  void add_environment(const std::vector<int>& image_index) {
    Environment environment = *document_.environment;
    if (environment.image >= 0) environment.image = image_index[std::size_t(environment.image)];
    const std::string place = "/extras/heliograph/environment/image";
    if (document_.environment_uri) {
      Result<std::vector<std::uint8_t>> bytes =
          read_other_file(source_, scene_file_, *document_.environment_uri, budget_);
      if (!bytes.ok()) return diagnostics_.fail(place, bytes.error());
      std::vector<std::string> notices;
      Result<Image> image = decode_image(*bytes, *document_.environment_uri, budget_.remaining(), &notices,
                                         [&](std::uint64_t size) { return budget_.reserve(size, ""); });
      if (!image.ok()) return diagnostics_.fail(place, image.error());
      for (const std::string& notice : notices) diagnostics_.notice(notice);
      budget_.release(bytes->size());
      environment.image = int(scene_.images.size());
      scene_.images.push_back(std::move(*image));
    }
    if (environment.image >= 0) {
      if (Status s = prepare_environment_image(scene_.images[std::size_t(environment.image)]); !s.ok())
        return diagnostics_.fail(place, s.error());
    }
    scene_.environment = environment;
  }

  const Document& document_;
  const BufferStore& buffers_;
  const FileSource& source_;
  const std::string& scene_file_;
  const SceneLoadOptions& options_;
  MemoryBudget& budget_;
  Diagnostics& diagnostics_;
  AccessorReader reader_;
  Pose pose_;
  std::vector<M44d> unflattened_;  // of all nodes, once one asks
  SceneDescription scene_;
  std::map<std::pair<int, std::vector<float>>, int> objects_;
  std::map<int, std::vector<M44d>> joints_;  // by skin
  std::vector<bool> mesh_used_, material_used_;
};

}  // namespace
}  // namespace gltf

Result<SceneDescription> load_gltf(std::span<const std::uint8_t> file, const std::string& path,
                                   const FileSource& source, const SceneLoadOptions& options, MemoryBudget& budget) {
  using namespace gltf;
  Result<Container> container = open_container(file, path, path.ends_with(".glb"));
  if (!container.ok()) return container.error();
  Result<JsonDocument> json = JsonDocument::parse(container->json, path, container->json_offset, budget);
  if (!json.ok()) return json.error();

  Diagnostics diagnostics(path, options.strict);
  if (starts_with_byte_order_mark(container->json))
    diagnostics.tolerate("@" + std::to_string(container->json_offset),
                         "the JSON starts with a byte order mark, which glTF forbids", "skipped");
  for (const auto& [byte, slip] : container->slips)
    diagnostics.tolerate("@" + std::to_string(byte), slip, "read as it is");
  for (const std::string& warning : container->warnings) diagnostics.warn("", warning);
  const Document document = read_document(json->root(diagnostics));
  if (diagnostics.failed()) return diagnostics.to_error();
  const BufferStore buffers(document, *container, source, path, budget, diagnostics);
  if (diagnostics.failed()) return diagnostics.to_error();
  SceneDescription scene = SceneBuilder(document, buffers, source, path, options, budget, diagnostics).build();
  if (diagnostics.refused()) return diagnostics.to_error();
  scene.report = diagnostics.take_report();
  return scene;
}

Result<std::vector<std::string>> gltf_referenced_files(std::span<const std::uint8_t> gltf_bytes,
                                                       std::string_view name) {
  using namespace gltf;
  const std::string file(name);
  Result<Container> container = open_container(gltf_bytes, file, file.ends_with(".glb"));
  if (!container.ok()) return container.error();
  MemoryBudget budget(SceneLoadOptions{}.max_memory_bytes);
  budget.add_source_file(file, gltf_bytes.size());
  Result<JsonDocument> json = JsonDocument::parse(container->json, file, container->json_offset, budget);
  if (!json.ok()) return json.error();

  Diagnostics diagnostics(file);
  std::vector<std::string> files;
  const auto add = [&](const JsonObject& owner, const char* key) {
    if (!owner.is_string(key)) return;
    const std::string uri = owner.string(key);
    if (is_data_uri(uri) || has_scheme(uri)) return;
    Result<std::string> path = resolve_uri("", uri);
    if (!path.ok())
      diagnostics.fail(owner.place() / key, path.error());
    else if (std::find(files.begin(), files.end(), *path) == files.end())
      files.push_back(*path);
  };
  const JsonObject root = json->root(diagnostics);
  for (const char* array : {"buffers", "images"})
    if (root.array_size(array) != 0)
      root.each(array, [&](const JsonObject& object, std::size_t) { add(object, "uri"); });
  const auto add_environment = [&](const JsonObject& owner) {
    if (!owner.is_object("extras")) return;
    add(owner.object("extras").object("heliograph").object("environment"), "image");
  };
  add_environment(root.object("asset"));
  if (root.array_size("scenes") != 0)
    root.each("scenes", [&](const JsonObject& scene, std::size_t) { add_environment(scene); });
  if (diagnostics.failed()) return diagnostics.to_error();
  return files;
}

}  // namespace helio
