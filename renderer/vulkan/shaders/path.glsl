// One sample of one pixel from the camera to the end of its path: path_kernel_base.h, camera_path_kernel.h and
// path_kernel_general.h of trace/integrators/. The includer declares the push constants and names its tracer:
//
//   layout(push_constant, scalar) uniform Push { uint64_t scene; uint64_t task; } push;
//   #include "accel/trace_bvh.glsl" or "trace_rt.glsl"   intersect(), occluded()
#ifndef PATH_GLSL
#define PATH_GLSL

#include "tables/scene.h"

// What the scene may need. Compilers leave out the code for the rest.
layout(constant_id = 3) const uint kPathFeatures = 0xffffffffu;
bool has_path_feature(uint feature) {
  return (kPathFeatures & feature) != 0;
}

#include "bsdf/bsdf.glsl"
#include "camera.glsl"
#include "scene/evaluate_material.glsl"
#include "base/frame.glsl"
#include "lights/light_sampler.glsl"
#include "scene/media.glsl"
#include "sampling/mis.glsl"
#include "sampling/roulette.glsl"
#include "sampling/sampler.glsl"
#include "scene/surface.glsl"
#include "tables/task.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer PathTaskBuffer {
  PathTask task;
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer PathAnswers {
  PathAnswer at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer FirstHitAnswers {
  FirstHitAnswer at[];
};

struct Path {
  Ray ray;
  vec3 beta;        // throughput from the camera to this vertex
  float pdf_w;      // of the direction that was sampled last; 0: camera ray or delta
  vec3 radiance;
  float eta_scale;  // product of squared relative iors
  vec3 normal;      // what the light sampler was told at the last vertex
  uint key, reversed_index;
  MediumStack media;
  FirstHitAnswer first;
  uint rays, shadow_rays, media_overflows;
};

// Ends a path that met nothing: adds the environment's radiance.
void leave_scene(inout Path path, int vertex) {
  if (vertex == 1) path.first = FirstHitAnswer(vec3(0), vec3(0), kInfinity, kNone);
  if (!is_finite(path.ray.direction)) {
    path.radiance = vec3(kNotANumber);  // not traced: the film counts an invalid sample
    return;
  }
  const vec3 radiance = environment_radiance(path.ray.direction);
  if (is_black(radiance)) return;
  float weight = 1;
  if (path.pdf_w > 0)
    weight = mis_weight(path.pdf_w, light_pdf_w_environment(path.ray.origin, path.normal, path.ray.direction));
  path.radiance += path.beta * radiance * weight;
}

// Adds what the surface that the path met emits.
void add_emission(inout Path path, Hit hit, Surface surface) {
  const vec3 radiance = surface_emission(hit, surface);
  if (is_black(radiance)) return;
  const uint emitter = emitter_of(hit);
  float weight = 1;
  if (emitter != kNone && path.pdf_w > 0) {
    const float cos_light = -dot(surface.geometric_normal, path.ray.direction);
    const float pdf = light_pdf_w_area(path.ray.origin, path.normal, path.ray.direction, emitter, hit.t, cos_light);
    weight = mis_weight(path.pdf_w, pdf);
  }
  path.radiance += path.beta * radiance * weight;
}

// Traces the path to its next vertex and scatters there. False where the path ends.
bool shade_vertex(inout Path path, int vertex, PathTask task) {
  const Hit hit = intersect(path.ray);
  ++path.rays;
  if (hit.part == kNone) {
    leave_scene(path, vertex);
    return false;
  }
  Surface surface = make_surface(path.ray, hit);
  const uint material_flags = material_of(surface.material).flags;
  const bool is_volume = (material_flags & kMaterialVolume) != 0;
  const vec3 wo_world = -path.ray.direction;

  // Absorb what the medium takes along the segment.
  if (has_path_feature(kPathAbsorption) && path.media.count > 0) path.beta *= transmittance(path.media, hit.t);

  if ((material_flags & kMaterialEmissive) != 0) add_emission(path, hit, surface);

  // Evaluate the material; the frame's z axis is on the viewer's side, except where a volume tells its sides apart.
  if (has_vertex_normals(surface) || (material_flags & kMaterialNormalMapped) != 0)
    interpolate_normal(hit, wo_world, surface);
  const SurfaceParams params = evaluate_material(hit, wo_world, surface);
  const bool flip = !surface.front && !is_volume;
  const vec3 normal = flip ? -surface.shading_normal : surface.shading_normal;
  const vec3 geometric_normal = flip ? -surface.geometric_normal : surface.geometric_normal;
  const Frame frame = make_frame(normal);
  const vec3 wo = to_local(frame, wo_world);

  const bool black = (material_flags & kMaterialOneSided) != 0 && !surface.front;
  if (vertex == 1) {
    const vec3 albedo = black ? vec3(0) : surface_albedo(params, wo);
    const vec3 seen = params.mapped ? to_world(frame, params.map_normal) : normal;
    path.first = FirstHitAnswer(albedo, seen, hit.t, hit.primitive);
  }
  if (black || vertex >= int(task.max_segments) || params.model == kLobeNone) return false;

  const uint pair = 2 * uint(vertex), dimension = 3 * uint(vertex);

  // Sample a light and weight it against the BSDF's finding it.
  const bool transmissive = lets_light_through(params);
  const vec3 light_normal = transmissive ? vec3(0) : facing_normal(surface);
  const vec3 near_side = near_side_origin(surface, path.ray.direction);
  if (has_lights() && !is_pure_delta(params)) {
    // The light is sampled from where the rays will start: rounding may have put the position behind its own surface.
    const vec3 from = transmissive ? surface.position : near_side;
    const float u_select = needs_selection() ? sample_1d(path.key, path.reversed_index, dimension) : 0.0;
    const vec2 u_light = sample_pair(path.key, path.reversed_index, pair);
    const LightSample light = sample_light(from, light_normal, u_select, u_light);
    if (light.pdf_w > 0 && !is_black(light.radiance)) {
      const vec3 wi = to_local(frame, light.direction);
      const BsdfValue value = evaluate_bsdf(params, wo, wi);
      // A direction that the shading normal admits but the geometry does not would leak light.
      const bool consistent = dot(geometric_normal, light.direction) * wi.z > 0;
      if (consistent && !is_black(value.f_cos)) {
        const float weight = light.delta ? 1.0 : mis_weight(light.pdf_w, value.pdf_w);
        vec3 radiance = path.beta * value.f_cos * light.radiance * (weight / light.pdf_w);
        if (has_path_feature(kPathAbsorption))
          radiance *= shadow_transmittance(path.media, surface.material, is_volume, surface.front, wi.z > 0,
                                           light.distance);
        Ray shadow;
        shadow.origin = origin_towards(surface, near_side, light.direction);
        shadow.direction = light.direction;
        shadow.t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene.radius);
        shadow.alpha_key = alpha_key(path.key, path.reversed_index, -vertex);
        ++path.rays;
        ++path.shadow_rays;
        if (!occluded(shadow)) path.radiance += radiance;
      }
    }
  }

  // Sample the BSDF for the next direction.
  const vec2 u = sample_pair(path.key, path.reversed_index, pair + 1);
  const float u_lobe = sample_1d(path.key, path.reversed_index, dimension + 1);
  const BsdfSample next = sample_bsdf(params, wo, u_lobe, u);
  if (!(next.pdf_w > 0)) return false;
  const vec3 direction = to_world(frame, next.wi);
  if (!(dot(geometric_normal, direction) * next.wi.z > 0)) return false;
  path.beta *= next.weight;
  path.pdf_w = next.delta ? 0.0 : next.pdf_w;
  path.normal = light_normal;
  path.eta_scale *= next.eta * next.eta;
  if (has_path_feature(kPathAbsorption) && next.transmitted && is_volume) {
    if (!cross_surface(path.media, surface.material, wo.z > 0)) ++path.media_overflows;
  }
  if (is_black(path.beta)) return false;

  // Let the path die with a probability that its throughput gives; one that is not finite always goes on.
  if (vertex >= int(task.roulette_from) && is_finite(path.beta)) {
    const float survival = survival_probability(task.roulette_rule, path.beta * path.eta_scale);
    if (sample_1d(path.key, path.reversed_index, dimension + 2) >= survival) return false;
    path.beta *= 1 / survival;
  }

  path.ray.origin = origin_towards(surface, near_side, direction);
  path.ray.direction = direction;
  path.ray.alpha_key = alpha_key(path.key, path.reversed_index, vertex + 1);
  return true;
}

Path start_path(ivec2 pixel, uint index, PathTask task) {
  Path path;
  path.key = pixel_key(pixel, task.film_half, uvec2(task.seed_low, task.seed_high));
  path.reversed_index = reverse_bits(index);
  vec2 lens = vec2(0.5);
  if ((task.camera.flags & kCameraLens) != 0) lens = sample_pair(path.key, path.reversed_index, 1);
  generate_ray(task.camera, pixel, sample_pair(path.key, path.reversed_index, 0), lens, path.ray.origin,
               path.ray.direction);
  path.ray.t_max = kInfinity;
  path.ray.alpha_key = alpha_key(path.key, path.reversed_index, 1);
  path.beta = vec3(1);
  path.pdf_w = 0;
  path.radiance = vec3(0);
  path.eta_scale = 1;
  path.normal = vec3(0);
  path.media.count = 0;
  path.media.beyond = 0;
  path.first = FirstHitAnswer(vec3(0), vec3(0), kInfinity, kNone);
  path.rays = 0;
  path.shadow_rays = 0;
  path.media_overflows = 0;
  return path;
}

// Mesa before 24 ends all loops of an invocation after 65,535 rounds together, and says nothing. One more loop shows
// whether it has.
bool loops_were_ended(PathTask task) {
  uint value = 1;
  [[dont_unroll]] for (uint i = 0; i < task.loop_probe; ++i) value = hash32(value);
  return value != task.probe_result;
}

// Makes answer number first_thread + invocation of the task.
void trace_sample(uint invocation) {
  const PathTask task = PathTaskBuffer(push.task).task;
  const uint thread = task.first_thread + invocation;
  if (thread >= task.end_thread) return;
  const uint pixel = thread / task.samples;
  const ivec2 at = ivec2(task.x0 + int(pixel) % task.width, task.y0 + int(pixel) / task.width);
  Path path = start_path(at, task.first_sample + thread % task.samples, task);
  for (int vertex = 1; shade_vertex(path, vertex, task); ++vertex) {
  }
  // A throughput that is not finite makes the sample invalid, even where the path met no light afterwards.
  const vec3 radiance = is_finite(path.beta) ? path.radiance : vec3(kNotANumber);
  const uint rays = loops_were_ended(task) ? kUnfinished : path.rays;
  PathAnswers(task.answers).at[thread] = PathAnswer(radiance, rays, path.shadow_rays, path.media_overflows);
  if (task.first_hits != 0) FirstHitAnswers(task.first_hits).at[thread] = path.first;
}

#endif
