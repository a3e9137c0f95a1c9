#include "renderer/trace/centre_hits.h"

#include <array>
#include <cmath>
#include <limits>

#include "renderer/film/packed_values.h"
#include "renderer/trace/sampler.h"
#include "renderer/trace/surface.h"
#include "renderer/trace/surface_layers.h"

namespace helio {
namespace {

constexpr int kMostPixels = kPathGroupSize * kPathGroupSize;
constexpr int kDirections = 4;  // of view_change()

// A surface with its material's parameters, as the path kernels see it at the first vertex.
struct Shading {
  Surface surface;
  SurfaceParams params;
  LayerParams layers;
  Frame frame;
  bool black = false;

  Shading(const SceneData& scene, const Camera& camera, const Ray& ray, const Hit& hit) {
    surface = make_surface<true>(scene, ray, hit);
    const MaterialRecord& material = *surface.material;
    const V3f wo = -ray.direction;
    float footprint = 0;
    if (scene.mip_mapped) {
      RayCone cone = camera.cone();
      cone.advance(hit.t);
      footprint = cone.footprint(dot(surface.geometric_normal, wo));
    }
    if (surface.part->smooth || material.normal_mapped) interpolate_normal(scene, hit, wo, footprint, surface);
    params = evaluate_material(scene, hit, wo, footprint, surface);
    frame = shading_frame(surface);
    if (params.model == LobeModel::stack) {
      layers = evaluate_layers(scene, hit, wo, footprint, surface, frame);
      params.layers = &layers;
    }
    black = material.one_sided && !surface.front;
  }
  Shading(const Shading&) = delete;
};

// wo, from: local.
float view_change(const SurfaceParams& params, const V3f& wo, const V3f& from, std::uint32_t key) {
  if (params.model == LobeModel::none) return 0;
  if (params.model == LobeModel::lambert && !params.mapped) return 0;
  if (!(from.z * wo.z > 0)) return 1;
  float whole = 0, changed = 0;
  for (int k = 0; k < kDirections; ++k) {
    const SamplePair u = sample_pair(key, reverse_bits(std::uint32_t(k)), 0);
    const BsdfSample sample = sample_bsdf(params, wo, (float(k) + 0.5f) / kDirections, V2f(u.x, u.y));
    if (!sample.valid()) continue;
    const float weight = luminance(sample.weight);
    whole += weight;
    const float there = sample.delta ? 0.0f : luminance(evaluate_bsdf(params, from, sample.wi).f_cos) / sample.pdf_w;
    changed += std::fabs(there - weight);
  }
  return whole > 0 ? std::min(changed / whole, 1.0f) : 0.0f;
}

}  // namespace

struct CentreHits::Block {
  PixelRect window;
  Ray rays[kMostPixels];
  Hit hits[kMostPixels];
  std::uint32_t order[kMostPixels];
  std::uint32_t slot[kMostPixels];  // of a pixel of the window, row-major: its ray

  std::size_t at(int x, int y) const {
    return slot[std::size_t(y - window.y0) * std::size_t(window.width()) + std::size_t(x - window.x0)];
  }
};

CentreHits::CentreHits(const RenderScene& scene, const Camera& camera, const V3d& axis)
    : scene_(scene.impl()),
      camera_(camera),
      axis_(axis),
      only_lambert_(scene.features().only_lambert),
      block_(std::make_unique<Block>()) {}

CentreHits::~CentreHits() = default;

void CentreHits::trace(const PixelRect& window) {
  constexpr int kTile = 4;  // neighbours share a packet
  Block& b = *block_;
  b.window = window;
  std::uint32_t count = 0;
  for (int ty = window.y0; ty < window.y1; ty += kTile) {
    for (int tx = window.x0; tx < window.x1; tx += kTile) {
      for (int y = ty; y < std::min(ty + kTile, window.y1); ++y) {
        for (int x = tx; x < std::min(tx + kTile, window.x1); ++x) {
          const CameraRay camera = camera_.generate_ray(x, y, V2f(0.5f, 0.5f), V2f(0.5f, 0.5f));
          Ray& ray = b.rays[count];
          ray.origin = camera.origin;
          ray.direction = camera.direction;
          ray.t_max = std::numeric_limits<float>::infinity();
          ray.alpha_key = 0x9e3779b9u;
          b.order[count] = count;
          b.slot[std::size_t(y - window.y0) * std::size_t(window.width()) + std::size_t(x - window.x0)] = count;
          ++count;
        }
      }
    }
  }
  scene_.accel->intersect(b.rays, b.order, count, b.hits, RayOrder::camera);
}

CentreHit CentreHits::at(int x, int y, std::span<const V3f> viewpoints, float* view_changes) const {
  const std::size_t i = block_->at(x, y);
  const Ray& ray = block_->rays[i];
  const Hit& hit = block_->hits[i];
  CentreHit centre;
  std::fill_n(view_changes, viewpoints.size(), 0.0f);
  if (!hit.valid()) return centre;
  centre.depth = hit.t * dot(ray.direction, axis_);
  centre.instance = hit.instance != kNoHit ? scene_.instance_names[hit.instance] : scene_.flat_names[hit.part];
  const auto facing = [](const Surface& s) { return s.front ? s.geometric_normal : -s.geometric_normal; };
  if (only_lambert_) {
    const Surface surface = make_surface<true>(scene_, ray, hit);
    if (!surface.material->textured) {
      centre.normal = pack_direction(facing(surface));
      centre.albedo = pack_reflectance(surface.material->params.base_color);
      return centre;
    }
  }
  const Shading shading(scene_, camera_, ray, hit);
  const V3f wo = shading.frame.to_local(-ray.direction);
  centre.normal = pack_direction(facing(shading.surface));
  if (shading.black) return centre;
  // A point of a texture is not the mean over a pixel, and the mean of ratios of points not that of their means (+1.5 %
  // in Sponza): only where textures are filtered does their albedo count.
  const bool point_of_texture = shading.surface.material->textured && !scene_.mip_mapped;
  const Rgb albedo = point_of_texture ? Rgb(1, 1, 1) : surface_albedo(shading.params, wo);
  centre.albedo = pack_reflectance(albedo);
  for (std::size_t k = 0; k < viewpoints.size(); ++k) {
    const V3f from = shading.frame.to_local(normalize_any(viewpoints[k] - shading.surface.position));
    view_changes[k] = view_change(shading.params, wo, from, pixel_key(x, y, 0, 0));
  }
  return centre;
}

int CentreHits::material(int x, int y) const {
  const Hit& hit = block_->hits[block_->at(x, y)];
  return hit.valid() ? int(scene_.part(hit).material) : -1;
}

}  // namespace helio
