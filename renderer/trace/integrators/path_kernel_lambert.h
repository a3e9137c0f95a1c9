// The kernel for flat Lambert triangles: their vertices are shaded in batches (lambert_batch.h). Recorder: as
// path_recorder.h has them, of what all surfaces have in common.
#pragma once

#include <optional>

#include "renderer/trace/integrators/path_kernel_base.h"

namespace helio {

template <typename Recorder>
class LambertKernel : public PathKernelBase<LambertKernel<Recorder>, Recorder> {
  using Base = PathKernelBase<LambertKernel<Recorder>, Recorder>;

 public:
  using Base::Base;

 private:
  friend Base;
  using Base::add_emission, Base::add_shadow_ray, Base::alpha_key, Base::group_, Base::has_lights_, Base::leave_scene,
      Base::lights_, Base::reversed_index_, Base::scene_, Base::shadow_count_, Base::task_, Base::trace_shadow_rays;

  void prepare_paths(int) {}

  int shade(int vertex, int active) {
    shadow_count_ = 0;
    int survivors = 0;
    for (int j = 0; j < active;) {
      j = gather_lambert(vertex, j, active);
      survivors = shade_lambert(vertex, survivors);
    }
    trace_shadow_rays();
    return survivors;
  }

  // Takes the active paths from j on into the batch until it is full; those that met nothing end, and
  // what a surface emits is added. Returns the next j.
  int gather_lambert(int vertex, int j, int active) {
    PathGroup& b = group_;
    LambertBatch& batch = b.batch;
    const bool last = vertex >= task_.settings.max_segments && vertex > 1;  // nothing but emission counts
    int k = 0;
    for (; j < active && k < LambertBatch::kCapacity; ++j) {
      const std::uint32_t i = b.active[j];
      const Hit& hit = b.hits[i];
      if (!hit.valid()) {
        leave_scene(vertex, i);
        continue;
      }
      const Ray& ray = b.rays[i];
      const PathState& path = b.paths[i];
      const PartRecord& part = scene_.flat[hit.part];
      const MaterialRecord& material = scene_.materials[part.material];
      if (material.emissive) [[unlikely]]
        add_emission(vertex, i, hit, make_surface<false>(scene_, ray, hit));
      if (last) continue;
      batch.path[k] = i;
      batch.ray_origin.set(k, ray.origin);
      batch.ray_direction.set(k, ray.direction);
      batch.hit_normal.set(k, hit.normal);
      batch.travelled[k] = hit.t;
      batch.offset[k] = part.offset;
      batch.albedo.set(k, material.params.base_color);
      batch.one_sided[k] = material.one_sided;
      batch.beta.set(k, path.beta);
      batch.key[k] = path.key;
      batch.light_x[k] = b.light_x[j];
      batch.light_y[k] = b.light_y[j];
      batch.select[k] = b.select[j];
      batch.roulette[k] = b.roulette[j];
      batch.local.set(k, V3f(b.local_x[j], b.local_y[j], b.local_z[j]));
      ++k;
    }
    batch.count = k;
    return j;
  }

  // Shades the batch. Paths that go on are written to group_.active from `survivors` on; returns their
  // new number.
  int shade_lambert(int vertex, int survivors) {
    PathGroup& b = group_;
    LambertBatch& batch = b.batch;
    batch.find_surfaces();
    if (vertex == 1) {
      for (int k = 0; k < batch.count; ++k) {
        const std::uint32_t i = batch.path[k];
        const Hit& hit = b.hits[i];
        b.first[i] = {batch.albedo[k], batch.normal[k], hit.t, hit.primitive};
      }
    }
    if (vertex >= task_.settings.max_segments) return survivors;
    if (has_lights_) {
      batch.sample_lights(lights_, scene_.radius);
      for (int k = 0; k < batch.count; ++k) {
        if (!batch.shadow[k]) continue;
        add_shadow_ray(vertex, batch.path[k], batch.start[k], batch.light_direction[k], batch.light_distance[k],
                       batch.light_radiance[k]);
      }
    }
    const bool roulette = vertex >= task_.settings.roulette_from;
    batch.sample_directions(roulette ? std::optional(task_.settings.roulette) : std::nullopt);
    for (int k = 0; k < batch.count; ++k) {
      if (!batch.alive[k]) continue;
      const std::uint32_t i = batch.path[k];
      Ray& ray = b.rays[i];
      ray.origin = batch.start[k];
      ray.direction = batch.direction[k];
      ray.alpha_key = alpha_key(batch.key[k], reversed_index_, vertex + 1);
      PathState& path = b.paths[i];
      path.beta = batch.beta[k];
      path.pdf_w = batch.pdf_w[k];
      path.normal = batch.normal[k];
      b.active[survivors++] = i;
    }
    return survivors;
  }

  Rgb emitted(const Hit&, const Surface& surface) const {
    return surface.front || surface.material->double_sided ? surface.material->emission : Rgb(0, 0, 0);
  }
};

}  // namespace helio
