#include "renderer/trace/bsdf/bsdf_plastic.h"

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

PlasticBsdf::PlasticBsdf(const SurfaceParams& params, bool)
    : interface_(*params.plastic),
      mirror_(params.alpha < kDeltaAlpha),
      tint_(params.specular_color),
      color_(params.base_color),
      base_(base_reflectance(params)),
      microfacet_(microfacet_of(params)) {}

void PlasticBsdf::look_from(const V3f& wo) {
  wo_ = wo;
  entering_ = interface_.transmitted(wo.z);
  share_ = reflection_share();
  if (!interface_.smooth) projected_area_ = microfacet_.projected_area(wo);
}

float PlasticBsdf::reflection_share() const {
  const float reflected = max_component(tint_) * (1 - entering_);
  const float base = max_component(color_) * entering_;
  return reflected + base > 0 ? reflected / (reflected + base) : 1.0f;
}

bool PlasticBsdf::is_pure_delta() const {
  return is_black(color_) && mirror_;
}

Rgb PlasticBsdf::matte(const V3f& wi) const {
  if (!(wi.z > 0)) return {0, 0, 0};
  return base_ * (entering_ * interface_.transmitted(wi.z) * cosine_hemisphere_pdf_w(wi.z));
}

BsdfValue PlasticBsdf::evaluate(const V3f& wi) const {
  if (!(wi.z > 0)) return {};
  const float cosine_pdf = cosine_hemisphere_pdf_w(wi.z);
  BsdfValue value{base_ * (entering_ * interface_.transmitted(wi.z) * cosine_pdf), (1 - share_) * cosine_pdf};
  const V3f h = wo_ + wi;
  const float squared = length_squared(h);
  if (interface_.smooth || !(squared > 1e-24f)) return value;
  const V3f m = h / std::sqrt(squared);
  const float pdf_w = microfacet_.normal_density(m) / (4 * projected_area_);
  const float fresnel = fresnel_dielectric(dot(wo_, m), interface_.eta).reflectance;
  value.f_cos += tint_ * (fresnel * microfacet_.masking(wi) * pdf_w);
  value.pdf_w += share_ * pdf_w;
  return value;
}

BsdfSample PlasticBsdf::sample(float u_lobe, const V2f& u) const {
  V3f wi;
  if (!(u_lobe < share_)) {
    wi = square_to_cosine_hemisphere(u);
  } else if (interface_.smooth) {
    BsdfSample sample;
    sample.wi = V3f(-wo_.x, -wo_.y, wo_.z);
    sample.weight = tint_ * ((1 - entering_) / share_);
    sample.pdf_w = share_;
    sample.delta = true;
    return sample;
  } else {
    const V3f m = microfacet_.sample_visible_normal(wo_, u);
    const float cos_m = dot(wo_, m);
    if (!(cos_m > 0)) return {};
    wi = m * (2 * cos_m) - wo_;
  }
  return sample_of(wi, evaluate(wi));
}

Rgb PlasticBsdf::albedo() const {
  // Diffuse light that leaves: 1 - R_i of it per round, in units of what Lambert's base returns.
  const float leaving = (1 - interface_.internal_reflectance) * sqr(interface_.eta);
  const Rgb albedo = tint_ * (1 - entering_) + base_ * (entering_ * leaving);
  return {std::min(1.0f, albedo.x), std::min(1.0f, albedo.y), std::min(1.0f, albedo.z)};
}

}  // namespace helio
