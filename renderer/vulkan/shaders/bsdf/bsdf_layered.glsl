// The scattering of glTF materials, one interface over a base: trace/bsdf/bsdf_layered.h, which has the model, without
// films.
#ifndef BSDF_LAYERED_GLSL
#define BSDF_LAYERED_GLSL

#include "bsdf/bsdf_values.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/microfacet_albedo.glsl"
#include "sampling/warp.glsl"

// How light gets through the interface where it is transmitted.
const uint kPassageNone = 0, kPassageThin = 1, kPassageRefract = 2, kPassageStraight = 3;

// LayeredLobes of trace/bsdf/bsdf_layered.h.
struct LayeredLobes {
  Microfacet facets;  // alpha 0: mirror
  uint64_t albedo;    // AlbedoTable of their distribution
  bool mirror;        // reflection and transmission are deltas
  vec3 r0;            // Schlick part of the reflection: r0 + (r90 - r0) (1 - cos)^5
  float r90;
  float metal;        // share of the surface whose facets rescatter, and its F_mean
  vec3 metal_mean;
  vec3 diffuse;       // diffuse base, and the Schlick reflectance of what lies over it
  float coat_f0, coat_f90;
  uint passage;       // transmissive dielectric: share, colour of what passes, index of the far side over this side
  float glass;
  vec3 tint;
  float eta;
  vec3 glass_f0;      // glass_f0 + (glass_f90 - glass_f0) s, s: Fresnel's reflectance from [exact_f0, 1] to [0, 1]
  float glass_f90, exact_f0;
  vec3 reflection_tint;
};

// What a facet does with the light that it meets.
struct FacetResponse {
  vec3 reflected, transmitted;  // transmitted as power: without the radiance factor 1 / eta^2
  float cos_t;                  // of the refracted direction
  float reflect_share;          // probability with which reflection is chosen
};

struct GlassFresnel {
  vec3 reflected;
  float transmitted, cos_t;
};

// LayeredView of trace/bsdf/bsdf_layered.h, without wo.
struct LayeredView {
  float diffuse, rescattered, facets, straight;
  float visible_area;
  float base_entry;
  vec3 rescattering;
};

float mean_of(vec3 c) {
  return (c.x + c.y + c.z) * (1.0 / 3);
}

vec3 schlick_mix(vec3 f0, float f90, float s) {
  return f0 + (vec3(f90) - f0) * s;
}

GlassFresnel glass_fresnel(LayeredLobes lobes, float cos_i) {
  if (lobes.passage == kPassageStraight) return GlassFresnel(vec3(0), 1, cos_i);
  float s = schlick_term(cos_i), cos_t = cos_i;
  if (lobes.exact_f0 < 1) {
    const DielectricFresnel exact = fresnel_dielectric(cos_i, lobes.eta);
    if (exact.reflectance >= 1 && exact.cos_t == 0) return GlassFresnel(vec3(1), 0, 0);
    s = max(0.0, (exact.reflectance - lobes.exact_f0) / (1 - lobes.exact_f0));
    cos_t = exact.cos_t;
  }
  const vec3 reflected = schlick_mix(lobes.glass_f0, lobes.glass_f90, s);
  return GlassFresnel(reflected, max(0.0, 1 - max_component(reflected)), cos_t);
}

FacetResponse facet_response(LayeredLobes lobes, float cos_i) {
  FacetResponse response = FacetResponse(schlick_mix(lobes.r0, lobes.r90, schlick_term(cos_i)), vec3(0), 0, 1);
  if (lobes.passage == kPassageNone) return response;
  const GlassFresnel glass = glass_fresnel(lobes, cos_i);
  response.reflected += glass.reflected * lobes.reflection_tint * lobes.glass;
  response.transmitted = lobes.tint * (lobes.glass * glass.transmitted);
  response.cos_t = glass.cos_t;
  if (lobes.passage != kPassageStraight) {
    const float r = mean_of(response.reflected), t = mean_of(response.transmitted);
    response.reflect_share = r + t > 0 ? r / (r + t) : 1.0;
  }
  return response;
}

AlbedoTerms layered_albedo_terms(LayeredLobes lobes, float mu) {
  return directional_albedo(lobes.albedo, lobes.facets.alpha, mu);
}

bool rescatters(LayeredLobes lobes) {
  return lobes.metal > 0 && !lobes.mirror;
}

// The share of the light that several facets scatter in turn: metal F_ms. mean_loss = 1 - E_mean.
vec3 rescattered_share(LayeredLobes lobes, out float mean_loss) {
  const float loss = mean_albedo(lobes.albedo, lobes.facets.alpha).loss;
  mean_loss = 1;
  if (!(loss > 0)) return vec3(0);
  mean_loss = loss;
  float metal = lobes.metal;
  if (is_anisotropic(lobes.facets.distribution)) {
    const float along = lobes.facets.alpha_along, across = lobes.facets.alpha_across;
    metal *= sqrt(min(along, across) / max(along, across));
  }
  // Colours of vertices may exceed 1, where the series over the facets has no sum.
  const vec3 f = clamp(lobes.metal_mean, 0.0, 1.0);
  return f * f * (metal * (1 - loss)) / (vec3(1) - f * loss);
}

float base_exit(LayeredLobes lobes, AlbedoTerms terms) {
  const float entry_mean =
      entering_share(mean_albedo(lobes.albedo, lobes.facets.alpha), lobes.coat_f0, lobes.coat_f90);
  return entry_mean > 0 ? entering_share(terms, lobes.coat_f0, lobes.coat_f90) / entry_mean : 0.0;
}

// Share of the transmitted light that no second facet stops, roughly: refraction bends it away from the horizon.
float kept_by_transmission(LayeredLobes lobes, AlbedoTerms terms) {
  return lobes.passage == kPassageThin ? terms.a + terms.b : 1.0;
}

LayeredView view_along(LayeredLobes lobes, vec3 wo) {
  LayeredView view = LayeredView(0, 0, 0, 0, 1, 1, vec3(0));
  if (!lobes.mirror) view.visible_area = projected_area(lobes.facets, wo);
  if (is_black(lobes.diffuse) && !rescatters(lobes) && lobes.passage != kPassageStraight) {
    view.facets = 1;
    return view;
  }
  const AlbedoTerms terms = layered_albedo_terms(lobes, wo.z);
  view.base_entry = entering_share(terms, lobes.coat_f0, lobes.coat_f90);
  float facets = mean_of(lobes.r0) * terms.a + lobes.r90 * terms.b, straight = 0;
  if (lobes.passage == kPassageStraight) {
    straight = mean_of(lobes.tint) * lobes.glass;
  } else if (lobes.passage != kPassageNone) {
    const GlassFresnel glass = glass_fresnel(lobes, wo.z);
    facets += lobes.glass * (mean_of(glass.reflected * lobes.reflection_tint) * (terms.a + terms.b) +
                             mean_of(lobes.tint) * glass.transmitted * kept_by_transmission(lobes, terms));
  }
  float rescattered = 0;
  if (rescatters(lobes)) {
    float mean_loss;
    const vec3 share = rescattered_share(lobes, mean_loss);
    view.rescattering = share * (terms.loss / mean_loss);
    rescattered = mean_of(share) * terms.loss;
    facets = max(facets, mean_of(share) * (terms.a + terms.b));
  }
  const float diffuse = mean_of(lobes.diffuse * view.base_entry);
  const float sum = diffuse + rescattered + facets + straight;
  if (!(sum > 0)) return view;
  view.diffuse = diffuse / sum;
  view.rescattered = rescattered / sum;
  view.straight = straight / sum;
  view.facets = facets == 0 ? 0.0 : max(0.0, 1 - view.diffuse - view.rescattered - view.straight);
  return view;
}

// matte_reflected() and its density, wi.z > 0: what the diffuse base sends, and what is rescattered.
BsdfValue evaluate_matte(LayeredLobes lobes, LayeredView view, vec3 wi) {
  BsdfValue value = no_value();
  if (!(view.diffuse > 0) && !(view.rescattered > 0)) return value;
  const AlbedoTerms terms = layered_albedo_terms(lobes, wi.z);
  const float cosine_pdf = cosine_hemisphere_pdf_w(wi.z);
  if (view.diffuse > 0) {
    value.f_cos += lobes.diffuse * view.base_entry * base_exit(lobes, terms) * cosine_pdf;
    value.pdf_w += view.diffuse * cosine_pdf;
  }
  if (view.rescattered > 0) {
    value.f_cos += view.rescattering * (terms.loss * cosine_pdf);
    value.pdf_w += view.rescattered * loss_pdf_w(lobes.albedo, lobes.facets.alpha, wi.z);
  }
  return value;
}

// What is reflected into wi, the matte part included. m is the half vector, with cos_m = wo.m = wi.m.
BsdfValue evaluate_reflection(LayeredLobes lobes, LayeredView view, vec3 wi, vec3 m, float cos_m) {
  BsdfValue value = evaluate_matte(lobes, view, wi);
  if (lobes.mirror) return value;
  const FacetResponse response = facet_response(lobes, cos_m);
  const float pdf = normal_density(lobes.facets, m) / (4 * view.visible_area);
  value.f_cos += response.reflected * (masking(lobes.facets, wi) * pdf);
  value.pdf_w += view.facets * response.reflect_share * pdf;
  return value;
}

// What a thin wall lets through: `reflected` is wi mirrored to this side, m the half vector of wo and `reflected`.
BsdfValue evaluate_thin_wall(LayeredLobes lobes, LayeredView view, vec3 reflected, vec3 m, float cos_m) {
  const FacetResponse response = facet_response(lobes, cos_m);
  const float pdf = normal_density(lobes.facets, m) / (4 * view.visible_area);
  return BsdfValue(response.transmitted * (masking(lobes.facets, reflected) * pdf),
                   view.facets * (1 - response.reflect_share) * pdf);
}

// The refraction into a volume: wi.z < 0, and m is the normal about which wo refracts into wi.
BsdfValue evaluate_refraction(LayeredLobes lobes, LayeredView view, vec3 wi, vec3 m, float cos_m) {
  const FacetResponse response = facet_response(lobes, cos_m);
  const float eta = lobes.eta, cos_t = response.cos_t;
  const float difference = (eta - 1) * (eta + 1) / (cos_m + eta * cos_t);
  const float density_m = normal_density(lobes.facets, m) * cos_m / view.visible_area;
  const float radiance_pdf = density_m * cos_t / sqr(difference);  // pdf / eta^2
  const float mask = masking(lobes.facets, vec3(wi.x, wi.y, -wi.z));
  return BsdfValue(response.transmitted * (mask * radiance_pdf),
                   view.facets * (1 - response.reflect_share) * sqr(eta) * radiance_pdf);
}

// Unit vector along h with z > 0; false where h is too short or horizontal to have one.
bool make_half_vector(vec3 h, out vec3 m) {
  const float squared = length_squared(h);
  m = vec3(0, 0, 1);
  if (!(squared > 1e-24) || h.z == 0) return false;
  m = h * (copysign(1.0, h.z) / sqrt(squared));
  return true;
}

BsdfValue evaluate_layered(LayeredLobes lobes, vec3 wo, vec3 wi) {
  const bool reflects = wi.z > 0, thin = lobes.passage == kPassageThin;
  if (!reflects && (!(wi.z < 0) || lobes.mirror || !(thin || lobes.passage == kPassageRefract))) return no_value();
  const vec3 above = reflects || !thin ? wi : vec3(wi.x, wi.y, -wi.z);
  vec3 m;
  if (!make_half_vector(wo + (reflects || thin ? above : wi * lobes.eta), m)) return no_value();
  const float cos_m = dot(wo, m);
  if (!reflects && !thin && (!(cos_m > 0) || !(dot(wi, m) < 0))) return no_value();
  const LayeredView view = view_along(lobes, wo);
  if (reflects) return evaluate_reflection(lobes, view, wi, m, cos_m);
  return thin ? evaluate_thin_wall(lobes, view, above, m, cos_m) : evaluate_refraction(lobes, view, wi, m, cos_m);
}

BsdfSample layered_delta(vec3 wi, vec3 power, float probability) {
  if (!(probability > 0)) return no_sample();
  return BsdfSample(wi, power / probability, probability, 1, true, false);
}

BsdfSample sample_layered_mirror(LayeredLobes lobes, float probability, vec3 wo, float u_lobe) {
  const FacetResponse response = facet_response(lobes, wo.z);
  if (u_lobe < response.reflect_share)
    return layered_delta(vec3(-wo.x, -wo.y, wo.z), response.reflected, probability * response.reflect_share);
  vec3 wi = -wo, radiance = response.transmitted;
  const bool bent = lobes.passage == kPassageRefract;
  if (bent) {
    wi = refracted(wo, vec3(0, 0, 1), wo.z, response.cos_t, lobes.eta);
    radiance /= sqr(lobes.eta);
  }
  BsdfSample chosen = layered_delta(wi, radiance, probability * (1 - response.reflect_share));
  chosen.transmitted = true;
  if (bent) chosen.eta = lobes.eta;
  return chosen;
}

BsdfSample sample_layered(LayeredLobes lobes, vec3 wo, float u_lobe, vec2 u) {
  const LayeredView view = view_along(lobes, wo);
  const bool from_base = u_lobe < view.diffuse;
  if (!from_base) u_lobe -= view.diffuse;
  const bool from_metal = !from_base && u_lobe < view.rescattered;
  if (!from_base && !from_metal) u_lobe -= view.rescattered;
  vec3 wi, m;
  float cos_m;
  if (from_base || from_metal) {
    if (from_base) {
      wi = square_to_cosine_hemisphere(u);
    } else {
      const float mu = sample_loss_cosine(lobes.albedo, lobes.facets.alpha, u.y);
      wi = vec3(unit_circle(u.x) * safe_sqrt((1 - mu) * (1 + mu)), mu);
    }
    if (!(wi.z > 0) || !make_half_vector(wo + wi, m)) return no_sample();
    cos_m = dot(wo, m);
  } else if (u_lobe < view.facets) {
    const float rest = min(u_lobe / view.facets, kOneMinusEpsilon);
    if (lobes.mirror) return sample_layered_mirror(lobes, view.facets, wo, rest);
    m = sample_visible_normal(lobes.facets, wo, u);
    cos_m = dot(wo, m);
    if (!(cos_m > 0)) return no_sample();
    const FacetResponse response = facet_response(lobes, cos_m);
    wi = m * (2 * cos_m) - wo;
    if (!(rest < response.reflect_share)) {
      BsdfSample chosen;
      if (lobes.passage == kPassageThin) {
        if (!(wi.z > 0)) return no_sample();
        chosen = sample_of(vec3(wi.x, wi.y, -wi.z), evaluate_thin_wall(lobes, view, wi, m, cos_m));
      } else {
        wi = refracted(wo, m, cos_m, response.cos_t, lobes.eta);
        if (!(wi.z < 0)) return no_sample();
        chosen = sample_of(wi, evaluate_refraction(lobes, view, wi, m, cos_m));
        if (lobes.passage == kPassageRefract) chosen.eta = lobes.eta;
      }
      chosen.transmitted = true;
      return chosen;
    }
    if (!(wi.z > 0)) return no_sample();
  } else {
    BsdfSample passed = layered_delta(-wo, lobes.tint * lobes.glass, view.straight);
    passed.transmitted = passed.pdf_w > 0;
    return passed;
  }
  return sample_of(wi, evaluate_reflection(lobes, view, wi, m, cos_m));
}

bool is_pure_delta(LayeredLobes lobes) {
  if (!is_black(lobes.diffuse)) return false;
  if (lobes.mirror) return true;
  const bool reflects = !is_black(lobes.r0) || lobes.r90 > 0;
  return !reflects && (lobes.passage == kPassageStraight || lobes.passage == kPassageNone);
}

vec3 layered_albedo(LayeredLobes lobes, vec3 wo) {
  const AlbedoTerms terms = layered_albedo_terms(lobes, wo.z);
  vec3 albedo = lobes.r0 * terms.a + vec3(lobes.r90 * terms.b) +
                lobes.diffuse * entering_share(terms, lobes.coat_f0, lobes.coat_f90);
  if (rescatters(lobes)) {
    float mean_loss;
    albedo += rescattered_share(lobes, mean_loss) * terms.loss;
  }
  if (lobes.passage == kPassageStraight) {
    albedo += lobes.tint * lobes.glass;
  } else if (lobes.passage != kPassageNone) {
    const GlassFresnel glass = glass_fresnel(lobes, wo.z);
    albedo += (glass.reflected * lobes.reflection_tint * (terms.a + terms.b) +
               lobes.tint * (glass.transmitted * kept_by_transmission(lobes, terms))) *
              lobes.glass;
  }
  return min(vec3(1), albedo);
}

#endif
