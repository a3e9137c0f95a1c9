#include "renderer/trace/bsdf/bsdf_layered.h"

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

namespace {

float mean(const Rgb& c) {
  return (c.x + c.y + c.z) * (1.0f / 3);
}

Rgb lerp(const Rgb& f0, float f90, float s) {
  return {f0.x + (f90 - f0.x) * s, f0.y + (f90 - f0.y) * s, f0.z + (f90 - f0.z) * s};
}

// What a facet seen under cos_i does with the light.
struct FacetResponse {
  Rgb reflected{0, 0, 0}, transmitted{0, 0, 0};  // transmitted as power: without the radiance factor 1 / eta^2
  float cos_t = 0;                               // of the refracted direction
  float reflect_share = 1;                       // probability with which reflection is chosen
};

struct GlassFresnel {
  Rgb reflected{0, 0, 0};
  float transmitted = 1, cos_t = 0;
};

GlassFresnel glass_fresnel(const LayeredLobes& lobes, float cos_i) {
  if (lobes.passage == Passage::straight) return {Rgb(0, 0, 0), 1, cos_i};
  float s, cos_t = cos_i;
  if (lobes.exact_f0 < 1) {
    const DielectricFresnel exact = fresnel_dielectric(cos_i, lobes.eta);
    if (exact.reflectance >= 1 && exact.cos_t == 0) return {Rgb(1, 1, 1), 0, 0};
    s = std::max(0.0f, (exact.reflectance - lobes.exact_f0) / (1 - lobes.exact_f0));
    cos_t = exact.cos_t;
  } else {
    s = schlick_term(cos_i);
  }
  Rgb reflected = lerp(lobes.glass_f0, lobes.glass_f90, s);
  if (lobes.film) {
    const float outside = lobes.eta < 1 && lobes.passage == Passage::refract ? cos_t : cos_i;
    reflected = lobes.film->over_glass(reflected, outside);
  }
  return {reflected, std::max(0.0f, 1 - max_component(reflected)), cos_t};
}

FacetResponse facet_response(const LayeredLobes& lobes, float cos_i) {
  FacetResponse response;
  response.reflected = lerp(lobes.r0, lobes.r90, schlick_term(cos_i));
  if (lobes.film) response.reflected = lobes.film->over_opaque(response.reflected, cos_i);
  if (lobes.passage == Passage::none) return response;
  const GlassFresnel glass = glass_fresnel(lobes, cos_i);
  response.reflected += glass.reflected * lobes.reflection_tint * lobes.glass;
  response.transmitted = lobes.tint * (lobes.glass * glass.transmitted);
  response.cos_t = glass.cos_t;
  if (lobes.passage != Passage::straight) {
    const float r = mean(response.reflected), t = mean(response.transmitted);
    response.reflect_share = r + t > 0 ? r / (r + t) : 1.0f;
  }
  return response;
}

AlbedoTerms albedo_terms(const LayeredLobes& lobes, float mu) {
  return directional_albedo(lobes.albedo_row, mu);
}

bool rescatters(const LayeredLobes& lobes) {
  return lobes.metal > 0 && !lobes.mirror;
}

// Of rescattered light: metal F_ms, and 1 - E_mean.
struct Rescattering {
  Rgb share{0, 0, 0};
  float mean_loss = 1;
};

Rescattering rescattering_of(const LayeredLobes& lobes) {
  const Microfacet& facets = lobes.microfacet;
  const float loss = mean_albedo(lobes.albedo_row).loss;
  if (!(loss > 0)) return {};
  float metal = lobes.metal;
  if (is_anisotropic(facets.distribution)) {
    const auto [less, more] = std::minmax(facets.alpha_along, facets.alpha_across);
    metal *= std::sqrt(less / more);
  }
  Rgb f = lobes.film ? lobes.film->mean_over_metal() : lobes.metal_mean;
  // Colours of vertices may exceed 1, where the series over the facets has no sum.
  for (int c = 0; c < 3; ++c) f[c] = std::clamp(f[c], 0.0f, 1.0f);
  return {f * f * (metal * (1 - loss)) / (Rgb(1) - f * loss), loss};
}

// T_mean, without a film.
float mean_entry(const LayeredLobes& lobes) {
  return mean_albedo(lobes.albedo_row).entering(lobes.coat_f0, lobes.coat_f90);
}

// base_entry() and base_exit() where the terms are at hand.
Rgb base_entry(const LayeredLobes& lobes, const AlbedoTerms& terms, float mu) {
  if (lobes.filmed_base) return lobes.filmed_base->entering(mu);
  return Rgb(terms.entering(lobes.coat_f0, lobes.coat_f90));
}
Rgb base_exit(const LayeredLobes& lobes, const AlbedoTerms& terms, float mu) {
  if (lobes.filmed_base) return lobes.filmed_base->leaving(mu);
  const float entry_mean = mean_entry(lobes);
  return Rgb(entry_mean > 0 ? terms.entering(lobes.coat_f0, lobes.coat_f90) / entry_mean : 0.0f);
}

// Share of the transmitted light that no second facet stops, roughly: refraction bends it away from the horizon.
float kept_by_transmission(const LayeredLobes& lobes, const AlbedoTerms& terms) {
  return lobes.passage == Passage::thin ? terms.a + terms.b : 1.0f;
}

}  // namespace

LayeredView view_along(const LayeredLobes& lobes, const V3f& wo) {
  LayeredView view;
  view.wo = wo;
  if (!lobes.mirror) view.visible_area = lobes.microfacet.projected_area(wo);
  if (is_black(lobes.diffuse) && !rescatters(lobes) && lobes.passage != Passage::straight) {
    view.facets = 1;
    return view;
  }
  const AlbedoTerms terms = albedo_terms(lobes, wo.z);
  view.loss = terms.loss;
  view.base_entry = base_entry(lobes, terms, wo.z);
  float facets = mean(lobes.r0) * terms.a + lobes.r90 * terms.b, straight = 0;
  if (lobes.passage == Passage::straight) {
    straight = mean(lobes.tint) * lobes.glass;
  } else if (lobes.passage != Passage::none) {
    const GlassFresnel glass = glass_fresnel(lobes, wo.z);
    facets += lobes.glass * (mean(glass.reflected * lobes.reflection_tint) * (terms.a + terms.b) +
                             mean(lobes.tint) * glass.transmitted * kept_by_transmission(lobes, terms));
  }
  float rescattered = 0;
  if (rescatters(lobes)) {
    const Rescattering metal = rescattering_of(lobes);
    view.rescattering = metal.share * (terms.loss / metal.mean_loss);
    rescattered = mean(metal.share) * terms.loss;
    // The estimate above knows nothing of a film; facets return more than what they pass on returns.
    facets = std::max(facets, mean(metal.share) * (terms.a + terms.b));
  }
  const float diffuse = mean(lobes.diffuse * view.base_entry);
  const float sum = diffuse + rescattered + facets + straight;
  if (!(sum > 0)) return view;
  view.diffuse = diffuse / sum;
  view.rescattered = rescattered / sum;
  view.straight = straight / sum;
  view.facets = std::max(0.0f, 1 - view.diffuse - view.rescattered - view.straight);
  if (facets == 0) view.facets = 0;
  return view;
}

LayeredArrival arrival_along(const LayeredLobes& lobes, const V3f& wi) {
  LayeredArrival arrival;
  arrival.wi = wi;
  const bool base = !is_black(lobes.diffuse), metal = rescatters(lobes);
  if (base || metal) {
    const AlbedoTerms terms = albedo_terms(lobes, wi.z);
    arrival.cosine_pdf = cosine_hemisphere_pdf_w(wi.z);
    if (base) arrival.base_exit = base_exit(lobes, terms, wi.z);
    arrival.loss = terms.loss;
    if (metal) arrival.loss_pdf = loss_pdf_w(lobes.albedo_row, wi.z);
  }
  if (!lobes.mirror) arrival.masking = lobes.microfacet.masking(wi);
  return arrival;
}

namespace {

// cos_m = wo.m = wi.m of the half vector m; density: of normals there, if no mirror.
BsdfValue evaluate_reflection(const LayeredLobes& lobes, const LayeredView& view, const LayeredArrival& arrival,
                              float cos_m, float density) {
  BsdfValue value;
  value.f_cos = matte_reflected(lobes, view, arrival);
  if (view.diffuse > 0) value.pdf_w += view.diffuse * arrival.cosine_pdf;
  if (view.rescattered > 0) value.pdf_w += view.rescattered * arrival.loss_pdf;
  if (lobes.mirror) return value;
  const FacetResponse response = facet_response(lobes, cos_m);
  const float pdf = density / (4 * view.visible_area);
  value.f_cos += response.reflected * (arrival.masking * pdf);
  value.pdf_w += view.facets * response.reflect_share * pdf;
  return value;
}

BsdfValue evaluate_reflection(const LayeredLobes& lobes, const LayeredView& view, const LayeredArrival& arrival,
                              const V3f& m, float cos_m) {
  const float density = lobes.mirror ? 0 : lobes.microfacet.normal_density(m);
  return evaluate_reflection(lobes, view, arrival, cos_m, density);
}

// `reflected` is wi mirrored to this side, m the half vector of wo and it.
BsdfValue evaluate_thin_wall(const LayeredLobes& lobes, const LayeredView& view, const V3f& reflected, const V3f& m,
                             float cos_m) {
  const FacetResponse response = facet_response(lobes, cos_m);
  const float pdf = lobes.microfacet.normal_density(m) / (4 * view.visible_area);
  return {response.transmitted * (lobes.microfacet.masking(reflected) * pdf),
          view.facets * (1 - response.reflect_share) * pdf};
}

// wi.z < 0, and m the normal about which wo refracts into wi. The Jacobian (Walter 2007, eq. 17) is
// eta^2 cos_t / (cos_m - eta cos_t)^2; the difference is (eta^2 - 1) / (cos_m + eta cos_t).
BsdfValue evaluate_refraction(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi, const V3f& m,
                              float cos_m) {
  const FacetResponse response = facet_response(lobes, cos_m);
  const float eta = lobes.eta, cos_t = response.cos_t;
  const float difference = (eta - 1) * (eta + 1) / (cos_m + eta * cos_t);
  const float density_m = lobes.microfacet.normal_density(m) * cos_m / view.visible_area;
  const float radiance_pdf = density_m * cos_t / sqr(difference);  // pdf / eta^2
  const float masking = lobes.microfacet.masking(V3f(wi.x, wi.y, -wi.z));
  return {response.transmitted * (masking * radiance_pdf),
          view.facets * (1 - response.reflect_share) * sqr(eta) * radiance_pdf};
}

// Unit vector along h with z > 0; false where h is too short or horizontal to have one.
bool make_normal(const V3f& h, V3f& m) {
  const float squared = length_squared(h);
  if (!(squared > 1e-24f) || h.z == 0) return false;
  m = h * (std::copysign(1.0f, h.z) / std::sqrt(squared));
  return true;
}

BsdfSample finish_delta(const V3f& wi, const Rgb& power, float probability) {
  BsdfSample sample;
  if (!(probability > 0)) return sample;
  sample.wi = wi;
  sample.weight = power / probability;
  sample.pdf_w = probability;
  sample.delta = true;
  return sample;
}

void mark_transmitted(const LayeredLobes& lobes, BsdfSample& sample) {
  sample.transmitted = true;
  if (lobes.passage == Passage::refract) sample.eta = lobes.eta;
}

BsdfSample sample_mirror(const LayeredLobes& lobes, float probability, const V3f& wo, float u_lobe) {
  const FacetResponse response = facet_response(lobes, wo.z);
  if (u_lobe < response.reflect_share) {
    return finish_delta(V3f(-wo.x, -wo.y, wo.z), response.reflected, probability * response.reflect_share);
  }
  V3f wi = -wo;
  Rgb radiance = response.transmitted;
  if (lobes.passage == Passage::refract) {
    wi = refract(wo, V3f(0, 0, 1), wo.z, response.cos_t, lobes.eta);
    radiance /= sqr(lobes.eta);
  }
  BsdfSample sample = finish_delta(wi, radiance, probability * (1 - response.reflect_share));
  mark_transmitted(lobes, sample);
  return sample;
}

BsdfSample sample_facets(const LayeredLobes& lobes, const LayeredView& view, float u_lobe, const V2f& u) {
  const V3f& wo = view.wo;
  const V3f m = lobes.microfacet.sample_visible_normal(wo, u);
  const float cos_m = dot(wo, m);
  if (!(cos_m > 0)) return {};
  const FacetResponse response = facet_response(lobes, cos_m);
  const V3f reflected = m * (2 * cos_m) - wo;
  if (u_lobe < response.reflect_share) {
    if (!(reflected.z > 0)) return {};
    return sample_of(reflected, evaluate_reflection(lobes, view, arrival_along(lobes, reflected), m, cos_m));
  }
  BsdfSample sample;
  if (lobes.passage == Passage::thin) {
    if (!(reflected.z > 0)) return {};
    const V3f wi(reflected.x, reflected.y, -reflected.z);
    sample = sample_of(wi, evaluate_thin_wall(lobes, view, reflected, m, cos_m));
  } else {
    const V3f wi = refract(wo, m, cos_m, response.cos_t, lobes.eta);
    if (!(wi.z < 0)) return {};
    sample = sample_of(wi, evaluate_refraction(lobes, view, wi, m, cos_m));
  }
  mark_transmitted(lobes, sample);
  return sample;
}

V3f sample_rescattered(const LayeredLobes& lobes, const V2f& u) {
  const float mu = sample_loss_cosine(lobes.albedo_row, u.y);
  const float sine = safe_sqrt((1 - mu) * (1 + mu)), phi = kTwoPi * u.x;
  return {sine * std::cos(phi), sine * std::sin(phi), mu};
}

BsdfSample sample_towards(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi) {
  V3f m;
  if (!(wi.z > 0) || !make_normal(view.wo + wi, m)) return {};
  return sample_of(wi, evaluate_reflection(lobes, view, arrival_along(lobes, wi), m, dot(view.wo, m)));
}

}  // namespace

Rgb base_entry(const LayeredLobes& lobes, float mu) {
  if (lobes.filmed_base) return lobes.filmed_base->entering(mu);
  return Rgb(albedo_terms(lobes, mu).entering(lobes.coat_f0, lobes.coat_f90));
}

Rgb base_exit(const LayeredLobes& lobes, float mu) {
  return base_exit(lobes, albedo_terms(lobes, mu), mu);
}

BsdfValue evaluate_reflected(const LayeredLobes& lobes, const LayeredView& view, const LayeredArrival& arrival) {
  V3f m;
  if (!make_normal(view.wo + arrival.wi, m)) return {};
  return evaluate_reflection(lobes, view, arrival, m, dot(view.wo, m));
}

namespace {

// T_mean where arrival_of() needs it.
float mean_entry_of_base(const LayeredLobes& lobes) {
  return is_black(lobes.diffuse) || lobes.filmed_base ? 1 : mean_entry(lobes);
}

// arrival_along() of the wo of a view, to the bit.
LayeredArrival arrival_of(const LayeredLobes& lobes, const LayeredView& view, float mean_entry) {
  LayeredArrival arrival;
  const float mu = view.wo.z;
  arrival.wi = view.wo;
  const bool base = !is_black(lobes.diffuse), metal = rescatters(lobes);
  if (base || metal) arrival.cosine_pdf = cosine_hemisphere_pdf_w(mu);
  if (base) {
    const Rgb exit(mean_entry > 0 ? view.base_entry.x / mean_entry : 0.0f);
    arrival.base_exit = lobes.filmed_base ? lobes.filmed_base->leaving(mu) : exit;
  }
  arrival.loss = view.loss;
  if (metal) arrival.loss_pdf = loss_pdf_w(lobes.albedo_row, mu);
  if (!lobes.mirror) arrival.masking = std::min(1.0f, mu / view.visible_area);
  return arrival;
}

}  // namespace

BsdfValue evaluate_layered_back(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi) {
  V3f m;
  if (!make_normal(wi + view.wo, m)) return {};
  const LayeredView other = view_along(lobes, wi);
  return evaluate_reflection(lobes, other, arrival_of(lobes, view, mean_entry_of_base(lobes)), m, dot(wi, m));
}

BsdfBothWays evaluate_layered_both_ways(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi) {
  V3f m;
  if (!make_normal(view.wo + wi, m)) return {};
  const LayeredView other = view_along(lobes, wi);
  const float density = lobes.mirror ? 0 : lobes.microfacet.normal_density(m);
  const float mean_entry = mean_entry_of_base(lobes);
  return {evaluate_reflection(lobes, view, arrival_of(lobes, other, mean_entry), dot(view.wo, m), density),
          evaluate_reflection(lobes, other, arrival_of(lobes, view, mean_entry), dot(wi, m), density)};
}

Rgb matte_reflected(const LayeredLobes& lobes, const LayeredView& view, const LayeredArrival& arrival) {
  Rgb f_cos(0, 0, 0);
  if (view.diffuse > 0) f_cos += lobes.diffuse * view.base_entry * arrival.base_exit * arrival.cosine_pdf;
  if (view.rescattered > 0) f_cos += view.rescattering * (arrival.loss * arrival.cosine_pdf);
  return f_cos;
}

Rgb matte_layered(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi) {
  const Rgb diffuse = lobes.diffuse * view.base_entry;
  const bool base = !is_black(diffuse), metal = !is_black(view.rescattering);
  if (!(wi.z > 0) || (!base && !metal)) return {0, 0, 0};
  const AlbedoTerms terms = albedo_terms(lobes, wi.z);
  Rgb f(0, 0, 0);
  if (base) f += diffuse * base_exit(lobes, terms, wi.z);
  if (metal) f += view.rescattering * terms.loss;
  return f * cosine_hemisphere_pdf_w(wi.z);
}

BsdfValue evaluate_layered(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi) {
  if (wi.z > 0) return evaluate_reflected(lobes, view, arrival_along(lobes, wi));
  if (!(wi.z < 0) || lobes.mirror) return {};
  const V3f& wo = view.wo;
  V3f m;
  if (lobes.passage == Passage::thin) {
    const V3f reflected(wi.x, wi.y, -wi.z);
    if (!make_normal(wo + reflected, m)) return {};
    return evaluate_thin_wall(lobes, view, reflected, m, dot(wo, m));
  }
  if (lobes.passage != Passage::refract || !make_normal(wo + wi * lobes.eta, m)) return {};
  const float cos_m = dot(wo, m);
  if (!(cos_m > 0) || !(dot(wi, m) < 0)) return {};
  return evaluate_refraction(lobes, view, wi, m, cos_m);
}

BsdfSample sample_layered(const LayeredLobes& lobes, const LayeredView& view, float u_lobe, const V2f& u) {
  if (u_lobe < view.diffuse) return sample_towards(lobes, view, square_to_cosine_hemisphere(u));
  u_lobe -= view.diffuse;
  if (u_lobe < view.rescattered) return sample_towards(lobes, view, sample_rescattered(lobes, u));
  u_lobe -= view.rescattered;
  if (u_lobe < view.facets) {
    const float rest = std::min(u_lobe / view.facets, kOneMinusEpsilon);
    return lobes.mirror ? sample_mirror(lobes, view.facets, view.wo, rest) : sample_facets(lobes, view, rest, u);
  }
  BsdfSample sample = finish_delta(-view.wo, lobes.tint * lobes.glass, view.straight);
  sample.transmitted = sample.valid();
  return sample;
}

bool is_pure_delta(const LayeredLobes& lobes) {
  if (!is_black(lobes.diffuse)) return false;
  if (lobes.mirror) return true;
  const bool reflects = !is_black(lobes.r0) || lobes.r90 > 0;
  return !reflects && (lobes.passage == Passage::straight || lobes.passage == Passage::none);
}

Rgb layered_albedo(const LayeredLobes& lobes, const V3f& wo) {
  const AlbedoTerms terms = albedo_terms(lobes, wo.z);
  Rgb albedo = lobes.r0 * terms.a + Rgb(lobes.r90 * terms.b) + lobes.diffuse * base_entry(lobes, wo.z);
  if (rescatters(lobes)) albedo += rescattering_of(lobes).share * terms.loss;
  if (lobes.passage == Passage::straight) {
    albedo += lobes.tint * lobes.glass;
  } else if (lobes.passage != Passage::none) {
    const GlassFresnel glass = glass_fresnel(lobes, wo.z);
    albedo += (glass.reflected * lobes.reflection_tint * (terms.a + terms.b) +
               lobes.tint * (glass.transmitted * kept_by_transmission(lobes, terms))) *
              lobes.glass;
  }
  return {std::min(1.0f, albedo.x), std::min(1.0f, albedo.y), std::min(1.0f, albedo.z)};
}

}  // namespace helio
