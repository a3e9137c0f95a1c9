// The path loop, as a template over what the scene needs. Included by one .cpp per instantiation.
//
// Paths advance together, a group at a time, one vertex per round: trace all rays, shade all hits, trace all shadow
// rays. A group is one sample of one half of every pixel of a 16x16 block of the film. It is always traced whole, even
// where the window ends inside the block (those results are dropped), because rays that are traced together influence
// each other in the last bit: so what a pixel gets depends neither on the window nor on how the work was cut. Random
// numbers are drawn for a whole round in loops that vectorise.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <type_traits>

#include "renderer/trace/bsdf_lambert.h"
#include "renderer/trace/lambert_batch.h"
#include "renderer/trace/mis.h"
#include "renderer/trace/path_kernel.h"
#include "renderer/trace/sample_trace.h"
#include "renderer/trace/sampler.h"
#include "renderer/trace/surface.h"
#include "renderer/trace/surface_layers.h"

namespace helio {

inline constexpr int kGroupPaths = kPathGroupSize * kPathGroupSize;

// The volumes that a path is inside of, innermost last.
struct MediumStack {
  static constexpr int kDepth = 4;
  std::array<std::uint16_t, kDepth> material{};
  int count = 0;

  void enter(std::uint32_t m) {
    if (count < kDepth) material[std::size_t(count++)] = std::uint16_t(m);
  }
  void leave(std::uint32_t m) {
    for (int i = count - 1; i >= 0; --i) {
      if (material[std::size_t(i)] != std::uint16_t(m)) continue;
      for (int j = i; j + 1 < count; ++j) material[std::size_t(j)] = material[std::size_t(j + 1)];
      --count;
      return;
    }
  }
};

struct PathState {
  Rgb beta;     // throughput from the camera to this vertex
  float pdf_w;  // of the direction that was sampled last; 0: camera ray or delta, no other technique finds it
  Rgb radiance;
  float eta_scale;  // product of squared relative iors, taken out of the throughput for roulette
  V3f normal;       // what the light sampler was told at the last vertex
  std::uint32_t key;
  MediumStack media;
};

struct FirstHit {
  Rgb albedo;
  V3f normal;
  float depth;
  std::uint32_t instance, primitive;
};

// A group in flight. Small enough for the second-level cache.
struct PathGroup {
  Ray rays[kGroupPaths];
  Hit hits[kGroupPaths];
  PathState paths[kGroupPaths];
  RayCone cones[kGroupPaths];  // where textures are mip-mapped
  FirstHit first[kGroupPaths];
  std::uint32_t active[kGroupPaths];  // paths that go on, in order
  Ray shadow_rays[kGroupPaths];
  Rgb shadow_radiance[kGroupPaths];
  std::uint32_t shadow_path[kGroupPaths];
  std::uint8_t occluded[kGroupPaths];
  std::uint32_t keys[kGroupPaths];
  float light_x[kGroupPaths], light_y[kGroupPaths], bsdf_x[kGroupPaths], bsdf_y[kGroupPaths];
  float local_x[kGroupPaths], local_y[kGroupPaths], local_z[kGroupPaths];  // plain kernel: the cosine-distributed wi
  float select[kGroupPaths], lobe[kGroupPaths], roulette[kGroupPaths];
  int pixel_x[kGroupPaths], pixel_y[kGroupPaths];
  LambertBatch batch;  // plain kernel
  int count = 0;       // paths: pixels of the block that lie on the film
};

// kWatched: writes down what becomes of one sample (WindowTask::trace). Nothing of it is left in the other kernels.
template <bool kGeneral, bool kWatched = false>
class PathKernel {
 public:
  explicit PathKernel(const WindowTask& task)
      : task_(task),
        scene_(task.scene),
        group_(thread_group()),
        lights_(*task.scene.lights),
        has_lights_(!lights_.empty()) {
    film_radiance_.resize(std::size_t(task.window.area()) * task.range.count);
    if (task.range.half == 0) film_first_.resize(film_radiance_.size());
  }

  bool run(TraceStats& stats) {
    const PixelRect& w = task_.window;
    for (int by = w.y0 & ~(kPathGroupSize - 1); by < w.y1; by += kPathGroupSize) {
      for (int bx = w.x0 & ~(kPathGroupSize - 1); bx < w.x1; bx += kPathGroupSize) {
        place_group(bx, by);
        for (std::uint32_t s = 0; s < task_.range.count; ++s) {
          if (!trace_group(task_.range.first + s)) return false;
        }
      }
    }
    if constexpr (kWatched) {
      task_.trace->radiance = film_radiance_[0];
    } else {
      commit();
    }
    stats.add(stats_);
    return true;
  }

 private:
  static PathGroup& thread_group() {
    static thread_local std::unique_ptr<PathGroup> group(new PathGroup);
    return *group;
  }

  // The block's pixels, 4x4 at a time, so that neighbours share a packet.
  void place_group(int block_x, int block_y) {
    constexpr int kTile = 4, kTiles = kPathGroupSize / kTile;
    PathGroup& b = group_;
    b.count = 0;
    for (int i = 0; i < kGroupPaths; ++i) {
      const int tile = i / (kTile * kTile), lane = i % (kTile * kTile);
      const int x = block_x + tile % kTiles * kTile + lane % kTile, y = block_y + tile / kTiles * kTile + lane / kTile;
      if constexpr (kWatched) {
        if (x >= task_.trace->width || y >= task_.trace->height) continue;
        if (task_.window.contains(x, y)) watched_ = std::uint32_t(b.count);
      } else {
        if (!task_.film.bounds().contains(x, y)) continue;
      }
      b.pixel_x[b.count] = x;
      b.pixel_y[b.count] = y;
      ++b.count;
    }
  }

  // Traces one sample of every pixel of the group to the end of its path. False when cancelled.
  bool trace_group(std::uint32_t sample) {
    start_paths(sample);
    int active = group_.count;
    for (int vertex = 1; active > 0; ++vertex) {
      if (task_.cancel.cancelled()) return false;
      intersect(vertex, active);
      draw_random_numbers(vertex, active);
      active = shade(vertex, active);
    }
    store(sample);
    return true;
  }

  // ---- camera rays -------------------------------------------------------------------------------------------------

  void start_paths(std::uint32_t sample) {
    PathGroup& b = group_;
    const int count = b.count;
    const std::uint32_t index = reverse_bits(sample);
    for (int i = 0; i < count; ++i) {
      b.keys[i] = pixel_key(b.pixel_x[i], b.pixel_y[i], task_.range.half, task_.settings.seed);
    }
    for (int i = 0; i < count; ++i) {
      const SamplePair film = sample_pair(b.keys[i], index, 0);
      b.light_x[i] = film.x;
      b.light_y[i] = film.y;
    }
    const bool lens = !task_.camera.pinhole();
    for (int i = 0; lens && i < count; ++i) {
      const SamplePair point = sample_pair(b.keys[i], index, 1);
      b.bsdf_x[i] = point.x;
      b.bsdf_y[i] = point.y;
    }
    for (int i = 0; i < count; ++i) {
      const V2f lens_sample = lens ? V2f(b.bsdf_x[i], b.bsdf_y[i]) : V2f(0.5f, 0.5f);
      const CameraRay camera =
          task_.camera.generate_ray(b.pixel_x[i], b.pixel_y[i], V2f(b.light_x[i], b.light_y[i]), lens_sample);
      Ray& ray = b.rays[i];
      ray.origin = camera.origin;
      ray.direction = camera.direction;
      ray.t_max = std::numeric_limits<float>::infinity();
      ray.alpha_key = alpha_key(b.keys[i], index, 1);
      PathState& path = b.paths[i];
      path.beta = Rgb(1, 1, 1);
      path.pdf_w = 0;
      path.radiance = Rgb(0, 0, 0);
      path.eta_scale = 1;
      path.normal = V3f(0, 0, 0);
      path.key = b.keys[i];
      path.media.count = 0;
      b.active[i] = std::uint32_t(i);
    }
    if (kGeneral && scene_.mip_mapped) std::fill_n(b.cones, count, task_.camera.cone());
    reversed_index_ = index;
    stats_.paths += std::uint64_t(count);
  }

  static std::uint32_t alpha_key(std::uint32_t key, std::uint32_t index, int segment) {
    return combine_hash(key ^ 0xa511e9b3u, index + std::uint32_t(segment) * 0x9e3779b9u);
  }

  // ---- tracing -----------------------------------------------------------------------------------------------------

  void intersect(int vertex, int active) {
    PathGroup& b = group_;
    scene_.accel->intersect(b.rays, b.active, std::size_t(active), b.hits,
                            vertex == 1 ? RayOrder::camera : RayOrder::scattered);
    stats_.rays += std::uint64_t(active);
    if (task_.log) task_.log->add(b.rays, b.active, std::size_t(active), false);
  }

  void draw_random_numbers(int vertex, int active) {
    PathGroup& b = group_;
    for (int j = 0; j < active; ++j) b.keys[j] = b.paths[b.active[j]].key;
    const std::uint32_t pair = 2 * std::uint32_t(vertex), dimension = 3 * std::uint32_t(vertex);
    for (int j = 0; j < active; ++j) {
      const SamplePair light = sample_pair(b.keys[j], reversed_index_, pair);
      b.light_x[j] = light.x;
      b.light_y[j] = light.y;
    }
    for (int j = 0; j < active; ++j) {
      const SamplePair bsdf = sample_pair(b.keys[j], reversed_index_, pair + 1);
      b.bsdf_x[j] = bsdf.x;
      b.bsdf_y[j] = bsdf.y;
    }
    if constexpr (!kGeneral) {
      for (int j = 0; j < active; ++j) {
        const V3f wi = square_to_cosine_hemisphere({b.bsdf_x[j], b.bsdf_y[j]});
        b.local_x[j] = wi.x;
        b.local_y[j] = wi.y;
        b.local_z[j] = wi.z;
      }
    }
    if (lights_.needs_selection()) {
      for (int j = 0; j < active; ++j) b.select[j] = sample_1d(b.keys[j], reversed_index_, dimension);
    }
    if constexpr (kGeneral) {
      for (int j = 0; j < active; ++j) b.lobe[j] = sample_1d(b.keys[j], reversed_index_, dimension + 1);
    }
    if (vertex >= task_.settings.roulette_from) {
      for (int j = 0; j < active; ++j) b.roulette[j] = sample_1d(b.keys[j], reversed_index_, dimension + 2);
    }
  }

  // ---- shading -----------------------------------------------------------------------------------------------------

  // Shades all hits, traces their shadow rays and leaves the paths that go on in group_.active. Returns their number.
  int shade(int vertex, int active) {
    PathGroup& b = group_;
    shadow_count_ = 0;
    int survivors = 0;
    if constexpr (kGeneral) {
      for (int j = 0; j < active; ++j) {
        const std::uint32_t i = b.active[j];
        if (shade_vertex(vertex, j, i)) b.active[survivors++] = i;
      }
    } else {
      for (int j = 0; j < active;) {
        j = gather_lambert(vertex, j, active);
        survivors = shade_lambert(vertex, survivors);
      }
    }
    trace_shadow_rays();
    return survivors;
  }

  void trace_shadow_rays() {
    PathGroup& b = group_;
    if (shadow_count_ == 0) return;
    stats_.rays += std::uint64_t(shadow_count_);
    stats_.shadow_rays += std::uint64_t(shadow_count_);
    scene_.accel->occluded(b.shadow_rays, std::size_t(shadow_count_), b.occluded);
    for (int k = 0; k < shadow_count_; ++k) {
      if constexpr (kWatched) note(b.shadow_path[k]).light.occluded = b.occluded[k] != 0;
      if (!b.occluded[k]) b.paths[b.shadow_path[k]].radiance += b.shadow_radiance[k];
    }
    if (task_.log) task_.log->add(b.shadow_rays, nullptr, std::size_t(shadow_count_), true);
  }

  void add_shadow_ray(int vertex, std::uint32_t path, const V3f& origin, const V3f& direction, float t_max,
                      const Rgb& radiance) {
    PathGroup& b = group_;
    const int slot = shadow_count_++;
    Ray& ray = b.shadow_rays[slot];
    ray.origin = origin;
    ray.direction = direction;
    ray.t_max = t_max;
    ray.alpha_key = alpha_key(b.paths[path].key, reversed_index_, -vertex);
    if constexpr (kWatched) note_shadow_ray(path, t_max, radiance);
    b.shadow_radiance[slot] = radiance;
    b.shadow_path[slot] = path;
  }

  // Path i met nothing.
  void leave_scene(int vertex, std::uint32_t i) {
    PathGroup& b = group_;
    PathState& path = b.paths[i];
    const Ray& ray = b.rays[i];
    if (vertex == 1) b.first[i] = {Rgb(0, 0, 0), V3f(0, 0, 0), std::numeric_limits<float>::infinity(), kNoHit, kNoHit};
    if (!is_finite(ray.direction)) [[unlikely]] {
      path.radiance = Rgb(std::numeric_limits<float>::quiet_NaN());  // not traced: the film counts an invalid sample
      return;
    }
    // Add what the environment sends along the ray.
    const Rgb radiance = lights_.environment_radiance(ray.direction);
    if (is_black(radiance)) return;
    float weight = 1;
    if (path.pdf_w > 0) {
      weight = mis_weight(path.pdf_w, lights_.pdf_w_environment(ray.origin, path.normal, ray.direction));
    }
    if constexpr (kWatched) note_emission(path, radiance, weight);
    path.radiance += path.beta * radiance * weight;
  }

  // Plain kernel: takes the active paths from j on into the batch until it is full; those that met nothing end, and
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
        add_emission(b.paths[i], ray, hit, make_surface<false>(scene_, ray, hit));
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

  // Plain kernel: shades the batch. Paths that go on are written to group_.active from `survivors` on; returns their
  // new number.
  int shade_lambert(int vertex, int survivors) {
    PathGroup& b = group_;
    LambertBatch& batch = b.batch;
    batch.find_surfaces();
    if (vertex == 1) {
      for (int k = 0; k < batch.count; ++k) {
        const std::uint32_t i = batch.path[k];
        const Hit& hit = b.hits[i];
        b.first[i] = {batch.albedo[k], batch.normal[k], hit.t, instance_name(hit), hit.primitive};
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

  // General kernel: one vertex of one path. True when the path goes on along the new ray in group_.rays[i].
  bool shade_vertex(int vertex, int j, std::uint32_t i) {
    PathGroup& b = group_;
    PathState& path = b.paths[i];
    Ray& ray = b.rays[i];
    const Hit& hit = b.hits[i];
    if constexpr (kWatched) note_segment(vertex, i);

    if (!hit.valid()) {
      leave_scene(vertex, i);
      return false;
    }

    Surface surface = make_surface<true>(scene_, ray, hit);
    const MaterialRecord& material = *surface.material;
    const V3f wo_world = -ray.direction;

    // Absorb what the medium takes along the segment.
    if (path.media.count > 0) path.beta *= transmittance(path.media, hit.t);

    if constexpr (kWatched) note(i).throughput = path.beta;

    // Add what the surface emits.
    if (material.emissive) add_emission(path, ray, hit, surface);

    // Evaluate the material; the frame's z axis is on the viewer's side, except where a volume tells its sides apart.
    SurfaceParams params;
    float footprint = 0;
    if (scene_.mip_mapped) {
      b.cones[i].advance(hit.t);
      footprint = b.cones[i].footprint(dot(surface.geometric_normal, wo_world));
    }
    if (surface.part->smooth || material.normal_mapped) {
      interpolate_normal(scene_, hit, wo_world, footprint, surface);
    }
    params = evaluate_material(scene_, hit, wo_world, footprint, surface);
    const bool flip = !surface.front && !material.volume;
    const V3f normal = flip ? -surface.shading_normal : surface.shading_normal;
    const V3f geometric_normal = flip ? -surface.geometric_normal : surface.geometric_normal;
    const Frame frame(normal);
    const V3f wo = frame.to_local(wo_world);
    if (params.model == LobeModel::stack) {
      layers_ = evaluate_layers(scene_, hit, wo_world, footprint, surface, frame);
      params.layers = &layers_;
    }
    const bool lambert = params.model == LobeModel::lambert && !params.mapped;

    const bool black = material.one_sided && !surface.front;
    if (vertex == 1) {
      const Rgb albedo = black ? Rgb(0, 0, 0) : lambert ? params.base_color : surface_albedo(params, wo);
      const V3f seen = params.mapped ? frame.to_world(params.map_normal) : normal;
      b.first[i] = {albedo, seen, hit.t, instance_name(hit), hit.primitive};
    }
    if constexpr (kWatched) note_surface(i, surface, params, normal, geometric_normal, black);
    if (black) return false;
    if (vertex >= task_.settings.max_segments) return false;
    if (params.model == LobeModel::none) return false;

    // Sample a light and weight it against the BSDF's finding it.
    const bool transmissive = !lambert && lets_light_through(params);
    const V3f light_normal =
        transmissive ? V3f(0, 0, 0) : (surface.front ? surface.geometric_normal : -surface.geometric_normal);
    const V3f near_side = near_side_origin(surface, ray.direction);
    if (has_lights_ && !is_pure_delta(params)) {
      // Seen from where the rays will start: rounding may have put the position itself behind its own surface, which
      // would then, if it emits, light itself.
      const V3f from = transmissive ? surface.position : near_side;
      const LightSample light = lights_.sample(from, light_normal, b.select[j], V2f(b.light_x[j], b.light_y[j]));
      if constexpr (kWatched) note(i).light.sample = light;
      if (light.pdf_w > 0 && !is_black(light.radiance)) {
        const V3f wi = frame.to_local(light.direction);
        const BsdfValue value = lambert ? evaluate_lambert(params.base_color, wo, wi) : evaluate_bsdf(params, wo, wi);
        if constexpr (kWatched) note_light(i, light, value);
        // A direction that the shading normal admits but the geometry does not would leak light.
        const bool consistent = dot(geometric_normal, light.direction) * wi.z > 0;
        if (consistent && !is_black(value.f_cos)) {
          const float weight = light.delta ? 1.0f : mis_weight(light.pdf_w, value.pdf_w);
          Rgb radiance = path.beta * value.f_cos * light.radiance * (weight / light.pdf_w);
          const float t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene_.radius);
          if (scene_.features.absorption)
            radiance *= shadow_transmittance(path.media, material, surface, wi, light.distance);
          const V3f origin = origin_towards(surface, near_side, light.direction);
          add_shadow_ray(vertex, i, origin, light.direction, t_max, radiance);
        }
      }
    }

    // Sample the BSDF for the next direction.
    BsdfSample sample;
    const V2f u(b.bsdf_x[j], b.bsdf_y[j]);
    sample = lambert ? sample_lambert(params.base_color, wo, square_to_cosine_hemisphere(u))
                     : sample_bsdf(params, wo, b.lobe[j], u);
    if constexpr (kWatched) note_scatter(i, sample, frame);
    if (!sample.valid()) return false;
    const V3f direction = frame.to_world(sample.wi);
    if (!(dot(geometric_normal, direction) * sample.wi.z > 0)) return false;
    path.beta *= sample.weight;
    path.pdf_w = sample.delta ? 0.0f : sample.pdf_w;
    path.normal = light_normal;
    if (scene_.mip_mapped && path.pdf_w > 0) b.cones[i].scatter(path.pdf_w);
    path.eta_scale *= sample.eta * sample.eta;
    if (sample.transmitted && material.volume) {
      if (wo.z > 0)
        path.media.enter(surface.part->material);
      else
        path.media.leave(surface.part->material);
    }
    if constexpr (kWatched) note(i).next_throughput = path.beta;
    if (is_black(path.beta)) return false;

    // Let the path die with a probability that its throughput gives.
    if (vertex >= task_.settings.roulette_from) {
      const float survival = survival_probability(task_.settings.roulette, max_component(path.beta) * path.eta_scale);
      if constexpr (kWatched) note_roulette(i, survival, b.roulette[j]);
      if (!(b.roulette[j] < survival)) return false;
      path.beta *= 1 / survival;
    }

    if constexpr (kWatched) note(i).goes_on = true;
    ray.origin = origin_towards(surface, near_side, direction);
    ray.direction = direction;
    ray.alpha_key = alpha_key(path.key, reversed_index_, vertex + 1);
    return true;
  }

  void add_emission(PathState& path, const Ray& ray, const Hit& hit, const Surface& surface) {
    const std::uint32_t emitter = scene_.emitter(hit, *surface.part);
    const float cos_light = -dot(surface.geometric_normal, ray.direction);
    Rgb radiance;
    if constexpr (kGeneral) {
      radiance = surface_emission(scene_, hit, surface);
    } else {
      radiance = surface.front || surface.material->double_sided ? surface.material->emission : Rgb(0, 0, 0);
    }
    if (is_black(radiance)) return;
    float weight = 1;
    if (path.pdf_w > 0 && emitter != kNoHit) {
      weight =
          mis_weight(path.pdf_w, lights_.pdf_w_area(ray.origin, path.normal, ray.direction, emitter, hit.t, cos_light));
    }
    if constexpr (kWatched) note_emission(path, radiance, weight);
    path.radiance += path.beta * radiance * weight;
  }

  Rgb transmittance(const MediumStack& media, float distance) const {
    const Rgb& sigma = scene_.materials[media.material[std::size_t(media.count - 1)]].absorption;
    if (is_black(sigma)) return Rgb(1, 1, 1);
    return Rgb(std::exp(-sigma.x * distance), std::exp(-sigma.y * distance), std::exp(-sigma.z * distance));
  }

  // Along a shadow ray that starts at the surface towards wi: inside the innermost medium after the crossing.
  Rgb shadow_transmittance(MediumStack media, const MaterialRecord& material, const Surface& surface, const V3f& wi,
                           float distance) const {
    if (material.volume && (wi.z > 0) != surface.front) {
      if (surface.front)
        media.enter(surface.part->material);
      else
        media.leave(surface.part->material);
    }
    if (media.count == 0) return Rgb(1, 1, 1);
    return transmittance(media, std::isfinite(distance) ? distance : std::numeric_limits<float>::max());
  }

  std::uint32_t instance_name(const Hit& hit) const {
    if constexpr (kGeneral) {
      if (hit.instance != kNoHit) return scene_.instance_names[hit.instance];
    }
    return scene_.flat_names[hit.part];
  }

  // ---- what kWatched writes down
  // -------------------------------------------------------------------------------------

  // The newest vertex of the sample that is watched; of all others, something that nobody reads.
  VertexTrace& note(std::uint32_t path) { return path == watched_ ? task_.trace->vertices.back() : ignored_; }

  void note_segment(int vertex, std::uint32_t i) {
    if (i != watched_) return;
    VertexTrace& v = task_.trace->vertices.emplace_back();
    const PathState& path = group_.paths[i];
    const Hit& hit = group_.hits[i];
    v.number = vertex;
    v.origin = group_.rays[i].origin;
    v.direction = group_.rays[i].direction;
    v.pdf_w = path.pdf_w;
    v.radiance = path.radiance;
    v.throughput = path.beta;
    v.hit = hit.valid();
    if (!v.hit) return;
    v.distance = hit.t;
    v.instance = instance_name(hit);
    v.primitive = hit.primitive;
  }

  void note_emission(const PathState& path, const Rgb& radiance, float weight) {
    VertexTrace& v = note(std::uint32_t(&path - group_.paths));
    v.emitted = radiance;
    v.emitted_weight = weight;
  }

  void note_surface(std::uint32_t i, const Surface& surface, const SurfaceParams& params, const V3f& normal,
                    const V3f& geometric_normal, bool black) {
    VertexTrace& v = note(i);
    v.position = surface.position;
    v.geometric_normal = geometric_normal;
    v.shading_normal = normal;
    v.front = surface.front;
    v.material = surface.part->material;
    v.black_side = black;
    v.params = params;
    v.params.layers = nullptr;
  }

  void note_light(std::uint32_t i, const LightSample& light, const BsdfValue& value) {
    LightTrace& trace = note(i).light;
    trace.evaluated = true;
    trace.f_cos = value.f_cos;
    trace.bsdf_pdf_w = value.pdf_w;
    trace.mis_weight = light.delta ? 1.0f : mis_weight(light.pdf_w, value.pdf_w);
  }

  void note_shadow_ray(std::uint32_t i, float t_max, const Rgb& contribution) {
    LightTrace& trace = note(i).light;
    trace.shadow_ray = true;
    trace.t_max = t_max;
    trace.contribution = contribution;
  }

  void note_scatter(std::uint32_t i, const BsdfSample& sample, const Frame& frame) {
    VertexTrace& v = note(i);
    v.sampled = true;
    v.scatter = sample;
    if (sample.valid()) v.next_direction = frame.to_world(sample.wi);
  }

  void note_roulette(std::uint32_t i, float survival, float u) {
    VertexTrace& v = note(i);
    v.roulette = true;
    v.survival = survival;
    v.roulette_sample = u;
  }

  // ---- results -----------------------------------------------------------------------------------------------------

  std::size_t result_index(int x, int y, std::uint32_t sample) const {
    const PixelRect& w = task_.window;
    return (std::size_t(y - w.y0) * std::size_t(w.width()) + std::size_t(x - w.x0)) * task_.range.count +
           (sample - task_.range.first);
  }

  void store(std::uint32_t sample) {
    for (int i = 0; i < group_.count; ++i) {
      const int x = group_.pixel_x[i], y = group_.pixel_y[i];
      if (!task_.window.contains(x, y)) continue;
      const std::size_t slot = result_index(x, y, sample);
      film_radiance_[slot] = group_.paths[i].radiance;
      if (task_.range.half == 0) film_first_[slot] = group_.first[i];
    }
  }

  void commit() {
    const PixelRect& w = task_.window;
    const SampleRange& range = task_.range;
    std::size_t slot = 0;
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        HalfPixel& pixel = task_.film.half(range.half, x, y);
        PixelFeatures& features = task_.film.features(x, y);
        for (std::uint32_t s = 0; s < range.count; ++s, ++slot) {
          if (is_finite(film_radiance_[slot])) {
            pixel.add(film_radiance_[slot]);
          } else {
            task_.film.add_invalid(range.half, x, y);
            stats_.note_invalid({x, y, range.half, range.first + s});
            if (!is_finite_hit(range.half, slot)) continue;
          }
          // Features come from half A alone, so that their order of summation is fixed.
          if (range.half == 0) add_features(features, film_first_[slot], range.first + s == 0);
        }
      }
    }
  }

  // Whether the features of an invalid sample may enter the film.
  bool is_finite_hit(int half, std::size_t slot) const {
    return half == 0 && is_finite(film_first_[slot].albedo) && is_finite(film_first_[slot].normal);
  }

  static void add_features(PixelFeatures& f, const FirstHit& first, bool is_first_sample) {
    f.add(first.albedo, first.normal, first.primitive != kNoHit);
    if (is_first_sample) {
      f.depth = first.depth;
      f.instance = first.instance;
      f.primitive = first.primitive;
    }
  }

  const WindowTask& task_;
  const SceneData& scene_;
  PathGroup& group_;
  const LightSampler& lights_;
  const bool has_lights_;
  int shadow_count_ = 0;
  LayerParams layers_;                // general kernel: of the vertex in hand
  std::uint32_t reversed_index_ = 0;  // of the sample in flight
  TraceStats stats_;
  std::vector<Rgb> film_radiance_;
  std::vector<FirstHit> film_first_;
  struct Nothing {};
  [[no_unique_address]] std::conditional_t<kWatched, std::uint32_t, Nothing> watched_{};  // index in the group
  [[no_unique_address]] std::conditional_t<kWatched, VertexTrace, Nothing> ignored_{};
};

}  // namespace helio
