#include "renderer/trace/lights/light_sampler.h"

#include <limits>

#include "renderer/base/prefetch.h"
#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/texture.h"
#include "renderer/trace/lights/light_emission.h"
#include "renderer/trace/lights/light_power.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {
namespace {

// Share of selections by power that ignores it: a weak light may still be the one that matters at a point.
constexpr double kUniformShare = 0.1;
// The probability of an infinite light beside a tree is its share of the power within these bounds.
constexpr double kMinInfiniteShare = 0.1, kMaxInfiniteShare = 0.9;
// Disks are larger than the scene by more than rounding and widened triangles (edge_dilation.h) reach out of it.
constexpr double kDiskMargin = 1 + 1e-4;

AliasTable make_power_table(std::vector<double> flux) {
  double total = 0;
  for (const double f : flux) total += f;
  for (double& f : flux) f = (1 - kUniformShare) * f / total + kUniformShare / double(flux.size());
  return AliasTable(flux);
}

LightBounds area_bounds(const AreaLight& light, double mean_radiance) {
  const AreaShape& shape = light.shape;
  LightBounds bounds;
  bounds.two_sided = shape.two_sided;
  if (shape.kind == ShapeKind::sphere) {
    const V3f extent(shape.radius);
    bounds.box = Box3f(shape.p0 - extent, shape.p0 + extent);
    bounds.theta_o = kPi;
    bounds.intensity = mean_radiance * shape.area / 4;  // seen as a disk
    return bounds;
  }
  if (shape.kind == ShapeKind::ellipsoid) {
    V3f extent;
    for (int i = 0; i < 3; ++i) extent[i] = length(V3f(shape.e1[i], shape.e2[i], shape.e3[i]));
    bounds.box = Box3f(shape.p0 - extent, shape.p0 + extent);
    bounds.theta_o = kPi;
    bounds.intensity = mean_radiance * shape.area / 2;  // a closed convex surface shows half of its area at most
    return bounds;
  }
  for (const V3f& corner : {shape.p0, shape.p0 + shape.e1, shape.p0 + shape.e2}) bounds.box.extendBy(corner);
  if (shape.kind == ShapeKind::parallelogram) bounds.box.extendBy(shape.p0 + shape.e1 + shape.e2);
  bounds.axis = shape.normal;
  bounds.intensity = mean_radiance * shape.area;
  return bounds;
}

LightBounds punctual_bounds(const PunctualLight& light) {
  LightBounds bounds;
  bounds.box = Box3f(V3f(light.position));
  bounds.intensity = luminance(light.intensity);
  bounds.range = light.range > 0 ? light.range : std::numeric_limits<float>::infinity();
  if (light.kind == PunctualKind::spot) {
    bounds.axis = V3f(light.direction);
    bounds.theta_e = std::min(light.outer_cone_angle, kPi / 2);
  } else {
    bounds.theta_o = kPi;
  }
  return bounds;
}

V3f cosine_direction(const V3f& normal, const V2f& u) {
  return Frame(normal).to_world(square_to_cosine_hemisphere(u));
}

V3f uniform_direction(const V2f& u) {
  const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z), phi = kTwoPi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace

LightSampler::LightSampler(Input input) : textures_(input.textures) {
  const double scene_radius =
      input.scene_bounds.isEmpty() ? 1.0 : std::max(0.5 * length(V3d(input.scene_bounds.size())), 1e-6);
  if (!input.scene_bounds.isEmpty()) scene_center_ = input.scene_bounds.center();
  disk_radius_ = scene_radius * kDiskMargin;
  std::vector<double> flux;
  std::vector<LightBounds> bounds;
  add_areas(input, flux, bounds);
  add_punctual(input.punctual, scene_radius, flux, bounds);
  add_environment(input, scene_radius, flux);

  const std::size_t count = light_count();
  if (count == 0) return;
  if (count == 1) {
    selection_ = Selection::one;
    plain_quad_ = areas_.size() == 1 && areas_[0].shape.kind == ShapeKind::parallelogram && !areas_[0].textured &&
                  areas_[0].alpha == kOpaqueEmitter;
    return;
  }
  power_ = make_power_table(flux);
  if (!input.use_tree || finite_count_ < 2) {
    selection_ = Selection::power;
    return;
  }
  selection_ = Selection::tree;
  tree_ = LightTree(bounds);
  if (finite_count_ < count) {
    const auto first_infinite = flux.begin() + finite_count_;
    double finite = 0, infinite = 0;
    for (auto it = flux.begin(); it != flux.end(); ++it) (it < first_infinite ? finite : infinite) += *it;
    infinite_probability_ = float(std::clamp(infinite / (finite + infinite), kMinInfiniteShare, kMaxInfiniteShare));
    infinite_ = make_power_table({first_infinite, flux.end()});
  }
}

LightSampler::~LightSampler() = default;

void LightSampler::add_areas(Input& input, std::vector<double>& flux, std::vector<LightBounds>& bounds) {
  emitters_ = std::move(input.areas);
  AreaLights grouped = group_area_emitters(emitters_, input.alphas);
  const std::vector<double> radiances = mean_radiances(grouped, emitters_, textures_);
  alphas_ = std::move(grouped.alphas);
  areas_.reserve(grouped.lights.size());
  std::vector<std::uint32_t> kept(grouped.lights.size(), kNoLight);
  for (std::size_t i = 0; i < grouped.lights.size(); ++i) {
    if (!(radiances[i] > 0)) continue;
    kept[i] = std::uint32_t(areas_.size());
    areas_.push_back(grouped.lights[i]);
    flux.push_back(area_flux(areas_.back(), radiances[i]));
    bounds.push_back(area_bounds(areas_.back(), radiances[i]));
  }
  light_of_emitter_ = std::move(grouped.light_of_emitter);
  for (std::size_t e = 0; e < emitters_.size(); ++e) {
    std::uint32_t& light = light_of_emitter_[e];
    if (light != kNoLight) light = kept[light];
    if (light == kNoLight) {
      emitters_[e].power = 0;
      continue;
    }
    // Halves of a parallelogram are equal.
    const bool half = areas_[light].shape.kind == ShapeKind::parallelogram;
    emitters_[e].power = float(flux[light] * (half ? 0.5 : 1.0));
  }
}

void LightSampler::add_punctual(const std::vector<PunctualLight>& lights, double scene_radius,
                                std::vector<double>& flux, std::vector<LightBounds>& bounds) {
  for (const bool infinite : {false, true}) {
    for (const PunctualLight& light : lights) {
      const float strength = luminance(light.intensity);
      if ((light.kind == PunctualKind::directional) != infinite || !(strength > 0) || !std::isfinite(strength))
        continue;
      if (!infinite && !is_finite(V3f(light.position))) continue;
      if (light.kind == PunctualKind::projector) {
        add_projector(light, flux, bounds);
        continue;
      }
      punctual_.push_back(make_punctual_source(light));
      flux.push_back(punctual_flux(light, scene_radius));
      if (!infinite) bounds.push_back(punctual_bounds(light));
    }
    if (!infinite) finite_count_ = std::uint32_t(areas_.size() + punctual_.size());
  }
}

void LightSampler::add_projector(const PunctualLight& light, std::vector<double>& flux,
                                 std::vector<LightBounds>& bounds) {
  const ProjectorPower power = projector_power(light, textures_);
  if (!(power.flux > 0) || !std::isfinite(power.flux) || !std::isfinite(power.intensity)) return;
  PunctualSource& source = punctual_.emplace_back(make_punctual_source(light));
  source.projector = std::uint32_t(projectors_.size());
  projectors_.push_back(make_projector(light));
  flux.push_back(power.flux);
  LightBounds& bound = bounds.emplace_back();
  bound.box = Box3f(V3f(light.position));
  bound.axis = V3f(light.direction);
  bound.theta_e = power.half_angle;
  bound.intensity = power.intensity;
}

void LightSampler::add_environment(const Input& input, double scene_radius, std::vector<double>& flux) {
  if (input.environment == nullptr) return;
  const bool mapped = input.environment->image >= 0;
  environment_ = std::make_unique<EnvironmentMap>(*input.environment, mapped ? input.textures : nullptr);
  double mean = luminance(input.environment->radiance);
  if (mapped) {
    env_distribution_ = input.env_distribution;
    if (!env_distribution_) env_distribution_ = std::make_shared<EnvironmentDistribution>(*environment_);
    mean = env_distribution_->total_luminance() * input.env_brightness / (4 * std::numbers::pi);
  }
  if (!(mean > 0)) return;
  environment_light_ = true;
  flux.push_back(environment_flux(mean, scene_radius));
}

std::size_t LightSampler::memory_bytes() const {
  return sizeof(*this) + areas_.capacity() * sizeof(AreaLight) + punctual_.capacity() * sizeof(PunctualSource) +
         projectors_.capacity() * sizeof(Projector) + light_of_emitter_.capacity() * sizeof(std::uint32_t) +
         emitters_.capacity() * sizeof(AreaEmitter) + alphas_.capacity() * sizeof(LightAlpha) + power_.memory_bytes() +
         infinite_.memory_bytes() + tree_.memory_bytes() + (env_distribution_ ? env_distribution_->memory_bytes() : 0);
}

LightSampler::Parts LightSampler::parts() const {
  return {.selection = selection_,
          .areas = areas_,
          .alphas = alphas_,
          .punctual = punctual_,
          .projectors = projectors_,
          .light_of_emitter = light_of_emitter_,
          .finite_count = finite_count_,
          .power = &power_,
          .tree = &tree_,
          .infinite = &infinite_,
          .infinite_probability = infinite_probability_,
          .environment_light = environment_light_,
          .environment = environment_.get(),
          .environment_distribution = env_distribution_.get()};
}

LightSampler::Selected LightSampler::select(const V3f& point, const V3f& normal, float u) const {
  if (selection_ == Selection::one) return {0, 1.0f};
  if (selection_ == Selection::power) {
    const AliasTable::Choice choice = power_.sample(u);
    return {choice.index, choice.probability};
  }
  if (u < infinite_probability_) return select_infinite(u);
  const LightTree::Choice choice = tree_.select(point, normal, rest_for_tree(u));
  return {choice.light, choice.probability * (1 - infinite_probability_)};
}

LightSampler::Selected LightSampler::select_infinite(float u) const {
  const AliasTable::Choice choice = infinite_.sample(std::min(u / infinite_probability_, kOneMinusEpsilon));
  return {finite_count_ + choice.index, choice.probability * infinite_probability_};
}

float LightSampler::rest_for_tree(float u) const {
  return std::min((u - infinite_probability_) / (1 - infinite_probability_), kOneMinusEpsilon);
}

// At most LightTree::kMostQueries.
void LightSampler::select_by_tree(std::span<const Query> queries, Selected* selected) const {
  LightTree::Query asked[LightTree::kMostQueries];
  LightTree::Choice choices[LightTree::kMostQueries];
  std::size_t of_query[LightTree::kMostQueries], count = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const Query& query = queries[i];
    if (query.u_select < infinite_probability_) {
      selected[i] = select_infinite(query.u_select);
      continue;
    }
    of_query[count] = i;
    asked[count++] = {query.point, query.normal, rest_for_tree(query.u_select)};
  }
  tree_.select({asked, count}, choices);
  for (std::size_t k = 0; k < count; ++k)
    selected[of_query[k]] = {choices[k].light, choices[k].probability * (1 - infinite_probability_)};
}

float LightSampler::selection_probability(const V3f& point, const V3f& normal, std::uint32_t light) const {
  if (selection_ == Selection::one) return 1;
  if (selection_ == Selection::power) return power_.probability(light);
  if (light >= finite_count_) return infinite_.probability(light - finite_count_) * infinite_probability_;
  return tree_.probability(point, normal, light) * (1 - infinite_probability_);
}

LightSample LightSampler::sample_any(const V3f& point, const V3f& normal, float u_select, const V2f& u) const {
  if (selection_ == Selection::none) return {};
  return sample_selected(select(point, normal, u_select), point, normal, u);
}

void LightSampler::sample(std::span<const Query> queries, LightSample* samples) const {
  while (selection_ == Selection::tree && !queries.empty()) {
    const auto some = queries.first(std::min(queries.size(), LightTree::kMostQueries));
    Selected selected[LightTree::kMostQueries];
    select_by_tree(some, selected);
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (selected[i].light < areas_.size()) prefetch_lines(&areas_[selected[i].light], sizeof(AreaLight));
    }
    for (std::size_t i = 0; i < some.size(); ++i)
      *samples++ = sample_selected(selected[i], some[i].point, some[i].normal, some[i].u);
    queries = queries.subspan(some.size());
  }
  for (const Query& query : queries) *samples++ = sample(query.point, query.normal, query.u_select, query.u);
}

LightSample LightSampler::sample_selected(const Selected& selected, const V3f& point, const V3f& normal,
                                          const V2f& u) const {
  if (!(selected.probability > 0)) return {};
  LightSample sample;
  if (selected.light < areas_.size()) {
    sample = sample_area(areas_[selected.light], point, u);
  } else if (selected.light < areas_.size() + punctual_.size()) {
    sample = sample_punctual(punctual_[selected.light - areas_.size()], point);
  } else {
    sample = sample_environment(normal, u);
  }
  sample.pdf_w *= selected.probability;
  sample.light = selected.light;
  return sample;
}

LightSample LightSampler::sample_punctual(const PunctualSource& source, const V3f& point) const {
  const PunctualArrival arrival = arrive(source, point);
  if (is_black(arrival.radiance)) return {};
  if (source.kind != PunctualKind::projector)
    return {arrival.direction, arrival.distance, arrival.radiance, 1.0f, true};
  const Rgb picture = projected(projectors_[source.projector], -arrival.direction, textures_);
  if (is_black(picture)) return {};
  return {arrival.direction, arrival.distance, arrival.radiance * picture, 1.0f, true};
}

LightSample LightSampler::sample_area(const AreaLight& light, const V3f& point, const V2f& u) const {
  const ShapeSample shape = sample_shape(light.shape, point, u);
  LightSample sample{shape.direction, shape.distance, light.radiance, shape.pdf_w, false, shape.cos_light};
  if ((light.textured || light.alpha != kOpaqueEmitter) && shape.pdf_w > 0) {
    const LightAlpha* alpha = light.alpha == kOpaqueEmitter ? nullptr : &alphas_[light.alpha];
    const TextureSlot& texture = emitters_[light.emitter].texture;
    sample.radiance = light_emission(light, texture, alpha, light_point(light, point, shape), textures_);
  }
  return sample;
}

Rgb LightSampler::textured_emission(const AreaEmitter& emitter, const V2f& uv) const {
  const V4f value = textures_->lookup(emitter.texture, uv);
  return {emitter.radiance.x * value.x, emitter.radiance.y * value.y, emitter.radiance.z * value.z};
}

// A constant environment: cosine-distributed above the surface, uniform over the sphere when both sides matter.
LightSample LightSampler::sample_environment(const V3f& normal, const V2f& u) const {
  LightSample sample;
  sample.distance = std::numeric_limits<float>::infinity();
  if (env_distribution_) {
    const EnvironmentSample drawn = env_distribution_->sample(u);
    sample.direction = drawn.direction;
    sample.pdf_w = drawn.pdf_w;
  } else {
    sample.direction = length_squared(normal) > 0 ? cosine_direction(normal, u) : uniform_direction(u);
    sample.pdf_w = environment_density(normal, sample.direction);
  }
  if (sample.pdf_w > 0) sample.radiance = environment_->radiance(sample.direction);
  return sample;
}

float LightSampler::environment_density(const V3f& normal, const V3f& direction) const {
  if (env_distribution_) return env_distribution_->pdf_w(direction);
  return length_squared(normal) > 0 ? std::max(dot(normal, direction), 0.0f) * kInvPi : kInvPi / 4;
}

float LightSampler::pdf_w_environment(const V3f& point, const V3f& normal, const V3f& direction) const {
  if (!environment_light_) return 0;
  const std::uint32_t light = environment_number();
  return environment_density(normal, direction) * selection_probability(point, normal, light);
}

Rgb LightSampler::environment_radiance(const V3f& direction) const {
  return environment_ ? environment_->radiance(direction) : Rgb(0, 0, 0);
}

}  // namespace helio
