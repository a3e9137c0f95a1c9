// The lights of a scene in device memory: LightSampler and the values that it is made of. Made by
// scene/light_tables.cpp. Lights are numbered as LightSampler numbers them: areas, punctual lights at a place,
// directional lights, environment.
#ifndef HELIO_VULKAN_TABLES_LIGHTS_H
#define HELIO_VULKAN_TABLES_LIGHTS_H

#include "base.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

// Bits of the specialisation constant kLightFeatures (light_features.glsl) that say what lights a scene has; more are
// in textures.h.
HELIO_CONSTANT kHasTriangles = 1u, kHasParallelograms = 2u, kHasSpheres = 4u, kHasEllipsoids = 8u;  // area lights
HELIO_CONSTANT kHasLightTextures = 16u, kHasLightAlphas = 32u;
HELIO_CONSTANT kHasPunctual = 64u, kHasProjectors = 128u;
HELIO_CONSTANT kHasConstantEnvironment = 256u, kHasEnvironmentMap = 512u;
HELIO_CONSTANT kHasPowerSelection = 1024u, kHasLightTree = 2048u, kHasInfiniteSelection = 4096u;

// Bits of AreaLightTable::flags: the lowest ones hold a ShapeKind.
HELIO_CONSTANT kShapeTriangle = 0u, kShapeParallelogram = 1u, kShapeSphere = 2u, kShapeEllipsoid = 3u;
HELIO_CONSTANT kShapeKindMask = 3u, kShapeTwoSided = 4u;

// An AreaLight with its AreaShape, as shaders read it.
struct AreaLightTable {
  vec3 p0, e1, e2, e3, normal, center;
  float area, near_squared, radius;
  vec3 radiance;
  vec2 uv, uv_s, uv_t;
  uint flags;
  uint slot;   // of the emission's texture, into LightTables::slots; kNone: none
  uint alpha;  // into LightTables::alphas; kNone: opaque
};

// A LightAlpha as shaders read it.
struct LightAlphaTable {
  vec2 uv, uv_s, uv_t;
  float factor, factor_s, factor_t;
  float cutoff;
  uint mask;  // 0 or 1
  uint slot;  // as AreaLightTable::slot
};

// Values of PunctualLightTable::kind: PunctualKind.
HELIO_CONSTANT kPunctualPoint = 0u, kPunctualSpot = 1u, kPunctualDirectional = 2u, kPunctualProjector = 3u;

// A PunctualSource as shaders read it.
struct PunctualLightTable {
  vec3 position, direction, intensity;
  float inverse_range, cone_scale, cone_offset;
  uint kind;
  uint linear_cone;  // 0 or 1
  uint projector;    // into LightTables::projectors
};

// A Projector as shaders read it.
struct ProjectorTable {
  vec3 across, down, depth, axis;
  uint slot;  // of the picture, as AreaLightTable::slot
};

// An AreaEmitter as shaders read it: what a ray finds that hits it.
struct EmitterTable {
  vec3 radiance;
  uint light;      // kNone: never sampled
  uint slot;       // as AreaLightTable::slot
  uint two_sided;  // 0 or 1
};

// An AliasTable::Bin as shaders read it.
struct AliasBinTable {
  float threshold;
  uint alias;
  float probability;
};

HELIO_CONSTANT kLightTreeWidth = 8u, kLightTreeLeaf = 0x80000000u;

// A child of a LightTree::Node; a node is kLightTreeWidth of them.
struct LightTreeChildTable {
  vec4 ball;      // centre and radius of the bounding ball
  vec4 cone;      // axis and cos_theta_o
  vec4 emission;  // cos_theta_e, one_sided, intensity, range
  uint child;     // a node, or kLightTreeLeaf | light
  float spread;   // added to the squared distance to the centre
  uint padding[2];
};

// An EnvironmentMap with its EnvironmentDistribution, as shaders read it.
struct EnvironmentLightTable {
  uint64_t column_cdf;  // uint[rows][columns]
  uint64_t row_cdf;     // uint[rows]
  uint64_t row_cos;     // double[rows + 1]
  uint64_t density;     // float[rows]
  vec3 scale;           // times the map, or the constant radiance; black where there is no environment
  vec3 axes[3];         // world directions of the map's axes
  uint slot;           // of the map, into LightTables::slots; kNone: the environment is constant
  uint columns, rows;  // 0: no distribution
  uint padding;
};

// Values of LightTables::selection.
HELIO_CONSTANT kSelectionNone = 0u, kSelectionOne = 1u, kSelectionPower = 2u, kSelectionTree = 3u;

struct LightTables {
  uint64_t areas;        // AreaLightTable[area_count]
  uint64_t punctual;     // PunctualLightTable[punctual_count]
  uint64_t projectors;   // ProjectorTable[]
  uint64_t emitters;     // EmitterTable[]
  uint64_t alphas;       // LightAlphaTable[]
  uint64_t slots;        // TextureSlotTable[]
  uint64_t power;        // AliasBinTable[power_count]
  uint64_t infinite;     // AliasBinTable[infinite_count]
  uint64_t nodes;        // LightTreeChildTable[][kLightTreeWidth], the root first
  uint64_t node_places;  // uint[], by node: parent * kLightTreeWidth + slot
  uint64_t places;       // uint[], by light: node * kLightTreeWidth + slot
  EnvironmentLightTable environment;
  uint selection;
  uint environment_light;  // 0 or 1: the environment is one of the lights
  uint area_count, punctual_count;
  uint finite_count;  // lights before the first directional one
  uint power_count, infinite_count;
  float infinite_probability;
};

#ifdef __cplusplus
static_assert(sizeof(AreaLightTable) == 132);
static_assert(sizeof(LightAlphaTable) == 48);
static_assert(sizeof(PunctualLightTable) == 60);
static_assert(sizeof(ProjectorTable) == 52);
static_assert(sizeof(EmitterTable) == 24);
static_assert(sizeof(AliasBinTable) == 12);
static_assert(sizeof(LightTreeChildTable) == 64);
static_assert(sizeof(EnvironmentLightTable) == 96);
static_assert(sizeof(LightTables) == 216);
}  // namespace helio::vulkan
#endif

#endif
