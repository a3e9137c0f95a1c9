// Rays that leave the lights, and the densities of having started them there.
#include "renderer/scene/images/environment.h"
#include "renderer/trace/lights/light_emission.h"
#include "renderer/trace/lights/light_sampler.h"
#include "renderer/trace/lights/shape_points.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {
namespace {

// Area that emits: both sides of a two-sided light.
double emitting_area(const AreaShape& shape) {
  return double(shape.area) * (shape.two_sided ? 2 : 1);
}

// Uniform over the area, cosine-distributed above it.
double area_density(const AreaShape& shape, float cos_light) {
  return double(cos_light) * std::numbers::inv_pi / emitting_area(shape);
}

}  // namespace

EmissionSample LightSampler::sample_emission(float u_select, const V2f& u_position, const V2f& u_direction) const {
  if (selection_ == Selection::none) return {};
  Selected selected{0, 1};
  if (selection_ != Selection::one) {
    const AliasTable::Choice choice = power_.sample(u_select);
    selected = {choice.index, choice.probability};
  }
  EmissionSample sample;
  if (selected.light < areas_.size()) {
    sample = emit_area(areas_[selected.light], u_position, u_direction);
  } else if (selected.light < environment_number()) {
    sample = emit_punctual(punctual_[selected.light - areas_.size()], u_position, u_direction);
  } else {
    sample = emit_environment(u_position, u_direction);
  }
  sample.pdf_emission *= double(selected.probability);
  if (!(sample.pdf_emission > 0)) return {};
  sample.weight *= 1 / selected.probability;
  sample.light = selected.light;
  return sample;
}

// The cosine of the emitted flux and that of the density cancel: a grazing ray weighs what every other one does.
EmissionSample LightSampler::emit_area(const AreaLight& light, const V2f& u_position, const V2f& u_direction) const {
  const ShapePoint at = sample_shape_point(light.shape, u_position);
  V2f u = u_direction;
  bool back = false;
  if (light.shape.two_sided) {
    back = u.x >= 0.5f;
    u.x = 2 * u.x - (back ? 1.0f : 0.0f);
  }
  const V3f local = square_to_cosine_hemisphere(u);
  EmissionSample sample;
  sample.origin = at.position;
  sample.normal = back ? -at.normal : at.normal;
  sample.direction = Frame(sample.normal).to_world(local);
  sample.cos_light = local.z;
  sample.pdf_emission = area_density(light.shape, local.z);
  Rgb radiance = light.radiance;
  if (light.textured || light.alpha != kOpaqueEmitter) {
    const bool planar = light.shape.kind == ShapeKind::triangle || light.shape.kind == ShapeKind::parallelogram;
    const LightAlpha* alpha = light.alpha == kOpaqueEmitter ? nullptr : &alphas_[light.alpha];
    radiance =
        light_emission(light, emitters_[light.emitter].texture, alpha, planar ? at.st : sphere_uv(at.local), textures_);
  }
  sample.weight = radiance * float(std::numbers::pi * emitting_area(light.shape));
  return sample;
}

EmissionSample LightSampler::emit_punctual(const PunctualSource& source, const V2f& u_position,
                                           const V2f& u_direction) const {
  EmissionSample sample;
  sample.delta = true;
  sample.origin = source.position;
  if (source.kind == PunctualKind::directional) {
    sample.finite = false;
    sample.direction = source.direction;
    sample.origin = disk_point(source.direction, u_position);
    sample.pdf_emission = disk_density();
    sample.weight = source.intensity * float(1 / sample.pdf_emission);
  } else if (source.kind == PunctualKind::projector) {
    const ProjectorDeparture departure = depart(projectors_[source.projector], u_direction, textures_);
    sample.direction = departure.direction;
    sample.pdf_emission = departure.pdf_w;
    sample.weight = source.intensity * departure.factor * float(1 / departure.pdf_w);
  } else {
    const PunctualDeparture departure = depart(source, u_direction);
    sample.direction = departure.direction;
    sample.pdf_emission = departure.pdf_w;
    sample.weight = departure.intensity * float(1 / departure.pdf_w);
  }
  return sample;
}

EmissionSample LightSampler::emit_environment(const V2f& u_position, const V2f& u_direction) const {
  EnvironmentSample outwards{square_to_sphere(u_direction), kSpherePdfW};
  if (env_distribution_) outwards = env_distribution_->sample(u_direction);
  if (!(outwards.pdf_w > 0)) return {};
  EmissionSample sample;
  sample.finite = false;
  sample.direction = -outwards.direction;
  sample.origin = disk_point(sample.direction, u_position);
  sample.pdf_emission = disk_density() * double(outwards.pdf_w);
  sample.weight = environment_->radiance(outwards.direction) * float(1 / sample.pdf_emission);
  return sample;
}

// Uniform on the disk across `direction` that touches the sphere around the scene from where the light comes.
V3f LightSampler::disk_point(const V3f& direction, const V2f& u) const {
  const V2f disk = square_to_disk(u);
  return scene_center_ + Frame(direction).to_world(V3f(disk.x, disk.y, -1)) * float(disk_radius_);
}

double LightSampler::pdf_emission_area(std::uint32_t emitter, float cos_light) const {
  const std::uint32_t light = light_of_emitter_[emitter];
  if (light == kNoLight) return 0;
  const AreaShape& shape = areas_[light].shape;
  const float cosine = shape.two_sided ? std::abs(cos_light) : cos_light;
  return cosine > 0 ? emission_probability(light) * area_density(shape, cosine) : 0.0;
}

double LightSampler::pdf_emission_environment(const V3f& direction) const {
  if (!environment_light_) return 0;
  const double pdf_w = double(environment_density(V3f(0, 0, 0), direction));
  return emission_probability(environment_number()) * disk_density() * pdf_w;
}

double LightSampler::pdf_emission(const LightSample& sample) const {
  if (!(sample.pdf_w > 0)) return 0;
  const double selection = emission_probability(sample.light);
  if (sample.light < areas_.size()) return selection * area_density(areas_[sample.light].shape, sample.cos_light);
  if (sample.light >= environment_number()) return pdf_emission_environment(sample.direction);
  const PunctualSource& source = punctual_[sample.light - areas_.size()];
  if (source.kind == PunctualKind::directional) return selection * disk_density();
  if (source.kind == PunctualKind::projector)
    return selection * departure_pdf_w(projectors_[source.projector], -sample.direction);
  return selection * departure_pdf_w(source);
}

double LightSampler::pdf_w_direct(const EmissionSample& emission, const V3f& point, const V3f& normal) const {
  if (!(emission.pdf_emission > 0)) return 0;
  const std::uint32_t light = emission.light;
  if (!emission.finite) {
    const float pdf_w = emission.delta ? 1.0f : environment_density(normal, -emission.direction);
    return pdf_w * selection_probability(point, normal, light);
  }
  const V3f to_light = emission.origin - point;
  const float squared = length_squared(to_light);
  if (!(squared > 1e-30f)) return 0;
  const float distance = std::sqrt(squared);
  if (emission.delta) return range_window(light, distance) > 0 ? selection_probability(point, normal, light) : 0.0f;
  const V3f direction = to_light * (1 / distance);
  const AreaShape& shape = areas_[light].shape;
  const float emitted = -dot(emission.normal, direction);  // on the side that emits
  if (!(emitted > 0)) return 0;
  const bool round = shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::ellipsoid;
  const V3f front = round ? emission.origin - shape.center : shape.normal;
  const float cos_light = std::copysign(emitted, dot(emission.normal, front));
  return pdf_w_shape(shape, point, direction, distance, cos_light) * selection_probability(point, normal, light);
}

float LightSampler::range_window(std::uint32_t light, float distance) const {
  const bool punctual = light >= areas_.size() && light < environment_number();
  return punctual ? helio::range_window(punctual_[light - areas_.size()], distance) : 1.0f;
}

}  // namespace helio
