#include "renderer/trace/scene/surface_blend.h"

#include <array>

namespace helio {

namespace {

// The blends of one hit, and how many are taken: recursion over the parts fills it from the outermost on.
struct Pool {
  std::array<BlendParams, kMostBlends> blends;
  int used = 0;
  int depth = 0;
};
thread_local Pool pool;

float blend_weight(const SceneData& scene, const Hit& hit, float footprint, const Surface& surface,
                   const BlendMaterial& blend) {
  if (blend.by_side) return surface.front ? 0.0f : 1.0f;
  if (!blend.weight_texture.present()) return blend.weight;
  const V4f texel = surface_texel(scene, hit, surface, blend.weight_texture, footprint);
  const float weight = blend.weight * luminance(Rgb(texel.x, texel.y, texel.z));
  return weight >= 0 ? std::min(weight, 1.0f) : 0.0f;
}

// The same surface made of another material.
SurfaceParams evaluate_part(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                            const Surface& surface, int material) {
  PartRecord part = *surface.part;
  part.material = std::uint32_t(material);
  Surface own = surface;
  own.part = &part;
  own.material = &scene.materials[part.material];
  SurfaceParams params = evaluate_material(scene, hit, wo, footprint, own);
  // Seen from behind, in a frame that was turned to the viewer.
  if (own.material->one_sided && !surface.front) params.model = LobeModel::none;
  return params;
}

}  // namespace

const BlendParams* evaluate_blend_parts(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                                        const Surface& surface) {
  if (pool.depth == 0) pool.used = 0;
  BlendParams& params = pool.blends[std::size_t(std::min(pool.used++, kMostBlends - 1))];
  const BlendMaterial& blend = scene.description.materials[surface.part->material].blend;
  ++pool.depth;
  params.weight = blend_weight(scene, hit, footprint, surface, blend);
  params.first = evaluate_part(scene, hit, wo, footprint, surface, blend.first);
  params.second = evaluate_part(scene, hit, wo, footprint, surface, blend.second);
  --pool.depth;
  return &params;
}

}  // namespace helio
