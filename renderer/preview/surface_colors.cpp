#include "renderer/preview/surface_colors.h"

#include <algorithm>
#include <cmath>

namespace helio {
namespace {

// Side of a pixel, in texels, up to which a texture is looked up and from which on its mean is taken.
constexpr float kSharp = 0.75f, kBlurred = 3.0f;

Rgb mean_color(const TextureTable& textures, const TextureSlot& slot) {
  constexpr int kPoints = 32;  // along either side
  const int width = textures.width(slot.image), height = textures.height(slot.image);
  V3d sum(0, 0, 0);
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const V4f t = textures.texel(slot.image, slot.encoding, int((2 * i + 1) * std::int64_t(width) / (2 * kPoints)),
                                   int((2 * j + 1) * std::int64_t(height) / (2 * kPoints)));
      sum += V3d(t.x, t.y, t.z);
    }
  }
  return Rgb(sum / double(kPoints * kPoints));
}

}  // namespace

SurfaceColors::SurfaceColors(const RenderScene& scene) : scene_(scene.impl()) {
  materials_.resize(scene_.materials.size());
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    const Material& m = scene_.description.materials[i];
    OfMaterial& color = materials_[i];
    color.base = m.base_color;
    if (!m.base_color_texture.present()) continue;
    color.varies = true;
    color.texture = color.nearest = m.base_color_texture;
    color.nearest.filter = FilterMode::nearest;
    color.mean = mean_color(*scene_.textures, color.texture);
    color.texels = std::sqrt(float(scene_.textures->width(color.texture.image)) *
                             float(scene_.textures->height(color.texture.image)));
  }
  const auto note_vertex_colors = [&](const PartRecord& part) {
    if (part.mesh && !part.mesh->colors.empty()) materials_[part.material].varies = true;
  };
  std::for_each(scene_.flat.begin(), scene_.flat.end(), note_vertex_colors);
  std::for_each(scene_.object_parts.begin(), scene_.object_parts.end(), note_vertex_colors);
}

Rgb SurfaceColors::at(const Hit& hit, const Surface& surface, float footprint, Recent& recent) const {
  const OfMaterial& m = materials_[surface.part->material];
  Rgb color = m.base;
  if (surface.part->mesh && !surface.part->mesh->colors.empty()) {
    const TriangleMesh& mesh = *surface.part->mesh;
    const std::uint32_t* i = &mesh.indices[3 * std::size_t(hit.primitive)];
    const V4f c = mesh.colors[i[0]] * (1 - hit.u - hit.v) + mesh.colors[i[1]] * hit.u + mesh.colors[i[2]] * hit.v;
    color *= Rgb(c.x, c.y, c.z);
  }
  if (!m.texture.present()) return color;
  const int set = m.texture.texcoord;
  if (recent.part != surface.part || recent.primitive != hit.primitive || recent.instance != hit.instance)
    recent = {surface.part, hit.primitive, hit.instance, uv_per_length(scene_, hit, surface, set)};
  const float texels = footprint * recent.uv_per_length * m.texels;
  if (texels >= kBlurred) return color * m.mean;
  // Where a pixel covers a texel, interpolating between texels makes no difference that lasts.
  const bool magnified = texels < kSharp;
  const V4f t = scene_.textures->lookup(magnified ? m.texture : m.nearest, surface_uv_at(hit, surface, set));
  const float blur = magnified ? 0.0f : (texels - kSharp) / (kBlurred - kSharp);
  return color * (Rgb(t.x, t.y, t.z) * (1 - blur) + m.mean * blur);
}

}  // namespace helio
