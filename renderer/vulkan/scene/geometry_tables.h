// Meshes, spheres and instances of a scene, made ready for the device: shaders/tables/geometry.h.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/shaders/tables/geometry.h"

namespace helio::vulkan {

// The tables of parts and instances, on the host. Vertex arrays stay where the scene has them, which must outlive this.
struct SceneGeometry {
  std::vector<PartTable> parts;             // flat parts, then parts of instanced objects; addresses: after uploading
  std::vector<const TriangleMesh*> meshes;  // by part; null: a sphere
  std::vector<bool> traced;                 // by part: false for flat parts whose object an edit has moved
  std::vector<InstanceTable> instances;
  std::vector<std::uint32_t> instance_emitters;
  std::vector<std::uint32_t> objects;      // by instance: the same number for instances of the same parts
  std::vector<std::uint32_t> part_counts;  // by instance
  std::uint32_t flat_count = 0;
  std::uint32_t object_count = 0;
  GeometryTables tables{};  // ray_limit, features; addresses: after uploading

  // Index of the first instance of each object.
  std::vector<std::uint32_t> first_instances() const;
  // Bytes of device memory that upload_meshes() and upload_geometry() take, alignment included.
  std::uint64_t bytes() const;
};

SceneGeometry make_geometry(const SceneData& scene);

// Uploads the vertex arrays, each mesh once, and sets the addresses in `geometry.parts`.
Status upload_meshes(SceneGeometry& geometry, Arena& arena);
// Uploads the tables and sets their addresses in `geometry.tables`; after upload_meshes(), and after the BVH, which
// keeps the roots of objects in `geometry.instances`.
Status upload_geometry(SceneGeometry& geometry, Arena& arena);

}  // namespace helio::vulkan
