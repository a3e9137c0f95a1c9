#include "renderer/trace/bsdf/bsdf_principled.h"

#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

namespace {

constexpr float kCoatF0 = 0.04f, kCoatMaskingAlpha = 0.25f;

// Generalized Trowbridge-Reitz with exponent 1 (Burley 2012, appendix B.2), alpha in (0, 1).
float gtr1_density(float alpha, float cos_m) {
  const float a2 = alpha * alpha;
  return (a2 - 1) / (kPi * std::log(a2) * (1 + (a2 - 1) * cos_m * cos_m));
}

// A normal with density gtr1_density x its cosine.
V3f sample_gtr1(float alpha, const V2f& u) {
  const float a2 = alpha * alpha;
  const float cos2 = std::clamp((1 - std::pow(a2, 1 - u.y)) / (1 - a2), 0.0f, 1.0f);
  const float sine = std::sqrt(1 - cos2), phi = kTwoPi * u.x;
  return {sine * std::cos(phi), sine * std::sin(phi), std::sqrt(cos2)};
}

Rgb tint_of(const Rgb& color) {
  const float lum = luminance(color);
  return lum > 0 ? color / lum : Rgb(1, 1, 1);
}

Rgb schlick(const Rgb& f0, float s) {
  return f0 + (Rgb(1, 1, 1) - f0) * s;
}

}  // namespace

PrincipledBsdf::PrincipledBsdf(const SurfaceParams& params, bool inside)
    : p_(params.principled),
      base_(params.base_color),
      metal_(params.metallic),
      inside_(inside),
      facets_(microfacet_of(params)) {
  eta_ = inside ? 1 / params.ior : params.ior;
  glass_ = (1 - metal_) * params.transmission;
  diffuse_ = inside ? 0.0f : (1 - metal_) * (1 - params.transmission);
  roughness_ = safe_sqrt(params.alpha);
  coat_alpha_ = 0.1f + (0.001f - 0.1f) * p_.clearcoat_gloss;
  const float coat = inside ? 0.0f : 0.25f * p_.clearcoat, sum = diffuse_ + coat + 1;
  choose_diffuse_ = diffuse_ / sum;
  choose_coat_ = coat / sum;
  choose_facets_ = 1 - choose_diffuse_ - choose_coat_;
}

void PrincipledBsdf::look_from(const V3f& wo) {
  wo_ = wo;
  projected_area_ = facets_.projected_area(wo);
}

BsdfValue PrincipledBsdf::evaluate(const V3f& wi) const {
  if (wi.z < 0) return refraction(wi);
  const V3f h = wo_ + wi;
  const float squared = length_squared(h);
  if (!(wi.z > 0) || !(squared > 1e-24f)) return {};
  const V3f m = h / std::sqrt(squared);
  const float cos_m = dot(wo_, m), schlick_m = schlick_term(cos_m);
  const float dielectric = fresnel_dielectric(cos_m, eta_).reflectance;
  const float pdf_m = facets_.normal_density(m) / (4 * projected_area_);
  BsdfValue value{reflectance(dielectric, schlick_m) * (facets_.masking(wi) * pdf_m),
                  choose_facets_ * reflected_share(dielectric) * pdf_m};
  if (diffuse_ > 0) {
    value.f_cos += diffuse_cos(wi.z, cos_m);
    value.f_cos += sheen_color() * (p_.sheen * (1 - metal_) * schlick_m * wi.z);
    value.pdf_w += choose_diffuse_ * cosine_hemisphere_pdf_w(wi.z);
  }
  if (choose_coat_ > 0) {
    const Microfacet masking{MicrofacetDistribution::ggx, kCoatMaskingAlpha};
    const float density = gtr1_density(coat_alpha_, m.z);
    value.f_cos += Rgb(0.25f * p_.clearcoat * (kCoatF0 + (1 - kCoatF0) * schlick_m) * density * masking.masking(wo_) *
                       masking.masking(wi) * wi.z);
    value.pdf_w += choose_coat_ * density * m.z / (4 * cos_m);
  }
  return value;
}

Rgb PrincipledBsdf::matte(const V3f& wi) const {
  const V3f h = wo_ + wi;
  const float squared = length_squared(h);
  if (!(diffuse_ > 0) || !(wi.z > 0) || !(squared > 1e-24f)) return {0, 0, 0};
  return diffuse_cos(wi.z, dot(wo_, h) / std::sqrt(squared));
}

BsdfSample PrincipledBsdf::sample(float u_lobe, const V2f& u) const {
  if (u_lobe < choose_diffuse_) return finish(square_to_cosine_hemisphere(u));
  u_lobe -= choose_diffuse_;
  if (u_lobe < choose_coat_) return reflect_about(sample_gtr1(coat_alpha_, u));
  u_lobe = std::min((u_lobe - choose_coat_) / choose_facets_, kOneMinusEpsilon);
  const V3f m = facets_.sample_visible_normal(wo_, u);
  const float cos_m = dot(wo_, m);
  if (!(cos_m > 0)) return {};
  const DielectricFresnel fresnel = fresnel_dielectric(cos_m, eta_);
  if (u_lobe < reflected_share(fresnel.reflectance)) return reflect_about(m);
  const V3f wi = refract(wo_, m, cos_m, fresnel.cos_t, eta_);
  if (!(wi.z < 0)) return {};
  BsdfSample sample = finish(wi);
  sample.transmitted = sample.valid();
  if (sample.valid()) sample.eta = eta_;
  return sample;
}

Rgb PrincipledBsdf::albedo() const {
  const AlbedoTerms terms = directional_albedo(MicrofacetDistribution::ggx, facets_.alpha, wo_.z);
  const float s = schlick_term(wo_.z), dielectric = fresnel_dielectric(wo_.z, eta_).reflectance;
  const Rgb root(std::sqrt(base_.x), std::sqrt(base_.y), std::sqrt(base_.z));
  Rgb sum = reflectance(dielectric, s) * (terms.a + terms.b) + root * (glass_ * (1 - dielectric));
  sum += base_ * (diffuse_ * (1 - dielectric));
  return {std::min(1.0f, sum.x), std::min(1.0f, sum.y), std::min(1.0f, sum.z)};
}

Rgb PrincipledBsdf::reflectance(float dielectric, float schlick_m) const {
  if (inside_) return Rgb(glass_ * dielectric);
  Rgb f((1 - metal_) * (1 - p_.spec_tint) * dielectric);
  if (metal_ > 0) f += schlick(base_, schlick_m) * metal_;
  if (p_.spec_tint > 0) f += schlick(tint_of(base_) * dielectric_f0(eta_), schlick_m) * ((1 - metal_) * p_.spec_tint);
  return f;
}

Rgb PrincipledBsdf::diffuse_cos(float cos_i, float cos_d) const {
  const float cos_o = wo_.z;
  const float so = schlick_term(cos_o), si = schlick_term(cos_i), retro = 2 * roughness_ * sqr(cos_d);
  float shape = cos_i * ((1 - 0.5f * so) * (1 - 0.5f * si) + retro * (so + si + so * si * (retro - 1)));
  if (p_.flatness > 0) {
    const float f90 = 0.5f * retro;
    const float fss = (1 + (f90 - 1) * so) * (1 + (f90 - 1) * si);
    const float flat = 1.25f * (fss * (cos_i / (cos_o + cos_i) - 0.5f * cos_i) + 0.5f * cos_i);
    shape += (flat - shape) * p_.flatness;
  }
  return base_ * (diffuse_ * shape * kInvPi);
}

Rgb PrincipledBsdf::sheen_color() const {
  return p_.sheen_tint > 0 ? Rgb(1, 1, 1) + (tint_of(base_) - Rgb(1, 1, 1)) * p_.sheen_tint : Rgb(1, 1, 1);
}

// As evaluate_refraction of bsdf_layered.cpp.
BsdfValue PrincipledBsdf::refraction(const V3f& wi) const {
  if (!(glass_ > 0)) return {};
  const V3f h = wo_ + wi * eta_;
  const float squared = length_squared(h);
  if (!(squared > 1e-24f) || h.z == 0) return {};
  const V3f m = h * (std::copysign(1.0f, h.z) / std::sqrt(squared));
  const float cos_m = dot(wo_, m);
  if (!(cos_m > 0) || !(dot(wi, m) < 0)) return {};
  const DielectricFresnel fresnel = fresnel_dielectric(cos_m, eta_);
  const float difference = (eta_ - 1) * (eta_ + 1) / (cos_m + eta_ * fresnel.cos_t);
  const float density_m = facets_.normal_density(m) * cos_m / projected_area_;
  const float radiance_pdf = density_m * fresnel.cos_t / sqr(difference);  // pdf / eta^2
  const Rgb root(std::sqrt(base_.x), std::sqrt(base_.y), std::sqrt(base_.z));
  return {root * (glass_ * (1 - fresnel.reflectance) * facets_.masking(V3f(wi.x, wi.y, -wi.z)) * radiance_pdf),
          choose_facets_ * (1 - reflected_share(fresnel.reflectance)) * sqr(eta_) * radiance_pdf};
}

BsdfSample PrincipledBsdf::reflect_about(const V3f& m) const {
  const float cos_m = dot(wo_, m);
  const V3f wi = m * (2 * cos_m) - wo_;
  if (!(cos_m > 0) || !(wi.z > 0)) return {};
  return finish(wi);
}

}  // namespace helio
