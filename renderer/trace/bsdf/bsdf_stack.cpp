#include "renderer/trace/bsdf/bsdf_stack.h"

#include <optional>

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

// The layers of one surface, with the choice between them for one wo.
class Stack {
 public:
  Stack(const SurfaceParams& params, bool inside);
  Stack(const Stack&) = delete;  // base_ points to film_ and filmed_base_
  Stack& operator=(const Stack&) = delete;

  void look_from(const V3f& wo);
  BsdfValue evaluate(const V3f& wo, const V3f& wi) const;
  Rgb matte(const V3f& wo, const V3f& wi) const;
  BsdfSample sample(const V3f& wo, float u_lobe, const V2f& u) const;
  bool pure_delta() const;
  Rgb albedo(const V3f& wo);

 private:
  // 1 - albedo of the coat, and of coat and sheen, towards w on either side of the surface.
  struct Passing {
    float coat = 1, both = 1;
  };
  Passing passing(const V3f& w) const;
  Passing shared(const V3f& wi) const;

  float coat_albedo(const V3f& w) const;
  bool coated() const { return coat_ > 0 && !inside_; }
  bool has_sheen() const { return sheen_max_ > 0 && !inside_; }

  BsdfValue base_value(const V3f& wo, const V3f& wi) const;
  BsdfValue coat_value(const V3f& wo, const V3f& wi) const;
  BsdfValue sheen_value(const V3f& wo, const V3f& wi) const;
  BsdfValue far_diffuse_value(const V3f& wi) const;
  BsdfSample finish(const V3f& wo, const V3f& wi) const;
  BsdfSample sample_base(const V3f& wo, float u_lobe, const V2f& u) const;
  BsdfSample sample_coat(const V3f& wo, const V2f& u) const;

  const bool inside_, thin_;
  LayeredLobes base_;
  ThinFilm film_;
  std::optional<FilmedBase> filmed_base_;
  Rgb far_diffuse_{0, 0, 0};
  float coat_ = 0, coat_alpha_ = 0;
  V3f coat_normal_;
  Rgb sheen_{0, 0, 0};
  float sheen_max_ = 0, sheen_alpha_ = 1;

  // For the current wo.
  Passing from_;
  float choose_coat_ = 0, choose_sheen_ = 0, choose_far_ = 0, choose_base_ = 1;
  Rgb far_entry_{0, 0, 0};
};

Stack::Stack(const SurfaceParams& params, bool inside)
    : inside_(inside), thin_(params.thin), base_(metallic_roughness_lobes(params, inside)) {
  const LayerParams& layers = *params.layers;
  coat_ = layers.clearcoat;
  coat_alpha_ = layers.clearcoat_alpha < kDeltaAlpha ? 0.0f : layers.clearcoat_alpha;
  coat_normal_ = layers.clearcoat_normal;
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

float Stack::coat_albedo(const V3f& w) const {
  const float mu = std::min(1.0f, std::fabs(dot(w, coat_normal_)));
  if (coat_alpha_ == 0) return kCoatF0 + (1 - kCoatF0) * schlick_term(mu);
  return directional_albedo(MicrofacetDistribution::ggx, coat_alpha_, mu).albedo(kCoatF0, 1);
}

Stack::Passing Stack::passing(const V3f& w) const {
  Passing p;
  const V3f above = raised(w);
  if (coat_ > 0) p.coat = 1 - coat_ * coat_albedo(above);
  p.both = p.coat;
  if (sheen_max_ > 0) p.both *= 1 - sheen_max_ * std::min(1.0f, sheen_albedo(sheen_alpha_, above.z));
  return p;
}

// What the layers let through on the way between wo and wi.
Stack::Passing Stack::shared(const V3f& wi) const {
  if (inside_) return wi.z > 0 ? Passing{} : passing(wi);
  if (wi.z < 0 && !thin_) return from_;
  const Passing to = passing(wi);
  return {std::min(from_.coat, to.coat), std::min(from_.both, to.both)};
}

void Stack::look_from(const V3f& wo) {
  if (base_.film && (!is_black(base_.diffuse) || !is_black(far_diffuse_))) {
    filmed_base_ = FilmedBase::recent(film_, base_.coat_f0, film_.glass_weight, base_.microfacet.distribution,
                                      base_.microfacet.alpha);
    base_.filmed_base = &*filmed_base_;
  }
  from_ = inside_ ? Passing{} : passing(wo);
  const float coat = coated() ? coat_ * coat_albedo(wo) : 0.0f;
  const float sheen = has_sheen() ? from_.coat * mean(sheen_) * std::min(1.0f, sheen_albedo(sheen_alpha_, wo.z)) : 0.0f;
  float far = 0;
  if (!is_black(far_diffuse_)) {
    far_entry_ = base_entry(base_, wo.z);
    far = from_.both * mean(far_diffuse_ * far_entry_);
  }
  const bool has_base =
      !is_black(base_.diffuse) || !is_black(base_.r0) || base_.r90 > 0 || base_.passage != Passage::none;
  // A floor, because the estimate of the base knows nothing of a film.
  const float others = coat + sheen + far;
  const float base = has_base ? std::max(from_.both * mean(layered_albedo(base_, wo)), 0.05f * others + 1e-6f) : 0.0f;
  const float sum = others + base;
  if (!(sum > 0)) return;
  choose_coat_ = coat / sum;
  choose_sheen_ = sheen / sum;
  choose_far_ = far / sum;
  choose_base_ = base > 0 ? std::max(0.0f, 1 - choose_coat_ - choose_sheen_ - choose_far_) : 0.0f;
}

BsdfValue Stack::base_value(const V3f& wo, const V3f& wi) const {
  if (!(choose_base_ > 0)) return {};
  BsdfValue value = evaluate_layered(base_, wo, wi);
  if (value.pdf_w > 0) value.f_cos *= shared(wi).both;
  value.pdf_w *= choose_base_;
  return value;
}

// The coat as a mirror has no value. Half vectors of directions above both the surface and the coat.
BsdfValue Stack::coat_value(const V3f& wo, const V3f& wi) const {
  if (!(choose_coat_ > 0) || coat_alpha_ == 0 || !(wi.z > 0)) return {};
  const Frame frame(coat_normal_);
  const V3f o = frame.to_local(wo), i = frame.to_local(wi), h = o + i;
  const float squared = length_squared(h);
  if (!(o.z > 0) || !(i.z > 0) || !(squared > 1e-24f)) return {};
  const V3f m = h / std::sqrt(squared);
  const Microfacet facets{MicrofacetDistribution::ggx, coat_alpha_};
  const float pdf = facets.normal_density(m) / (4 * facets.projected_area(o));
  const float fresnel = kCoatF0 + (1 - kCoatF0) * schlick_term(dot(o, m));
  return {Rgb(coat_ * fresnel * facets.masking(i) * pdf), choose_coat_ * pdf};
}

BsdfValue Stack::sheen_value(const V3f& wo, const V3f& wi) const {
  if (!(choose_sheen_ > 0) || !(wi.z > 0)) return {};
  return {sheen_ * (shared(wi).coat * evaluate_sheen(sheen_alpha_, wo, wi)), choose_sheen_ * (0.5f * kInvPi)};
}

BsdfValue Stack::far_diffuse_value(const V3f& wi) const {
  if (!(choose_far_ > 0) || !(wi.z < 0)) return {};
  const float pdf = cosine_hemisphere_pdf_w(-wi.z);
  BsdfValue value;
  value.f_cos = far_diffuse_ * far_entry_ * base_exit(base_, -wi.z) * (pdf * shared(wi).both);
  value.pdf_w = choose_far_ * pdf;
  return value;
}

BsdfValue sum(const BsdfValue& a, const BsdfValue& b) {
  return {a.f_cos + b.f_cos, a.pdf_w + b.pdf_w};
}

BsdfValue Stack::evaluate(const V3f& wo, const V3f& wi) const {
  const BsdfValue base = base_value(wo, wi);
  if (wi.z > 0) return sum(base, sum(coat_value(wo, wi), sheen_value(wo, wi)));
  return wi.z < 0 ? sum(base, far_diffuse_value(wi)) : BsdfValue{};
}

Rgb Stack::matte(const V3f& wo, const V3f& wi) const {
  if (wi.z > 0) return choose_base_ > 0 ? matte_layered(base_, wo, wi) * shared(wi).both : Rgb(0, 0, 0);
  return far_diffuse_value(wi).f_cos;
}

BsdfSample Stack::finish(const V3f& wo, const V3f& wi) const {
  BsdfSample sample = sample_of(wi, evaluate(wo, wi));
  sample.transmitted = sample.valid() && wi.z < 0;
  return sample;
}

BsdfSample Stack::sample_base(const V3f& wo, float u_lobe, const V2f& u) const {
  const BsdfSample own = sample_layered(base_, wo, u_lobe, u);
  if (!own.valid()) return {};
  const Rgb passed = own.weight * shared(own.wi).both;
  BsdfSample sample;
  if (own.delta) {
    sample = own;
    sample.weight = passed / choose_base_;
    sample.pdf_w = own.pdf_w * choose_base_;
    return sample;
  }
  BsdfValue value{passed * own.pdf_w, own.pdf_w * choose_base_};
  if (own.wi.z > 0)
    value = sum(value, sum(coat_value(wo, own.wi), sheen_value(wo, own.wi)));
  else
    value = sum(value, far_diffuse_value(own.wi));
  sample = sample_of(own.wi, value);
  sample.transmitted = sample.valid() && own.transmitted;
  if (sample.valid()) sample.eta = own.eta;
  return sample;
}

BsdfSample Stack::sample_coat(const V3f& wo, const V2f& u) const {
  const Frame frame(coat_normal_);
  const V3f o = frame.to_local(wo);
  if (!(o.z > 0)) return {};
  V3f m(0, 0, 1);
  if (coat_alpha_ > 0) m = Microfacet{MicrofacetDistribution::ggx, coat_alpha_}.sample_visible_normal(o, u);
  const float cos_m = dot(o, m);
  const V3f i = m * (2 * cos_m) - o;
  if (!(cos_m > 0) || !(i.z > 0)) return {};
  const V3f wi = coat_normal_ == V3f(0, 0, 1) ? i : frame.to_world(i);
  if (!(wi.z > 0)) return {};
  if (coat_alpha_ > 0) return finish(wo, wi);
  BsdfSample sample;
  sample.wi = wi;
  sample.pdf_w = choose_coat_;
  sample.weight = Rgb(coat_ * (kCoatF0 + (1 - kCoatF0) * schlick_term(cos_m)) / choose_coat_);
  sample.delta = true;
  return sample;
}

V3f uniform_hemisphere(const V2f& u) {
  const float radius = std::sqrt(u.y * (2 - u.y)), phi = kTwoPi * u.x;
  return {radius * std::cos(phi), radius * std::sin(phi), 1 - u.y};
}

BsdfSample Stack::sample(const V3f& wo, float u_lobe, const V2f& u) const {
  if (u_lobe < choose_coat_) return sample_coat(wo, u);
  u_lobe -= choose_coat_;
  if (u_lobe < choose_sheen_) return finish(wo, uniform_hemisphere(u));
  u_lobe -= choose_sheen_;
  if (u_lobe < choose_far_) {
    const V3f up = square_to_cosine_hemisphere(u);
    return finish(wo, V3f(up.x, up.y, -up.z));
  }
  u_lobe -= choose_far_;
  if (!(choose_base_ > 0)) return {};
  return sample_base(wo, std::clamp(u_lobe / choose_base_, 0.0f, kOneMinusEpsilon), u);
}

bool Stack::pure_delta() const {
  if (!is_black(far_diffuse_) || sheen_max_ > 0 || (coat_ > 0 && coat_alpha_ > 0)) return false;
  return is_pure_delta(base_);
}

Rgb Stack::albedo(const V3f& wo) {
  look_from(wo);
  Rgb albedo = layered_albedo(base_, wo) * from_.both;
  if (!is_black(far_diffuse_)) albedo += far_diffuse_ * far_entry_ * from_.both;
  if (coated()) albedo += Rgb(coat_ * coat_albedo(wo));
  if (has_sheen()) albedo += sheen_ * (from_.coat * std::min(1.0f, sheen_albedo(sheen_alpha_, wo.z)));
  return {std::min(1.0f, albedo.x), std::min(1.0f, albedo.y), std::min(1.0f, albedo.z)};
}

}  // namespace

BsdfValue evaluate_stack(const SurfaceParams& params, bool inside, const V3f& wo, const V3f& wi) {
  Stack stack(params, inside);
  stack.look_from(wo);
  return stack.evaluate(wo, wi);
}

Rgb matte_stack(const SurfaceParams& params, bool inside, const V3f& wo, const V3f& wi) {
  Stack stack(params, inside);
  stack.look_from(wo);
  return stack.matte(wo, wi);
}

BsdfSample sample_stack(const SurfaceParams& params, bool inside, const V3f& wo, float u_lobe, const V2f& u) {
  Stack stack(params, inside);
  stack.look_from(wo);
  return stack.sample(wo, u_lobe, u);
}

bool is_pure_delta_stack(const SurfaceParams& params) {
  return Stack(params, false).pure_delta();
}

Rgb stack_albedo(const SurfaceParams& params, bool inside, const V3f& wo) {
  return Stack(params, inside).albedo(wo);
}

}  // namespace helio
