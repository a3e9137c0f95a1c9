#include "renderer/trace/scene/build_memory.h"

#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "renderer/trace/lights/light_bounds.h"
#include "renderer/trace/lights/light_groups.h"
#include "renderer/trace/lights/light_tree.h"
#include "renderer/trace/lights/light_tree_build.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {
namespace {

// An emitter at the peak of the build: its record; its light while grouped and when kept; bounds in a vector that
// doubles; the binary hierarchy; a wide node that in the worst case serves two lights; tables of flux, order and
// places.
constexpr std::uint64_t kBytesPerEmitter = sizeof(AreaEmitter) + 2 * sizeof(AreaLight) + 2 * sizeof(EmitterAlpha) +
                                           2 * sizeof(LightAlpha) + 2 * sizeof(LightBounds) +
                                           2 * sizeof(LightTreeNode) + sizeof(LightTree::Node) / 2 + 64;

// Record, name and Embree's geometry object, its part of the top level and of that level's build included.
constexpr std::uint64_t kBytesPerInstance =
    sizeof(InstanceRecord) + sizeof(AccelInstance) + 2 * sizeof(std::uint32_t) + 768;

std::uint64_t add(std::uint64_t a, std::uint64_t b) {
  return a > std::numeric_limits<std::uint64_t>::max() - b ? std::numeric_limits<std::uint64_t>::max() : a + b;
}

std::uint64_t multiply(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > std::numeric_limits<std::uint64_t>::max() / b ? std::numeric_limits<std::uint64_t>::max()
                                                                     : a * b;
}

std::uint64_t mesh_bytes(const TriangleMesh& mesh) {
  std::uint64_t bytes = mesh.positions.size() * sizeof(V3f) + mesh.normals.size() * sizeof(V3f) +
                        mesh.tangents.size() * sizeof(V4f) + mesh.colors.size() * sizeof(V4f) +
                        mesh.indices.size() * sizeof(std::uint32_t);
  for (const auto& uv : mesh.texcoords) bytes += uv.size() * sizeof(V2f);
  return bytes;
}

// A third of the texels in levels that stay, for each image and encoding once, and while the largest is made its own
// texels and half of them again, all as four floats.
std::uint64_t pyramid_bytes(const SceneDescription& scene, std::span<const TextureSlot> mip_mapped) {
  std::set<std::pair<int, TexelEncoding>> seen;
  std::uint64_t kept = 0, largest = 0;
  for (const TextureSlot& slot : mip_mapped) {
    if (!seen.emplace(slot.image, slot.encoding).second) continue;
    const Image& image = scene.images[std::size_t(slot.image)];
    const std::uint64_t bytes = std::uint64_t(image.width) * std::uint64_t(image.height) * sizeof(V4f);
    kept += bytes / 2;  // a third, and what sizes that do not halve evenly and the ends of long strips add
    largest = std::max(largest, bytes + bytes / 2);
  }
  return kept + largest;
}

bool emits(const Material& material) {
  return !is_black(material.emission) && material.model != MaterialModel::unlit;
}

}  // namespace

std::uint64_t instance_bytes(const SceneDescription& scene) {
  std::uint64_t bytes = 0;
  for (const Instance& instance : scene.instances) bytes += sizeof(Instance) + instance.name.size();
  return bytes;
}

std::uint64_t emitter_bytes(std::uint64_t count) {
  return multiply(count, kBytesPerEmitter);
}

BuildMemory estimate_build_memory(const SceneDescription& scene, std::span<const TextureSlot> mip_mapped) {
  BuildMemory memory;
  std::vector<std::uint64_t> emitters;  // of each object
  emitters.reserve(scene.objects.size());
  for (const Object& object : scene.objects) {
    std::uint64_t count = 0;
    for (const TriangleMesh& mesh : object.meshes) {
      memory.description += mesh_bytes(mesh);
      if (emits(scene.materials[std::size_t(mesh.material)])) count += mesh.triangle_count();
    }
    for (const Sphere& sphere : object.spheres) count += emits(scene.materials[std::size_t(sphere.material)]);
    emitters.push_back(count);
  }
  const int map = scene.environment ? scene.environment->image : -1;
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    if (int(i) != map) memory.description += scene.images[i].bytes();
  }
  for (const Instance& instance : scene.instances) {
    memory.emitter_count = add(memory.emitter_count, emitters[std::size_t(instance.object)]);
  }
  memory.description += instance_bytes(scene);
  memory.pyramids = pyramid_bytes(scene, mip_mapped);
  memory.instances = multiply(scene.instances.size(), kBytesPerInstance);
  memory.emitters = emitter_bytes(memory.emitter_count);
  return memory;
}

}  // namespace helio
