#include "renderer/vulkan/scene/geometry_tables.h"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

namespace helio::vulkan {
namespace {

static_assert(kTexcoordSets == kMaxTexcoordSets);

PartTable part_table(const SceneData& scene, const PartRecord& record) {
  PartTable part{};
  part.center = record.center;
  part.radius = record.radius;
  part.material = record.material;
  part.first_emitter = record.first_emitter;
  part.offset = record.offset;
  part.through = record.through;
  const Material& material = scene.description.materials[record.material];
  if (!record.mesh) part.flags |= kPartSphere;
  if (record.smooth) part.flags |= kPartSmooth;
  if (has_alpha(material, record.mesh, *scene.textures)) part.flags |= kPartAlpha;
  return part;
}

V3f column(const float* m, int i) {
  return V3f(m[3 * i], m[3 * i + 1], m[3 * i + 2]);
}

InstanceTable instance_table(const InstanceRecord& record, std::uint32_t flat_count) {
  InstanceTable table{};
  for (int i = 0; i < 4; ++i) table.to_world[i] = column(record.to_world, i);
  for (int i = 0; i < 3; ++i) table.normal_to_world[i] = column(record.normal_to_world, i);
  const V3d x(table.to_world[0]), y(table.to_world[1]), z(table.to_world[2]);
  const double determinant = dot(x, cross(y, z));
  const V3d rows[3] = {cross(y, z) / determinant, cross(z, x) / determinant, cross(x, y) / determinant};
  for (int i = 0; i < 3; ++i) table.to_object[i] = V3f(V3d(rows[0][i], rows[1][i], rows[2][i]));
  table.first_part = flat_count + record.first_part;
  table.first_emitter_slot = record.first_emitter_slot;
  table.offset_scale = record.offset_scale;
  table.offset = record.offset;
  table.bvh_root = kBvhEmpty;
  return table;
}

// Calls visit(array as bytes, what it holds, address in the table) for each array of a mesh.
template <class Visit>
Status for_each_array(const TriangleMesh& mesh, PartTable& part, const Visit& visit) {
  const auto one = [&](const auto& values, const char* what, std::uint64_t& address) -> Status {
    if (values.empty()) return ok_status();
    return visit(std::as_bytes(std::span(values)), what, address);
  };
  Status done = one(mesh.positions, "vertices", part.positions);
  if (done) done = one(mesh.indices, "triangles", part.indices);
  if (done) done = one(mesh.normals, "vertex normals", part.normals);
  if (done) done = one(mesh.tangents, "tangents", part.tangents);
  if (done) done = one(mesh.colors, "vertex colours", part.colors);
  for (std::size_t set = 0; done && set < mesh.texcoords.size(); ++set) {
    done = one(mesh.texcoords[set], "texture coordinates", part.texcoords[set]);
  }
  return done;
}

}  // namespace

std::vector<std::uint32_t> SceneGeometry::first_instances() const {
  std::vector<std::uint32_t> first(object_count, kNone);
  for (std::size_t i = objects.size(); i-- > 0;) first[objects[i]] = std::uint32_t(i);
  return first;
}

std::uint64_t SceneGeometry::bytes() const {
  constexpr std::uint64_t kPadding = 16;  // of each upload
  std::uint64_t bytes = parts.size() * sizeof(PartTable) + instances.size() * sizeof(InstanceTable) +
                        instance_emitters.size() * sizeof(std::uint32_t) + 3 * kPadding;
  std::set<const TriangleMesh*> counted;
  for (const TriangleMesh* mesh : meshes) {
    if (!mesh || !counted.insert(mesh).second) continue;
    PartTable unused{};
    static_cast<void>(for_each_array(*mesh, unused, [&](std::span<const std::byte> array, const char*, std::uint64_t&) {
      bytes += array.size() + kPadding;
      return ok_status();
    }));
  }
  return bytes;
}

SceneGeometry make_geometry(const SceneData& scene) {
  SceneGeometry geometry;
  geometry.flat_count = std::uint32_t(scene.flat.size());
  const std::size_t count = scene.flat.size() + scene.object_parts.size();
  geometry.parts.reserve(count);
  geometry.meshes.reserve(count);
  geometry.traced.assign(count, true);
  for (const std::vector<PartRecord>* records : {&scene.flat, &scene.object_parts}) {
    for (const PartRecord& record : *records) {
      geometry.parts.push_back(part_table(scene, record));
      geometry.meshes.push_back(record.mesh);
    }
  }
  for (std::size_t i = 0; i < scene.flat.size(); ++i) geometry.traced[i] = !scene.is_taken_out(i);
  std::map<std::uint32_t, std::uint32_t> objects;  // by AccelInstance::object
  for (const InstanceRecord& record : scene.instances) {
    geometry.instances.push_back(instance_table(record, geometry.flat_count));
    geometry.part_counts.push_back(record.part_count);
    geometry.objects.push_back(objects.try_emplace(record.accel_object, std::uint32_t(objects.size())).first->second);
  }
  geometry.object_count = std::uint32_t(objects.size());
  geometry.instance_emitters = scene.instance_emitters;
  geometry.tables.ray_limit = scene.accel->ray_limit();
  geometry.tables.bvh_root = kBvhEmpty;
  for (std::size_t i = 0; i < count; ++i) {
    if (geometry.parts[i].flags & kPartSphere) geometry.tables.features |= kTraceSpheres;
    if (geometry.parts[i].flags & kPartAlpha) geometry.tables.features |= kTraceAlpha;
  }
  if (!geometry.instances.empty()) geometry.tables.features |= kTraceInstances;
  return geometry;
}

Status upload_meshes(SceneGeometry& geometry, Arena& arena) {
  std::map<const TriangleMesh*, std::size_t> uploaded;  // first part of a mesh
  for (std::size_t i = 0; i < geometry.parts.size(); ++i) {
    const TriangleMesh* const mesh = geometry.meshes[i];
    if (!mesh) continue;
    PartTable& part = geometry.parts[i];
    const auto [first, is_new] = uploaded.try_emplace(mesh, i);
    if (!is_new) {
      const PartTable& before = geometry.parts[first->second];
      part.positions = before.positions;
      part.indices = before.indices;
      part.normals = before.normals;
      part.tangents = before.tangents;
      part.colors = before.colors;
      std::copy(std::begin(before.texcoords), std::end(before.texcoords), part.texcoords);
      continue;
    }
    Status done = for_each_array(
        *mesh, part, [&](std::span<const std::byte> array, const char* what, std::uint64_t& address) -> Status {
          auto placed = arena.upload(array, 16, what);
          if (!placed) return std::move(placed).error();
          address = *placed;
          return ok_status();
        });
    if (!done) return done;
  }
  return ok_status();
}

Status upload_geometry(SceneGeometry& geometry, Arena& arena) {
  const auto upload = [&](const auto& values, const char* what, std::uint64_t& address) -> Status {
    auto placed = arena.upload(std::as_bytes(std::span(values)), 16, what);
    if (!placed) return std::move(placed).error();
    address = *placed;
    return ok_status();
  };
  Status done = upload(geometry.parts, "parts", geometry.tables.parts);
  if (done) done = upload(geometry.instances, "instances", geometry.tables.instances);
  if (done) done = upload(geometry.instance_emitters, "emitters of instances", geometry.tables.instance_emitters);
  return done;
}

}  // namespace helio::vulkan
