// Vertices of many paths on flat Lambert surfaces, an array for each quantity. The loops over them have selections
// instead of branches, so they vectorise. Their arithmetic is that of the general kernel, operation by operation: both
// give the same bits.
#pragma once

#include <cstdint>
#include <optional>

#include "renderer/trace/bsdf/bsdf_lambert.h"
#include "renderer/trace/lights/light_sampler.h"
#include "renderer/trace/sampling/mis.h"
#include "renderer/trace/sampling/roulette.h"
#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/scene/surface.h"

namespace helio {

struct LambertBatch {
  // Fits into the first-level cache.
  static constexpr int kCapacity = 64;

  struct Vectors {
    float x[kCapacity], y[kCapacity], z[kCapacity];

    V3f operator[](int k) const { return {x[k], y[k], z[k]}; }
    void set(int k, const V3f& v) {
      x[k] = v.x;
      y[k] = v.y;
      z[k] = v.z;
    }
  };

  int count = 0;

  // What the caller fills in, for each vertex: the ray that arrived (from ray_origin along unit ray_direction by
  // `travelled`), the hit's normal (of any length), the part's offset, the material, the path's throughput and key, its
  // random numbers.
  std::uint32_t path[kCapacity];
  Vectors ray_origin, ray_direction, hit_normal;
  float travelled[kCapacity], offset[kCapacity];
  Vectors albedo;
  std::uint32_t one_sided[kCapacity];  // 1: black from behind
  Vectors beta;
  std::uint32_t key[kCapacity];
  float light_x[kCapacity], light_y[kCapacity], select[kCapacity], roulette[kCapacity];
  Vectors local;  // distributed by the cosine around +z

  // find_surfaces(): unit normal on the viewer's side, its cosine with the viewer's direction, where rays start. Albedo
  // becomes 0 and offset what holds at this distance.
  Vectors normal, start;
  float cos_o[kCapacity];
  std::uint32_t front[kCapacity];

  // sample_lights(): shadow rays from `start`, and what they bring when nothing is in the way. Those that can bring
  // nothing have shadow = 0.
  std::uint32_t shadow[kCapacity];
  Vectors light_direction, light_radiance;
  float light_distance[kCapacity], light_pdf_w[kCapacity], light_cos[kCapacity];
  std::uint32_t light_delta[kCapacity];

  // sample_directions(): 1 in `alive` where the path goes on along `direction`, throughput `beta`, density pdf_w.
  std::uint32_t alive[kCapacity];
  Vectors direction;
  float pdf_w[kCapacity];

  void find_surfaces() {
    std::uint32_t odd = 0;
    for (int k = 0; k < count; ++k) {
      const V3f n = hit_normal[k];
      const float squared = length_squared(n);
      odd |= ~(mask(squared >= 1e-30f) & mask(squared <= 1e30f));
      normal.set(k, n * (1.0f / std::sqrt(squared)));
    }
    for (int k = 0; odd != 0 && k < count; ++k) normal.set(k, normalize_any(hit_normal[k]));
    for (int k = 0; k < count; ++k) {
      const V3f arrived = ray_direction[k], n = normal[k];
      const float side = dot(n, arrived);
      const bool is_front = side <= 0;
      front[k] = is_front;
      cos_o[k] = std::fabs(side);
      offset[k] += travelled[k] * kOffsetPerDistance;
      const V3f position = ray_origin[k] + arrived * travelled[k];
      start.set(k, near_side_origin(position, n, is_front, offset[k], travelled[k], arrived));
      const float turn = is_front ? 1.0f : -1.0f, reflects = (one_sided[k] & ~mask(is_front)) != 0 ? 0.0f : 1.0f;
      normal.set(k, n * turn);
      albedo.set(k, albedo[k] * reflects);
    }
  }

  void sample_lights(const LightSampler& lights, float scene_radius) {
    if (lights.plain_quad()) {
      const AreaShape shape = lights.plain_quad()->shape;
      const Rgb radiance = lights.plain_quad()->radiance;
      std::uint32_t near = 0;
      for (int k = 0; k < count; ++k) {
        const V3f from = start[k];
        near |= mask(detail::is_near(shape, from));
        const ShapeSample sample = detail::sample_planar_area(shape, from, V2f(light_x[k], light_y[k]));
        light_direction.set(k, sample.direction);
        light_radiance.set(k, radiance);
        light_distance[k] = sample.distance;
        light_pdf_w[k] = sample.pdf_w;
        light_cos[k] = sample.cos_light;
        light_delta[k] = 0;
      }
      for (int k = 0; near != 0 && k < count; ++k) {
        if (detail::is_near(shape, start[k])) sample_light(lights, k);
      }
    } else {
      LightSampler::Query queries[kCapacity];
      LightSample samples[kCapacity];
      for (int k = 0; k < count; ++k) queries[k] = {start[k], normal[k], select[k], V2f(light_x[k], light_y[k])};
      lights.sample({queries, std::size_t(count)}, samples);
      for (int k = 0; k < count; ++k) set_light(k, samples[k]);
    }
    for (int k = 0; k < count; ++k) {
      const float cos_i = dot(light_direction[k], normal[k]);
      const BsdfValue value = evaluate_lambert(albedo[k], V3f(0, 0, cos_o[k]), V3f(0, 0, cos_i));
      const float density = light_pdf_w[k], found = mis_weight(density, value.pdf_w);
      const float weight = light_delta[k] != 0 ? 1.0f : found;
      const V3f emitted = light_radiance[k];
      shadow[k] = mask(density > 0) & any_light(emitted) & mask(cos_i * cos_i > 0) & any_light(value.f_cos);
      light_radiance.set(k, beta[k] * value.f_cos * emitted * (weight / density));
      light_distance[k] = shadow_length(light_distance[k], light_cos[k], offset[k], scene_radius);
    }
  }

  // No rule: every path goes on.
  void sample_directions(std::optional<RouletteRule> rule) {
    for (int k = 0; k < count; ++k) {
      const Frame frame(normal[k]);
      const V3f wi = local[k];
      const BsdfSample sample = sample_lambert(albedo[k], V3f(0, 0, cos_o[k]), wi);
      const V3f world = frame.to_world(wi);
      const V3f carried = beta[k] * albedo[k];
      direction.set(k, world);
      beta.set(k, carried);
      pdf_w[k] = sample.pdf_w;
      alive[k] = mask(sample.pdf_w > 0) & mask(dot(frame.n, world) * wi.z > 0) & any_light(carried);
    }
    if (!rule) return;
    for (int k = 0; k < count; ++k) {
      const V3f carried = beta[k];
      const float survival = survival_probability(*rule, carried);
      alive[k] &= mask(survives(roulette[k], survival));
      beta.set(k, carried * (1 / survival));
    }
  }

 private:
  // All ones or zeroes: compilers turn conjunctions of bools into branches.
  static std::uint32_t mask(bool b) { return b ? ~0u : 0u; }
  // Of non-negative channels, or NaN, which the film must see; is_black() would branch.
  static std::uint32_t any_light(const Rgb& c) { return mask(c.x + c.y + c.z != 0); }

  void sample_light(const LightSampler& lights, int k) {
    set_light(k, lights.sample(start[k], normal[k], select[k], V2f(light_x[k], light_y[k])));
  }
  void set_light(int k, const LightSample& sample) {
    light_direction.set(k, sample.direction);
    light_radiance.set(k, sample.radiance);
    light_distance[k] = sample.distance;
    light_pdf_w[k] = sample.pdf_w;
    light_cos[k] = sample.cos_light;
    light_delta[k] = sample.delta;
  }
};

}  // namespace helio
