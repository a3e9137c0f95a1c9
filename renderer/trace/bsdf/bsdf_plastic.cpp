#include "renderer/trace/bsdf/bsdf_plastic.h"

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

namespace {

struct InterfaceAlbedo {
  double reflected = 0, transmitted = 0;
};

// Of the two lobes of the interface with relative index eta, masked where the light leaves, by a rank-1 lattice (golden
// ratio) over visible normals.
InterfaceAlbedo interface_albedo(const Microfacet& microfacet, float mu, float eta, int points) {
  constexpr double kGoldenRatio = 0.6180339887498949;
  const V3f wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
  InterfaceAlbedo sum;
  for (int i = 0; i < points; ++i) {
    const double turn = (i + 0.5) * kGoldenRatio;
    const V2f u(float((i + 0.5) / points), float(turn - std::floor(turn)));
    const V3f m = microfacet.sample_visible_normal(wo, u);
    const float cos_m = std::max(0.0f, dot(wo, m));
    const DielectricFresnel fresnel = fresnel_dielectric(cos_m, eta);
    sum.reflected += double(microfacet.masking(m * (2 * cos_m) - wo)) * fresnel.reflectance;
    const V3f down = refract(wo, m, cos_m, fresnel.cos_t, eta);
    sum.transmitted += double(microfacet.masking(-down)) * (1 - fresnel.reflectance);
  }
  return {sum.reflected / points, sum.transmitted / points};
}

Rgb base_reflectance(const SurfaceParams& params) {
  const PlasticInterface& interface = *params.plastic;
  Rgb base = params.base_color;
  for (int c = 0; c < 3; ++c) {
    const float returned = interface.internal_reflectance * (interface.nonlinear ? base[c] : 1.0f);
    base[c] /= std::max(1e-6f, 1 - returned) * sqr(interface.eta);
  }
  return base;
}

// Probability of sampling the reflection.
float reflection_share(const SurfaceParams& params, float transmitted) {
  const float reflected = max_component(params.specular_color) * (1 - transmitted);
  const float base = max_component(params.base_color) * transmitted;
  return reflected + base > 0 ? reflected / (reflected + base) : 1.0f;
}

}  // namespace

float diffuse_internal_reflectance(float ior) {
  // Midpoints in the root of the cosine: Fresnel's reflectance has its slope at grazing incidence.
  constexpr int kSteps = 1024;
  double external = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = (i + 0.5) / kSteps;
    external += 4 * x * x * x * fresnel_dielectric(float(x * x), ior).reflectance;
  }
  external /= kSteps;
  return float(1 - (1 - external) / (double(ior) * ior));
}

float PlasticInterface::transmitted(float cosine) const {
  if (smooth) return 1 - fresnel_dielectric(cosine, eta).reflectance;
  const float x = std::clamp(cosine, 0.0f, 1.0f) * (kNodes - 1);
  const int i = std::min(int(x), kNodes - 2);
  const float t = x - float(i);
  return transmittance[std::size_t(i)] * (1 - t) + transmittance[std::size_t(i) + 1] * t;
}

std::shared_ptr<const PlasticInterface> make_plastic_interface(MicrofacetDistribution distribution, float alpha,
                                                               float ior, bool nonlinear) {
  constexpr int kOutside = 1024, kInside = 4096;
  auto interface = std::make_shared<PlasticInterface>();
  interface->nonlinear = nonlinear;
  interface->eta = ior;
  interface->smooth = alpha < kDeltaAlpha;
  if (interface->smooth) {
    interface->internal_reflectance = diffuse_internal_reflectance(ior);
    return interface;
  }
  const Microfacet microfacet{distribution, alpha};
  double inside = 0;
  for (int i = 0; i < PlasticInterface::kNodes; ++i) {
    const float mu = std::max(1e-6f, float(i) / (PlasticInterface::kNodes - 1));
    interface->transmittance[std::size_t(i)] = float(interface_albedo(microfacet, mu, ior, kOutside).transmitted);
    inside += mu * interface_albedo(microfacet, mu, 1 / ior, kInside).reflected;
  }
  interface->internal_reflectance = float(2 * inside / PlasticInterface::kNodes);
  return interface;
}

Rgb matte_plastic(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (!(wi.z > 0)) return {0, 0, 0};
  const PlasticInterface& interface = *params.plastic;
  return base_reflectance(params) *
         (interface.transmitted(wo.z) * interface.transmitted(wi.z) * cosine_hemisphere_pdf_w(wi.z));
}

BsdfValue evaluate_plastic(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (!(wi.z > 0)) return {};
  const PlasticInterface& interface = *params.plastic;
  const float entering = interface.transmitted(wo.z), share = reflection_share(params, entering);
  const float cosine_pdf = cosine_hemisphere_pdf_w(wi.z);
  BsdfValue value{base_reflectance(params) * (entering * interface.transmitted(wi.z) * cosine_pdf),
                  (1 - share) * cosine_pdf};
  const V3f h = wo + wi;
  const float squared = length_squared(h);
  if (interface.smooth || !(squared > 1e-24f)) return value;
  const V3f m = h / std::sqrt(squared);
  const Microfacet microfacet = microfacet_of(params);
  const float pdf_w = microfacet.normal_density(m) / (4 * microfacet.projected_area(wo));
  const float fresnel = fresnel_dielectric(dot(wo, m), interface.eta).reflectance;
  value.f_cos += params.specular_color * (fresnel * microfacet.masking(wi) * pdf_w);
  value.pdf_w += share * pdf_w;
  return value;
}

BsdfSample sample_plastic(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u) {
  const PlasticInterface& interface = *params.plastic;
  const float share = reflection_share(params, interface.transmitted(wo.z));
  BsdfSample sample;
  V3f wi;
  if (!(u_lobe < share)) {
    wi = square_to_cosine_hemisphere(u);
  } else if (interface.smooth) {
    sample.wi = V3f(-wo.x, -wo.y, wo.z);
    sample.weight = params.specular_color * ((1 - interface.transmitted(wo.z)) / share);
    sample.pdf_w = share;
    sample.delta = true;
    return sample;
  } else {
    const V3f m = microfacet_of(params).sample_visible_normal(wo, u);
    const float cos_m = dot(wo, m);
    if (!(cos_m > 0)) return sample;
    wi = m * (2 * cos_m) - wo;
  }
  const BsdfValue value = evaluate_plastic(params, wo, wi);
  if (!(value.pdf_w > 0) || !std::isfinite(value.pdf_w)) return sample;
  sample.wi = wi;
  sample.weight = value.f_cos / value.pdf_w;
  sample.pdf_w = value.pdf_w;
  return sample;
}

Rgb plastic_albedo(const SurfaceParams& params, const V3f& wo) {
  const PlasticInterface& interface = *params.plastic;
  const float entering = interface.transmitted(wo.z);
  // Diffuse light that leaves: 1 - R_i of it per round, in units of what Lambert's base returns.
  const float leaving = (1 - interface.internal_reflectance) * sqr(interface.eta);
  const Rgb albedo = params.specular_color * (1 - entering) + base_reflectance(params) * (entering * leaving);
  return {std::min(1.0f, albedo.x), std::min(1.0f, albedo.y), std::min(1.0f, albedo.z)};
}

}  // namespace helio
