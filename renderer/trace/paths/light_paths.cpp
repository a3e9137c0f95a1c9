#include "renderer/trace/paths/light_paths.h"

#include <limits>

#include "renderer/trace/bsdf/bsdf_lambert.h"
#include "renderer/trace/paths/enclosing_media.h"
#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/scene/surface_prefetch.h"

namespace helio {

namespace {

// Keys of light rays' chance decisions at surfaces with alpha.
std::uint32_t light_alpha_key(std::uint32_t key, std::uint32_t reversed_index, int segment) {
  return combine_hash(key ^ 0x3c6ef372u, reversed_index + std::uint32_t(segment) * 0x9e3779b9u);
}

// Enough hits to cover the way to memory.
constexpr int kFetched = 32;

}  // namespace

void LightPaths::trace(const SceneData& scene, const PathSettings& settings, const LightBatch& batch,
                       const TechniqueCounts& counts, const CancelToken& cancel, TraceStats& stats) {
  vertices_.clear();
  path_of_.clear();
  std::fill_n(last_, batch.count, kNoVertex);
  start(scene, batch);
  if (scene.features.absorption) enter_media_of_lights(scene, stats);
  for (int depth = 1; active_count_ > 0 && depth < settings.max_segments; ++depth) {
    if (cancel.cancelled()) return;
    scene.accel->intersect(rays_, active_, std::size_t(active_count_), hits_, RayOrder::scattered);
    stats.rays += std::uint64_t(active_count_);
    int survivors = 0;
    for (int j = 0; j < active_count_; ++j) {
      if (j % kFetched == 0) prefetch_hits(scene, hits_, active_ + j, std::min(kFetched, active_count_ - j));
      const std::uint32_t i = active_[j];
      if (shade(scene, settings, batch, counts, depth, i, stats)) active_[survivors++] = i;
    }
    active_count_ = survivors;
  }
}

void LightPaths::start(const SceneData& scene, const LightBatch& batch) {
  active_count_ = 0;
  for (int i = 0; i < batch.count; ++i) {
    const std::uint32_t key = batch.keys[i], index = batch.reversed_index[i];
    const SamplePair position = sample_pair(key, index, 0), direction = sample_pair(key, index, 1);
    State& state = states_[i];
    state.emission = scene.lights->sample_emission(sample_1d(key, index, 0), V2f(position.x, position.y),
                                                   V2f(direction.x, direction.y));
    const EmissionSample& emission = state.emission;
    if (!(emission.pdf_emission > 0) || is_black(emission.weight)) continue;
    state.throughput = emission.weight;
    state.relative = Rgb(1, 1, 1);
    state.mis = MisState::light(emission.pdf_emission, emission.cos_light, emission.delta);
    state.media.clear();
    state.from_light = true;
    Ray& ray = rays_[i];
    // Off the light's surface as rays are from others: far enough that it does not stop its own light.
    const float offset =
        (max_component(V3f(std::fabs(emission.origin.x), std::fabs(emission.origin.y), std::fabs(emission.origin.z))) +
         scene.radius) *
        kOffsetFactor;
    ray.origin = emission.origin + emission.normal * offset;
    ray.direction = emission.direction;
    ray.t_max = std::numeric_limits<float>::infinity();
    ray.alpha_key = light_alpha_key(key, index, 1);
    active_[active_count_++] = std::uint32_t(i);
  }
}

// Lights may be inside of volumes; those at infinity are not.
void LightPaths::enter_media_of_lights(const SceneData& scene, TraceStats& stats) {
  std::uint32_t finite[kLightBatch] = {};
  MediumStack media[kLightBatch];
  std::size_t count = 0;
  for (int j = 0; j < active_count_; ++j) {
    if (states_[active_[j]].emission.finite) finite[count++] = active_[j];
  }
  static_assert(kLightBatch <= kMostEnclosed);
  find_enclosing_media(scene, rays_, finite, count, media, stats);
  for (std::size_t j = 0; j < count; ++j) states_[finite[j]].media = media[finite[j]];
}

// One vertex. True when the path goes on along the new ray.
bool LightPaths::shade(const SceneData& scene, const PathSettings& settings, const LightBatch& batch,
                       const TechniqueCounts& counts, int depth, std::uint32_t i, TraceStats& stats) {
  const Hit& hit = hits_[i];
  if (!hit.valid()) return false;
  State& state = states_[i];
  Ray& ray = rays_[i];
  const EmissionSample& emission = state.emission;
  const PathVertex vertex(scene, ray, hit, nullptr);
  const Surface& surface = vertex.surface;
  const MaterialRecord& material = *surface.material;
  const V3f to_light = -ray.direction;
  if (state.media.count > 0) state.throughput *= transmittance(scene, state.media, hit.t);

  Late<ShadingPoint>& point = points_.room(vertices_.size());  // of all that is not Lambert
  if (!vertex.lambert)
    point.emplace(scene, hit, surface, to_light, vertex.footprint, vertex.flat ? nullptr : &vertex.unbent);
  if (point && point->params.model == LobeModel::none) return false;
  const bool pure_delta = point ? point->bsdf().is_pure_delta() : is_black(vertex.albedo);
  const bool transmissive = point && lets_light_through(point->params);

  const float cos_in = vertex.cosine(to_light);
  if (state.from_light) {
    state.throughput *= scene.lights->range_window(emission.light, hit.t);
    // As next-event estimation at this vertex has it.
    const V3f light_normal = transmissive ? V3f(0, 0, 0) : surface.facing_normal();
    const V3f from = transmissive ? surface.position : vertex.near_side;
    const double pdf_direct = scene.lights->pdf_w_direct(emission, from, light_normal);
    state.mis.arrive_from_light(hit.t, cos_in, emission.finite, emission.delta, pdf_direct, emission.pdf_emission,
                                emission.cos_light);
    state.from_light = false;
  } else {
    state.mis.arrive(hit.t, cos_in, true);
  }
  if (is_black(state.throughput)) return false;

  if (!pure_delta) {
    const std::uint32_t previous = last_[i];
    last_[i] = std::uint32_t(vertices_.size());
    vertices_.push_back({vertex, ray.origin, state.throughput, state.mis, state.media, depth, previous});
    path_of_.push_back(i);
  }
  if (depth + 1 >= settings.max_segments) return false;

  // Sample where the light goes, and weight it as the path tracer would coming from there.
  const std::uint32_t key = batch.keys[i], index = batch.reversed_index[i];
  const std::uint32_t pair = 1 + std::uint32_t(depth), dimension = 1 + 2 * std::uint32_t(depth);
  const SamplePair drawn = sample_pair(key, index, pair);
  const V2f u(drawn.x, drawn.y);
  const Frame frame = point ? point->frame : Frame(vertex.lambert_normal());
  const V3f wo = frame.to_local(to_light);
  const BsdfSample sample = point ? point->bsdf().sample(sample_1d(key, index, dimension), u)
                                  : sample_lambert(vertex.albedo, wo, square_to_cosine_hemisphere(u));
  if (!sample.valid()) return false;
  const V3f direction = frame.to_world(sample.wi);
  if ((point || !vertex.flat) && !(dot(viewed_normal(surface), direction) * sample.wi.z > 0)) return false;
  const float cos_out = vertex.cosine(direction);
  Rgb weight;
  if (sample.delta) {
    if (!vertex.mirrors_back(*point, to_light, direction)) return false;
    if (material.one_sided && dot(surface.geometric_normal, direction) < 0) return false;
    // Radiance that is refracted is spread by eta^2, flux is not (Veach 1997, 5.2); and the factor of shading normals,
    // whose mirror the delta is.
    const float cos_in_s = std::fabs(wo.z), cos_out_s = std::fabs(sample.wi.z);
    if (!(cos_in > 0) || !(cos_out_s > 0)) return false;
    weight = sample.weight * (sample.eta * sample.eta * (cos_in_s * cos_out) / (cos_in * cos_out_s));
    state.mis.scatter_delta(cos_out);
  } else {
    const BsdfValue seen = vertex.scatter(scene, direction, to_light, point.get(), to_light);
    weight = adjoint_weight(vertex, seen.f_cos, direction, to_light) * (1 / sample.pdf_w);
    state.mis.scatter(sample.pdf_w, seen.pdf_w, cos_out, counts);
  }
  state.throughput *= weight;
  state.relative *= weight;
  if (is_black(state.throughput)) return false;
  if (sample.transmitted && material.volume)
    stats.media_overflows += !state.media.cross(surface.part->material, wo.z > 0);

  if (depth >= settings.roulette_from) {
    const float survival = survival_probability(settings.roulette, state.relative);
    if (!survives(sample_1d(key, index, dimension + 1), survival)) return false;
    state.throughput *= 1 / survival;
    state.relative *= 1 / survival;
  }
  ray.origin = vertex.start(direction);
  ray.direction = direction;
  ray.t_max = std::numeric_limits<float>::infinity();
  ray.alpha_key = light_alpha_key(key, index, depth + 1);
  return true;
}

}  // namespace helio
