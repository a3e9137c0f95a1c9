// From a hit to a surface that scatters: position with its error bound, normals, material with textures looked up.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/trace/scene/scene_data.h"

namespace helio {

// A ray that leaves a surface starts off it by (largest coordinate of the part) x kOffsetFactor plus (distance
// travelled) x kOffsetPerDistance. A float plane distance inside a part of extent E is off by at most about 6 x 2^-24 E
// (three products and the rounding of the vertices), the hit itself by 3 x 2^-24 of the distance: 16 and 8 units leave
// room.
inline constexpr float kOffsetFactor = 0x1p-20f;
inline constexpr float kOffsetPerDistance = 0x1p-21f;

struct Surface {
  V3f position;
  V3f geometric_normal;  // unit, front side
  V3f shading_normal;    // unit, same hemisphere as geometric_normal
  bool front = true;     // the ray arrived on the front side
  float offset = 0;      // see above
  float through = 0;     // the same for rays that pass through: shorter, for their length in a medium counts
  float travelled = 0;   // distance along the ray that arrived
  V2f barycentric;
  const PartRecord* part = nullptr;
  const MaterialRecord* material = nullptr;

  // Geometric, towards where the ray came from.
  V3f facing_normal() const { return front ? geometric_normal : -geometric_normal; }
};

// The geometric normal turned to the side of the shading frame's z axis (shading_frame()).
inline V3f viewed_normal(const Surface& s) {
  return !s.front && !s.material->volume ? -s.geometric_normal : s.geometric_normal;
}

inline const V3f& corner(const TriangleMesh& mesh, std::uint32_t primitive, int k) {
  return mesh.positions[mesh.indices[3 * std::size_t(primitive) + std::size_t(k)]];
}

// Position, geometric normal, offset. kGeneral: spheres, instances and vertex normals may occur.
template <bool kGeneral>
inline Surface make_surface(const SceneData& scene, const Ray& ray, const Hit& hit) {
  Surface s;
  s.position = ray.origin + ray.direction * hit.t;
  s.travelled = hit.t;
  s.barycentric = V2f(hit.u, hit.v);
  V3f normal = hit.normal;
  if (kGeneral && hit.instance != kNoHit) {
    const InstanceRecord& instance = scene.instances[hit.instance];
    s.part = &scene.object_parts[instance.first_part + hit.part];
    s.offset = s.part->offset * instance.offset_scale + instance.offset + hit.t * kOffsetPerDistance;
    s.through = s.offset;
    // Embree's normal follows the winding; the cofactor matrix keeps fronts in front under mirroring too.
    normal = instance.normal(normal);
  } else {
    s.part = &scene.flat[hit.part];
    s.offset = s.part->offset + hit.t * kOffsetPerDistance;
    s.through = s.part->through + hit.t * kOffsetPerDistance;
    if (kGeneral && !s.part->mesh) {
      // A point on a sphere is refined onto it: the ray's parameter loses digits far away.
      normal = normalize_any(s.position - s.part->center);
      s.position = s.part->center + normal * s.part->radius;
    }
  }
  s.geometric_normal = normalize_any(normal);
  s.front = dot(s.geometric_normal, ray.direction) <= 0;
  s.shading_normal = s.geometric_normal;
  s.material = &scene.materials[s.part->material];
  return s;
}

// Least cosine between the viewer and a shading normal.
inline constexpr float kLeastVisible = 1e-3f;

// Vertex normals, normal map: sets shading_normal, flipped into the geometric normal's hemisphere, and kept visible to
// the viewer: a shading normal that faces away from `wo` (unit, towards the viewer) is bent back to just above it. Of a
// surface that reflects specularly, the mirror image of `wo` about it is kept above the surface as well. `footprint`:
// see evaluate_material().
void interpolate_normal(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, Surface& surface);

// interpolate_normal()'s shading normal before it is bent to a viewer; reads nothing of `front` and `shading_normal`.
V3f unbent_normal(const SceneData& scene, const Hit& hit, float footprint, const Surface& surface);
// bent_normal() where the normal has to be moved, or may have to be.
V3f bend_normal(const V3f& unbent, const Surface& surface, const V3f& wo, bool front);
// Bends an unbent normal to the viewer at `wo`, who is on the side that `front` says.
inline V3f bent_normal(const V3f& unbent, const Surface& surface, const V3f& wo, bool front) {
  const bool seen = (front ? 1.0f : -1.0f) * dot(unbent, wo) >= kLeastVisible;
  return seen && !surface.material->specular ? unbent : bend_normal(unbent, surface, wo, front);
}

// False: interpolate_normal() leaves the shading normal at the geometric one.
inline bool has_shading_normals(const Surface& s) {
  return s.part->mesh && (s.part->smooth || s.material->normal_mapped);
}

// The shading normal turned towards the geometric one just so far that the mirror image of wo about it rises above the
// surface; as it is where that is so already. On coarse meshes the reflection of a grazing view about an interpolated
// normal dips below the triangle, and what a mirror would send there is lost: the mesh turns black. All unit;
// wo on the side of the geometric normal. Keeps dot(result, wo) > 0.
V3f bend_for_reflection(const V3f& normal, const V3f& geometric, const V3f& wo);

// The material's parameters with textures and vertex colours applied; `wo`: unit, to the viewer. Lookups are bilinear
// where `footprint` is 0, else in the level of their pyramids (on meshes, where there are any) that suits a square of
// this side in scene units.
SurfaceParams evaluate_material(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                                const Surface& surface);

// The base colour alone, as evaluate_material() has it.
Rgb evaluate_base_color(const SceneData& scene, const Hit& hit, float footprint, const Surface& surface);

// Emitted radiance of an emissive or unlit surface towards the side that was hit, no light sampler involved.
Rgb surface_emission(const SceneData& scene, const Hit& hit, const Surface& surface);

// What interpolate_normal() would make the shading normal with this normal map (null: none) instead of the material's.
V3f normal_with_map(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, const Surface& surface,
                    const TextureSlot* map, float scale);

// Tangent and bitangent (unit, world space, perpendicular to `normal`) at a hit: the mesh's own, else those of texture
// coordinates `uv_set`, of spheres along their parallels and meridians. False where there are none.
bool surface_tangents(const SceneData& scene, const Hit& hit, const Surface& surface, int uv_set, const V3f& normal,
                      V3f& tangent, V3f& bitangent);

// How far the surface moves in world space per unit of u and of v of texture coordinates `uv_set`: on triangles, and on
// spheres but for their poles. False where there are none.
bool surface_derivatives(const SceneData& scene, const Hit& hit, const Surface& surface, int uv_set, V3f& dp_du,
                         V3f& dp_dv);

// A texture at a hit; `footprint` as in evaluate_material().
V4f surface_texel(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& slot,
                  float footprint);

// Texture coordinates at a hit; (0, 0) where the mesh has none.
V2f surface_uv(const PartRecord& part, std::uint32_t primitive, const V2f& barycentric, int set);

// Texture coordinates at a hit on a mesh or a sphere.
V2f surface_uv_at(const Hit& hit, const Surface& surface, int set);

// Texture coordinates per unit of length on a triangle: the root of the ratio of its areas in both. 0: on spheres, and
// where there are no texture coordinates.
float uv_per_length(const SceneData& scene, const Hit& hit, const Surface& surface, int set);

// Alpha at a hit. `normal` is that of AlphaHit: where spheres take their texture coordinates from.
float surface_alpha(const SceneData& scene, const PartRecord& part, std::uint32_t primitive, const V2f& barycentric,
                    const V3f& normal);

// By how many offsets a start may lie back on the ray that arrived. Rays that graze need many to rise by one, and what
// is missing is made up along the normal, which lets rays slip behind a neighbour: with 8 one camera sample in a
// million leaks from a bumpy room without robust mode, with 64 none in four.
inline constexpr float kMostRetreat = 64;

// Where rays start that leave towards the side from which `arrived` (unit) came: `offset` off the surface, and that as
// far as possible back on the ray, at most to its own start. Nothing lies between there and here, for the ray has
// passed; straight off the surface, a start next to an edge could lie behind the neighbour: closed rooms would leak.
inline V3f near_side_origin(const V3f& position, const V3f& geometric_normal, bool front, float offset, float travelled,
                            const V3f& arrived) {
  const float cosine = std::fabs(dot(geometric_normal, arrived));
  const float back = std::min(std::min(kMostRetreat * offset, offset / std::max(cosine, 1e-3f)), travelled);
  const float lift = std::max(0.0f, offset - back * cosine);
  return position - arrived * back + geometric_normal * (front ? lift : -lift);
}
inline V3f near_side_origin(const Surface& s, const V3f& arrived) {
  return near_side_origin(s.position, s.geometric_normal, s.front, s.offset, s.travelled, arrived);
}

// How far a shadow ray goes that starts `offset` off its surface and meets a light's surface at `distance`, under the
// cosine cos_light (+inf: no surface): it stops short of it. Both ends are rounded; what is perpendicular to the light
// must be travelled along a slanted ray, hence the cosine.
inline float shadow_length(float distance, float cos_light, float offset, float scene_radius) {
  const float margin = offset + (distance + scene_radius) * kOffsetFactor;
  const float length = std::max(0.0f, distance - margin / std::max(cos_light, 1e-3f));
  return distance < std::numeric_limits<float>::infinity() ? length : distance;
}

// Where a ray along `direction` starts; `near_side` is near_side_origin(), worked out once for all rays of a vertex.
inline V3f origin_towards(const Surface& s, const V3f& near_side, const V3f& direction) {
  const float side = dot(s.geometric_normal, direction);
  if ((side >= 0) == s.front) return near_side;
  return s.position + s.geometric_normal * std::copysign(s.through, side);
}

// As above, of a surface that was reached along `arrived`.
inline V3f offset_origin(const Surface& s, const V3f& arrived, const V3f& direction) {
  return origin_towards(s, near_side_origin(s, arrived), direction);
}

}  // namespace helio
