#include "renderer/trace/scene/surface_layers.h"

namespace helio {

namespace {

// A coat has its own normal: the smooth one, or that of its own map. Kept within the surface's hemisphere.
V3f coat_normal(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, const Surface& surface,
                const Frame& frame, const MaterialLayers& layers) {
  const TextureSlot* map = layers.clearcoat_normal_texture.present() ? &layers.clearcoat_normal_texture : nullptr;
  const V3f normal = normal_with_map(scene, hit, wo, footprint, surface, map, layers.clearcoat_normal_scale);
  const float side = dot(frame.n, surface.shading_normal) < 0 ? -1.0f : 1.0f;
  const V3f local = frame.to_local(normal * side);
  return local.z > 0.01f && is_finite(local) ? normalize(local) : V3f(0, 0, 1);
}

}  // namespace

Frame shading_frame(const Surface& surface) {
  const bool flip = !surface.front && !surface.material->volume;
  return Frame(flip ? -surface.shading_normal : surface.shading_normal);
}

V2f anisotropy_direction(const SceneData& scene, const Hit& hit, const Surface& surface, const Frame& frame, int uv_set,
                         const V2f& turn) {
  V3f tangent, bitangent;
  if (!surface_tangents(scene, hit, surface, uv_set, surface.shading_normal, tangent, bitangent)) return {1, 0};
  const V3f local = frame.to_local(tangent * turn.x + bitangent * turn.y);
  const float length = std::hypot(local.x, local.y);
  return length > 1e-6f ? V2f(local.x / length, local.y / length) : V2f(1, 0);
}

LayerParams evaluate_layers(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                            const Surface& surface, const Frame& frame) {
  LayerParams p = surface.material->layers;
  const Material& material = scene.description.materials[surface.part->material];
  const MaterialLayers& m = material.layers;
  const auto texel = [&](const TextureSlot& slot) { return surface_texel(scene, hit, surface, slot, footprint); };

  V2f turn = p.anisotropy_direction;
  if (surface.material->layers_textured) {
    if (m.clearcoat_texture.present()) p.clearcoat *= texel(m.clearcoat_texture).x;
    if (m.clearcoat_roughness_texture.present())
      p.clearcoat_alpha = sqr(m.clearcoat_roughness * texel(m.clearcoat_roughness_texture).y);
    if (m.sheen_color_texture.present()) {
      const V4f c = texel(m.sheen_color_texture);
      p.sheen_color *= Rgb(c.x, c.y, c.z);
    }
    if (m.sheen_roughness_texture.present())
      p.sheen_alpha = sqr(m.sheen_roughness * texel(m.sheen_roughness_texture).w);
    if (m.anisotropy_texture.present()) {
      const V4f c = texel(m.anisotropy_texture);
      p.anisotropy *= c.z;
      const V2f d(2 * c.x - 1, 2 * c.y - 1);
      turn = V2f(turn.x * d.x - turn.y * d.y, turn.y * d.x + turn.x * d.y);
    }
    if (m.iridescence_texture.present()) p.iridescence *= texel(m.iridescence_texture).x;
    if (m.iridescence_thickness_texture.present()) {
      const float low = m.iridescence_thickness_min, high = m.iridescence_thickness_max;
      p.film_thickness = std::min(low + (high - low) * texel(m.iridescence_thickness_texture).y, kThickestFilm);
    }
    if (m.diffuse_transmission_texture.present())
      p.diffuse_transmission *= texel(m.diffuse_transmission_texture).w;
    if (m.diffuse_transmission_color_texture.present()) {
      const V4f c = texel(m.diffuse_transmission_color_texture);
      p.diffuse_transmission_color *= Rgb(c.x, c.y, c.z);
    }
  }
  if (p.clearcoat > 0 && (surface.material->normal_mapped || m.clearcoat_normal_texture.present()))
    p.clearcoat_normal = coat_normal(scene, hit, wo, footprint, surface, frame, m);
  if (p.anisotropy > 0) {
    const TextureSlot& uv = m.anisotropy_texture.present() ? m.anisotropy_texture : material.normal_texture;
    p.anisotropy_direction = anisotropy_direction(scene, hit, surface, frame, uv.texcoord, turn);
  }
  return p;
}

}  // namespace helio
