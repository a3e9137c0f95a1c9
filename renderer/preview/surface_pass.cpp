#include "renderer/preview/surface_pass.h"

#include <limits>

#include "renderer/base/check.h"
#include "renderer/base/hash.h"
#include "renderer/film/core/film.h"
#include "renderer/trace/gbuffer/primary_hits.h"

namespace helio {
namespace {

std::uint16_t surface_name(std::uint32_t instance, std::uint32_t material) {
  return std::uint16_t(hash32(instance * 0x9e3779b9u ^ material) | 1u);
}

Rgb finite_light(const Rgb& light) {
  return is_finite(light) ? light : Rgb(0, 0, 0);
}

}  // namespace

Ray SurfacePass::centre_ray(const PixelPosition& at) const {
  const CameraRay camera = camera_.centre_ray(at.x, at.y);
  return {camera.origin, std::numeric_limits<float>::infinity(), camera.direction, kCentreAlphaKey};
}

void SurfacePass::note(const Ray& ray, const Hit& hit, SurfaceColors::Recent& recent, PreviewPixel& pixel,
                       std::uint32_t& color) const {
  pixel = {};
  color = kWhite;
  if (!hit.valid()) {
    pixel.depth = std::numeric_limits<float>::infinity();
    pixel.set_light(finite_light(scene_.lights->environment_radiance(ray.direction)));
    pixel.samples = kExactSamples;
    return;
  }
  const Surface surface = make_surface<true>(scene_, ray, hit);
  const MaterialRecord& material = *surface.material;
  pixel.depth = hit.t * dot(ray.direction, camera_.forward());
  pixel.surface = surface_name(scene_.instance_name(hit), surface.part->material);
  pixel.set_normal(surface.facing_normal());
  if (material.one_sided && !surface.front) {
    pixel.samples = kExactSamples;
    return;
  }
  if (material.emissive || material.unlit) {
    const Rgb emission = finite_light(surface_emission(scene_, hit, surface));
    if (!is_black(emission) || material.unlit) {
      pixel.set_light(emission);
      pixel.samples = kExactSamples;
      return;
    }
  }
  if (!colors_ || !colors_->varies(surface.part->material)) return;
  RayCone cone = camera_.cone();
  cone.advance(hit.t);
  const float cosine = dot(surface.geometric_normal, ray.direction);
  color = pack_color(colors_->at(hit, surface, cone.footprint(cosine), recent));
}

void SurfacePass::trace(std::span<const PixelPosition> at, PreviewPixel* pixels, std::uint32_t* colors) const {
  HELIO_DCHECK(at.size() <= kMostAtOnce);
  Ray rays[kMostAtOnce];
  Hit hits[kMostAtOnce];
  std::uint32_t order[kMostAtOnce] = {};
  for (std::uint32_t i = 0; i < at.size(); ++i) {
    rays[i] = centre_ray(at[i]);
    order[i] = i;
  }
  scene_.accel->intersect(rays, order, std::uint32_t(at.size()), hits, RayOrder::camera);
  SurfaceColors::Recent recent;
  for (std::size_t i = 0; i < at.size(); ++i) note(rays[i], hits[i], recent, pixels[i], colors[i]);
}

void SurfacePass::note_miss(const PixelPosition& at, PreviewPixel& pixel, std::uint32_t& color) const {
  SurfaceColors::Recent recent;
  note(centre_ray(at), Hit(), recent, pixel, color);
}

std::uint64_t SurfacePass::run(const PixelRect& block) const {
  constexpr int kTile = 4;  // neighbours share a packet
  HELIO_DCHECK(block.area() <= std::int64_t(kMostAtOnce));
  PixelPosition at[kMostAtOnce];
  std::size_t count = 0;
  for (int ty = block.y0; ty < block.y1; ty += kTile) {
    for (int tx = block.x0; tx < block.x1; tx += kTile) {
      for (int y = ty; y < std::min(ty + kTile, block.y1); ++y) {
        for (int x = tx; x < std::min(tx + kTile, block.x1); ++x) at[count++] = {x, y};
      }
    }
  }
  PreviewPixel pixels[kMostAtOnce];
  std::uint32_t colors[kMostAtOnce];
  trace({at, count}, pixels, colors);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t pixel = history_.index(at[i].x, at[i].y);
    history_.current.pixels[pixel] = pixels[i];
    history_.colors[pixel] = colors[i];
  }
  return count;
}

}  // namespace helio
