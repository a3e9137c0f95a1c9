// What belongs to a hit: its part, corners and vertex attributes.
#ifndef GEOMETRY_GLSL
#define GEOMETRY_GLSL

#include "accel/ray.glsl"
#include "scene/scene.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Parts {
  PartTable at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Instances {
  InstanceTable at[];
};

// Index into GeometryTables::parts of a part as Hit numbers it.
uint part_index(uint part, uint instance) {
  return instance == kNone ? part : Instances(scene.geometry.instances).at[instance].first_part + part;
}
uint part_index(Hit hit) {
  return part_index(hit.part, hit.instance);
}
PartTable part_at(uint index) {
  return Parts(scene.geometry.parts).at[index];
}
PartTable part_of(Hit hit) {
  return part_at(part_index(hit));
}
InstanceTable instance_at(uint instance) {
  return Instances(scene.geometry.instances).at[instance];
}

bool is_sphere(PartTable part) {
  return (part.flags & kPartSphere) != 0;
}

// Index of the area emitter that was hit, or kNone.
uint emitter_of(Hit hit) {
  uint first;
  if (hit.instance == kNone) {
    first = Parts(scene.geometry.parts).at[hit.part].first_emitter;
  } else {
    const uint slot = Instances(scene.geometry.instances).at[hit.instance].first_emitter_slot;
    if (slot == kNone) return kNone;
    first = Uints(scene.geometry.instance_emitters).at[slot + hit.part];
  }
  return first == kNone ? kNone : first + hit.primitive;
}

uvec3 corner_indices(uint64_t indices, uint primitive) {
  Uints i = Uints(indices);
  return uvec3(i.at[3 * primitive], i.at[3 * primitive + 1], i.at[3 * primitive + 2]);
}
uvec3 corner_indices(PartTable part, uint primitive) {
  return corner_indices(part.indices, primitive);
}
vec3 corner(PartTable part, uint primitive, int k) {
  return Vec3s(part.positions).at[Uints(part.indices).at[3 * primitive + k]];
}

// Vertex attributes at barycentrics `b`; `values`: the address of an array of the part's.
vec2 interpolate_vec2(uint64_t values, uvec3 corners, vec2 b) {
  Vec2s v = Vec2s(values);
  return v.at[corners.x] * (1 - b.x - b.y) + v.at[corners.y] * b.x + v.at[corners.z] * b.y;
}
vec2 interpolate_vec2(uint64_t values, PartTable part, uint primitive, vec2 b) {
  return interpolate_vec2(values, corner_indices(part, primitive), b);
}
vec3 interpolate_vec3(uint64_t values, PartTable part, uint primitive, vec2 b) {
  const uvec3 i = corner_indices(part, primitive);
  Vec3s v = Vec3s(values);
  return v.at[i.x] * (1 - b.x - b.y) + v.at[i.y] * b.x + v.at[i.z] * b.y;
}
vec4 interpolate_vec4(uint64_t values, PartTable part, uint primitive, vec2 b) {
  const uvec3 i = corner_indices(part, primitive);
  Vec4s v = Vec4s(values);
  return v.at[i.x] * (1 - b.x - b.y) + v.at[i.y] * b.x + v.at[i.z] * b.y;
}

// Texture coordinates of a triangle of the part with this index; (0, 0) where its mesh has none.
vec2 texcoord_at(uint index, uint primitive, vec2 barycentric, int set) {
  if (set < 0 || set >= int(kTexcoordSets)) return vec2(0);
  Parts parts = Parts(scene.geometry.parts);
  const uint64_t texcoords = parts.at[index].texcoords[set];
  if (texcoords == 0) return vec2(0);
  return interpolate_vec2(texcoords, corner_indices(parts.at[index].indices, primitive), barycentric);
}
vec2 texcoord_of(PartTable part, uint primitive, vec2 barycentric, int set) {
  if (set < 0 || set >= int(kTexcoordSets)) return vec2(0);
  const uint64_t texcoords = part.texcoords[set];
  if (texcoords == 0) return vec2(0);
  return interpolate_vec2(texcoords, corner_indices(part, primitive), barycentric);
}

// These carry directions, normals and points from an object's space to the world.
vec3 instance_direction(InstanceTable instance, vec3 v) {
  return instance.to_world[0] * v.x + instance.to_world[1] * v.y + instance.to_world[2] * v.z;
}
vec3 instance_normal(InstanceTable instance, vec3 n) {
  return instance.normal_to_world[0] * n.x + instance.normal_to_world[1] * n.y + instance.normal_to_world[2] * n.z;
}
vec3 instance_point(InstanceTable instance, vec3 p) {
  return instance_direction(instance, p) + instance.to_world[3];
}

#endif
