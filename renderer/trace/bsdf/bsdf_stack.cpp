#include "renderer/trace/bsdf/bsdf_stack.h"

#include "renderer/trace/bsdf/bsdf_metallic_roughness.h"
#include "renderer/trace/bsdf/bsdf_sheen.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

namespace {

constexpr float kCoatF0 = 0.04f;

float mean(const Rgb& c) {
  return (c.x + c.y + c.z) * (1.0f / 3);
}

V3f raised(const V3f& w) {
  return {w.x, w.y, std::fabs(w.z)};
}

BsdfValue sum(const BsdfValue& a, const BsdfValue& b) {
  return {a.f_cos + b.f_cos, a.pdf_w + b.pdf_w};
}

V3f uniform_hemisphere(const V2f& u) {
  const float radius = std::sqrt(u.y * (2 - u.y)), phi = kTwoPi * u.x;
  return {radius * std::cos(phi), radius * std::sin(phi), 1 - u.y};
}

}  // namespace

StackBsdf::StackBsdf(const SurfaceParams& params, bool inside)
    : inside_(inside), thin_(params.thin), base_(metallic_roughness_lobes(params, inside)) {
  const LayerParams& layers = *params.layers;
  coat_ = layers.clearcoat;
  coat_alpha_ = layers.clearcoat_alpha < kDeltaAlpha ? 0.0f : layers.clearcoat_alpha;
  if (coat_ > 0) coat_frame_ = Frame(layers.clearcoat_normal);
  sheen_ = layers.sheen_color;
  sheen_max_ = max_component(sheen_);
  sheen_alpha_ = std::max(layers.sheen_alpha, kLeastSheenAlpha);

  const float opaque = (1 - params.metallic) * (1 - params.transmission);
  if (layers.diffuse_transmission > 0) {
    far_diffuse_ = layers.diffuse_transmission_color * (opaque * layers.diffuse_transmission);
    base_.diffuse *= 1 - layers.diffuse_transmission;
  }
  if (layers.anisotropy > 0) {
    const float along = params.alpha + (1 - params.alpha) * sqr(layers.anisotropy), across = params.alpha;
    base_.mirror = along < kDeltaAlpha;
    if (!base_.mirror) {
      base_.microfacet.distribution = MicrofacetDistribution::ggx_anisotropic;
      base_.microfacet.alpha_along = along;
      base_.microfacet.alpha_across = std::max(across, kDeltaAlpha);
      base_.microfacet.along = layers.anisotropy_direction;
      base_.microfacet.alpha = std::sqrt(along * base_.microfacet.alpha_across);
      base_.albedo_row = albedo_row(base_.microfacet.distribution, base_.microfacet.alpha);
    }
  }
  if (layers.iridescence > 0 && layers.film_thickness > 0) {
    const Rgb tinted = params.specular_color * dielectric_f0(params.ior);
    film_.cover = layers.iridescence;
    film_.ior = layers.film_ior;
    film_.thickness = layers.film_thickness;
    film_.metal = params.metallic;
    film_.metal_f0 = params.base_color;
    film_.dielectric = opaque * params.specular;
    film_.dielectric_f0 = {std::min(1.0f, tinted.x), std::min(1.0f, tinted.y), std::min(1.0f, tinted.z)};
    film_.glass_weight = params.specular;
    base_.film = &film_;
  }
}

float StackBsdf::coat_albedo(const V3f& w) const {
  const float mu = std::min(1.0f, std::fabs(dot(w, coat_frame_.n)));
  if (coat_alpha_ == 0) return kCoatF0 + (1 - kCoatF0) * schlick_term(mu);
  return directional_albedo(MicrofacetDistribution::ggx, coat_alpha_, mu).albedo(kCoatF0, 1);
}

StackBsdf::Passing StackBsdf::passing(const V3f& w) const {
  Passing p;
  const V3f above = raised(w);
  if (coat_ > 0) {
    p.coat_albedo = coat_albedo(above);
    p.coat = 1 - coat_ * p.coat_albedo;
  }
  p.both = p.coat;
  if (sheen_max_ > 0) {
    p.sheen_albedo = sheen_albedo(sheen_alpha_, above.z);
    p.both *= 1 - sheen_max_ * std::min(1.0f, p.sheen_albedo);
  }
  return p;
}

StackBsdf::Passing StackBsdf::shared(const V3f& wi) const {
  if (inside_) return wi.z > 0 ? Passing{} : passing(wi);
  if (wi.z < 0 && !thin_) return from_;
  const Passing to = passing(wi);
  return {std::min(from_.coat, to.coat), std::min(from_.both, to.both), to.coat_albedo, to.sheen_albedo};
}

void StackBsdf::look_from(const V3f& wo) {
  if (base_.film && (!is_black(base_.diffuse) || !is_black(far_diffuse_))) {
    base_.filmed_base = &filmed_base_.emplace(FilmedBase::recent(
        film_, base_.coat_f0, film_.glass_weight, base_.microfacet.distribution, base_.microfacet.alpha));
  }
  wo_ = wo;
  base_view_ = view_along(base_, wo);
  base_albedo_ = layered_albedo(base_, wo);
  from_ = inside_ ? Passing{} : passing(wo);
  const float coat = coated() ? coat_ * from_.coat_albedo : 0.0f;
  const float sheen = has_sheen() ? from_.coat * mean(sheen_) * std::min(1.0f, from_.sheen_albedo) : 0.0f;
  float far = 0;
  if (!is_black(far_diffuse_)) {
    far_entry_ = base_entry(base_, wo.z);
    far = from_.both * mean(far_diffuse_ * far_entry_);
  }
  const bool has_base =
      !is_black(base_.diffuse) || !is_black(base_.r0) || base_.r90 > 0 || base_.passage != Passage::none;
  // A floor, because the estimate of the base knows nothing of a film.
  const float others = coat + sheen + far;
  const float base = has_base ? std::max(from_.both * mean(base_albedo_), 0.05f * others + 1e-6f) : 0.0f;
  const float sum = others + base;
  if (!(sum > 0)) return;
  choose_coat_ = coat / sum;
  choose_sheen_ = sheen / sum;
  choose_far_ = far / sum;
  choose_base_ = base > 0 ? std::max(0.0f, 1 - choose_coat_ - choose_sheen_ - choose_far_) : 0.0f;
}

BsdfValue StackBsdf::base_value(const V3f& wi, const Passing& passed) const {
  if (!(choose_base_ > 0)) return {};
  BsdfValue value = evaluate_layered(base_, base_view_, wi);
  if (value.pdf_w > 0) value.f_cos *= passed.both;
  value.pdf_w *= choose_base_;
  return value;
}

// The coat as a mirror has no value. Half vectors of directions above both the surface and the coat.
BsdfValue StackBsdf::coat_value(const V3f& wi) const {
  if (!(choose_coat_ > 0) || coat_alpha_ == 0 || !(wi.z > 0)) return {};
  const V3f o = coat_frame_.to_local(wo_), i = coat_frame_.to_local(wi), h = o + i;
  const float squared = length_squared(h);
  if (!(o.z > 0) || !(i.z > 0) || !(squared > 1e-24f)) return {};
  const V3f m = h / std::sqrt(squared);
  const Microfacet facets{MicrofacetDistribution::ggx, coat_alpha_};
  const float pdf = facets.normal_density(m) / (4 * facets.projected_area(o));
  const float fresnel = kCoatF0 + (1 - kCoatF0) * schlick_term(dot(o, m));
  return {Rgb(coat_ * fresnel * facets.masking(i) * pdf), choose_coat_ * pdf};
}

BsdfValue StackBsdf::sheen_value(const V3f& wi, const Passing& passed) const {
  if (!(choose_sheen_ > 0) || !(wi.z > 0)) return {};
  const float lobe = evaluate_sheen(sheen_alpha_, wo_, wi, from_.sheen_albedo, passed.sheen_albedo);
  return {sheen_ * (passed.coat * lobe), choose_sheen_ * (0.5f * kInvPi)};
}

BsdfValue StackBsdf::far_diffuse_value(const V3f& wi, const Passing& passed) const {
  if (!(choose_far_ > 0) || !(wi.z < 0)) return {};
  const float pdf = cosine_hemisphere_pdf_w(-wi.z);
  BsdfValue value;
  value.f_cos = far_diffuse_ * far_entry_ * base_exit(base_, -wi.z) * (pdf * passed.both);
  value.pdf_w = choose_far_ * pdf;
  return value;
}

BsdfValue StackBsdf::evaluate(const V3f& wi) const {
  const Passing passed = shared(wi);
  const BsdfValue base = base_value(wi, passed);
  if (wi.z > 0) return sum(base, sum(coat_value(wi), sheen_value(wi, passed)));
  return wi.z < 0 ? sum(base, far_diffuse_value(wi, passed)) : BsdfValue{};
}

Rgb StackBsdf::matte(const V3f& wi) const {
  if (wi.z > 0) return choose_base_ > 0 ? matte_layered(base_, base_view_, wi) * shared(wi).both : Rgb(0, 0, 0);
  return far_diffuse_value(wi, shared(wi)).f_cos;
}

BsdfSample StackBsdf::finish(const V3f& wi) const {
  BsdfSample sample = sample_of(wi, evaluate(wi));
  sample.transmitted = sample.valid() && wi.z < 0;
  return sample;
}

BsdfSample StackBsdf::sample_base(float u_lobe, const V2f& u) const {
  const BsdfSample own = sample_layered(base_, base_view_, u_lobe, u);
  if (!own.valid()) return {};
  const Passing shares = shared(own.wi);
  const Rgb passed = own.weight * shares.both;
  BsdfSample sample;
  if (own.delta) {
    sample = own;
    sample.weight = passed / choose_base_;
    sample.pdf_w = own.pdf_w * choose_base_;
    return sample;
  }
  BsdfValue value{passed * own.pdf_w, own.pdf_w * choose_base_};
  if (own.wi.z > 0)
    value = sum(value, sum(coat_value(own.wi), sheen_value(own.wi, shares)));
  else
    value = sum(value, far_diffuse_value(own.wi, shares));
  sample = sample_of(own.wi, value);
  sample.transmitted = sample.valid() && own.transmitted;
  if (sample.valid()) sample.eta = own.eta;
  return sample;
}

BsdfSample StackBsdf::sample_coat(const V2f& u) const {
  const V3f o = coat_frame_.to_local(wo_);
  if (!(o.z > 0)) return {};
  V3f m(0, 0, 1);
  if (coat_alpha_ > 0) m = Microfacet{MicrofacetDistribution::ggx, coat_alpha_}.sample_visible_normal(o, u);
  const float cos_m = dot(o, m);
  const V3f i = m * (2 * cos_m) - o;
  if (!(cos_m > 0) || !(i.z > 0)) return {};
  const V3f wi = coat_frame_.n == V3f(0, 0, 1) ? i : coat_frame_.to_world(i);
  if (!(wi.z > 0)) return {};
  if (coat_alpha_ > 0) return finish(wi);
  BsdfSample sample;
  sample.wi = wi;
  sample.pdf_w = choose_coat_;
  sample.weight = Rgb(coat_ * (kCoatF0 + (1 - kCoatF0) * schlick_term(cos_m)) / choose_coat_);
  sample.delta = true;
  return sample;
}

BsdfSample StackBsdf::sample(float u_lobe, const V2f& u) const {
  if (u_lobe < choose_coat_) return sample_coat(u);
  u_lobe -= choose_coat_;
  if (u_lobe < choose_sheen_) return finish(uniform_hemisphere(u));
  u_lobe -= choose_sheen_;
  if (u_lobe < choose_far_) {
    const V3f up = square_to_cosine_hemisphere(u);
    return finish(V3f(up.x, up.y, -up.z));
  }
  u_lobe -= choose_far_;
  if (!(choose_base_ > 0)) return {};
  return sample_base(std::clamp(u_lobe / choose_base_, 0.0f, kOneMinusEpsilon), u);
}

bool StackBsdf::is_pure_delta() const {
  if (!is_black(far_diffuse_) || sheen_max_ > 0 || (coat_ > 0 && coat_alpha_ > 0)) return false;
  return helio::is_pure_delta(base_);
}

Rgb StackBsdf::albedo() const {
  Rgb albedo = base_albedo_ * from_.both;
  if (!is_black(far_diffuse_)) albedo += far_diffuse_ * far_entry_ * from_.both;
  if (coated()) albedo += Rgb(coat_ * from_.coat_albedo);
  if (has_sheen()) albedo += sheen_ * (from_.coat * std::min(1.0f, from_.sheen_albedo));
  return {std::min(1.0f, albedo.x), std::min(1.0f, albedo.y), std::min(1.0f, albedo.z)};
}

}  // namespace helio
