// Where a camera ray meets a surface: its material's parameters as the path kernels see them at the first vertex.
#pragma once

#include "renderer/trace/camera.h"
#include "renderer/trace/surface.h"
#include "renderer/trace/surface_layers.h"

namespace helio {

// `params` may point to `layers`.
struct ShadingPoint {
  Surface surface;
  SurfaceParams params;
  LayerParams layers;
  Frame frame;
  bool black = false;  // one-sided, seen from behind

  ShadingPoint(const SceneData& scene, const Camera& camera, const Ray& ray, const Hit& hit) {
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
  ShadingPoint(const ShadingPoint&) = delete;
};

}  // namespace helio
