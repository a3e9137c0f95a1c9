// Meshes, spheres, instances and what rays are traced in, as the shaders read them. Made by scene/geometry_tables.cpp,
// scene/bvh.cpp and scene/acceleration_structures.cpp.
#ifndef HELIO_VULKAN_TABLES_GEOMETRY_H
#define HELIO_VULKAN_TABLES_GEOMETRY_H

#include "base.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

HELIO_CONSTANT kTexcoordSets = 4u;  // kMaxTexcoordSets

// Bits of PartTable::flags.
HELIO_CONSTANT kPartSphere = 1u;
HELIO_CONSTANT kPartSmooth = 2u;  // has vertex normals
HELIO_CONSTANT kPartAlpha = 4u;   // hits are subject to opaque_at()

// A PartRecord with its mesh: addresses of TriangleMesh's arrays, 0 where a mesh has none.
struct PartTable {
  uint64_t positions;  // vec3[]
  uint64_t indices;    // uint[], 3 a triangle
  uint64_t normals;    // vec3[]
  uint64_t tangents;   // vec4[]
  uint64_t colors;     // vec4[]
  uint64_t texcoords[kTexcoordSets];  // vec2[]
  vec3 center;         // of a sphere, as `radius`
  float radius;
  uint material;
  uint first_emitter;  // flat parts: emitter of primitive 0, or kNone
  uint flags;
  float offset, through;
  uint padding;
};

// An InstanceRecord, with matrices by columns.
struct InstanceTable {
  vec3 to_world[4];         // the last column is the translation
  vec3 normal_to_world[3];
  vec3 to_object[3];        // inverse of the first three columns of to_world
  uint first_part;          // into GeometryTables::parts
  uint first_emitter_slot;  // into GeometryTables::instance_emitters, by part; kNone: emits nothing
  float offset_scale, offset;
  uint bvh_root;            // reference to the object's tree (BvhNode)
  float bvh_slack;          // as GeometryTables::bvh_slack, of the object's tree
};

// A node of our own BVH: up to four children. Their boxes are in units of 2^e above the least corner of all, with an e
// for each axis, and never too small (Ylitie, Karras and Laine 2017). `exponents`: the bytes of x, y and z, biased as
// those of a float. A reference to a child is the index of a node, or has its highest bit set:
// kBvhLeaf | count << kBvhCountShift | first triangle of a leaf, or kBvhInstance | index of the instance. Leaves
// without triangles stand for children that are not there.
struct BvhNode {
  vec3 origin;
  uint exponents;
  uint children[4];
  uint lower[3];  // by axis, a byte a child
  uint upper[3];
  uint padding[2];
};
HELIO_CONSTANT kBvhLeaf = 0x80000000u;
HELIO_CONSTANT kBvhInstance = 0xc0000000u;
HELIO_CONSTANT kBvhCountShift = 27u;
HELIO_CONSTANT kBvhCountMask = 7u;
HELIO_CONSTANT kBvhFirstMask = (1u << 27) - 1u;
HELIO_CONSTANT kBvhInstanceMask = (1u << 30) - 1u;
HELIO_CONSTANT kBvhEmpty = kBvhLeaf;
HELIO_CONSTANT kBvhStackSize = 96u;  // references that a traversal keeps at most

// A triangle of a leaf, or a sphere: its centre is `a`, its radius b.x.
struct BvhTriangle {
  vec3 a;
  uint part;  // as in Hit, with kBvhAlpha and kBvhSphere
  vec3 b;
  uint primitive;
  vec3 c;
  uint padding;
};
HELIO_CONSTANT kBvhAlpha = 0x80000000u;
HELIO_CONSTANT kBvhSphere = 0x40000000u;
HELIO_CONSTANT kBvhPartMask = 0x3fffffffu;

// What an instance of the top-level acceleration structure is, by its index. Its geometries are parts of one kind.
struct RayInstanceTable {
  uint instance;    // as in Hit
  uint first_part;  // into GeometryTables::ray_parts, by geometry
};

// What there is besides opaque triangles: GeometryTables::features, and the specialisation constant kTraceFeatures.
HELIO_CONSTANT kTraceAlpha = 1u;
HELIO_CONSTANT kTraceSpheres = 2u;
HELIO_CONSTANT kTraceInstances = 4u;

struct GeometryTables {
  uint64_t parts;              // PartTable[]: flat parts, then parts of instanced objects
  uint64_t instances;          // InstanceTable[]
  uint64_t instance_emitters;  // uint[]: emitter of a part's primitive 0, or kNone
  uint64_t bvh_nodes;          // BvhNode[]; 0 where rays are traced by acceleration structures
  uint64_t bvh_triangles;      // BvhTriangle[]
  uint64_t top_level;          // device address of the top-level acceleration structure; 0: own BVH
  uint64_t ray_instances;      // RayInstanceTable[]
  uint64_t ray_parts;          // uint[]: part of a geometry
  uint bvh_root;               // reference to the tree of the top level
  float bvh_slack;             // largest coordinate in the tree
  float ray_limit;             // rays whose coordinates add up to more are not traced
  uint features;
};

#ifdef __cplusplus
static_assert(sizeof(PartTable) == 112);
static_assert(sizeof(InstanceTable) == 144);
static_assert(sizeof(BvhNode) == 64);
static_assert(sizeof(BvhTriangle) == 48);
static_assert(sizeof(GeometryTables) == 80);
}  // namespace helio::vulkan
#endif

#endif
