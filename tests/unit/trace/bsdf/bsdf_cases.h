// Materials and directions that the BSDF tests share.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/trace/bsdf/bsdf_questions.h"

namespace helio::test {

struct NamedMaterial {
  std::string name;
  SurfaceParams params;
  bool from_inside = false;  // a volume, looked at from within: wo.z < 0
};

inline std::string name_of(MicrofacetDistribution distribution) {
  return distribution == MicrofacetDistribution::ggx ? "ggx" : "beckmann";
}

inline V3f direction_at(double theta_degrees, double phi_degrees) {
  const double theta = theta_degrees * (std::numbers::pi / 180), phi = phi_degrees * (std::numbers::pi / 180);
  return V3f(V3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
}

// Unit vector with exactly this z, also where the angle's cosine would round to 1 or 0.
inline V3f direction_with_z(float z) {
  const double r = std::sqrt(1 - double(z) * z);
  return {static_cast<float>(r * 0.6), static_cast<float>(r * 0.8), z};
}

inline SurfaceParams metallic_roughness(MicrofacetDistribution distribution, float alpha) {
  SurfaceParams params;
  params.model = LobeModel::metallic_roughness;
  params.distribution = distribution;
  params.alpha = alpha;
  return params;
}

inline SurfaceParams glass(MicrofacetDistribution distribution, float alpha, float ior, bool thin) {
  SurfaceParams params = metallic_roughness(distribution, alpha);
  params.transmission = 1;
  params.ior = ior;
  params.thin = thin;
  return params;
}

// One material per lobe and per way of mixing them, all at the same roughness.
inline std::vector<NamedMaterial> materials_at(MicrofacetDistribution distribution, float alpha) {
  std::vector<NamedMaterial> list;
  const SurfaceParams base = metallic_roughness(distribution, alpha);

  SurfaceParams conductor = base;
  conductor.model = LobeModel::conductor;
  conductor.eta = {0.2f, 0.92f, 1.1f};
  conductor.k = {3.9f, 2.45f, 2.14f};
  list.push_back({"conductor", conductor});

  SurfaceParams metal = base;
  metal.metallic = 1;
  metal.base_color = {0.9f, 0.6f, 0.2f};
  list.push_back({"metal", metal});

  SurfaceParams plastic = base;
  plastic.base_color = {0.8f, 0.3f, 0.1f};
  list.push_back({"plastic", plastic});

  SurfaceParams tinted = base;
  tinted.base_color = {0.2f, 0.5f, 0.9f};
  tinted.metallic = 0.3f;
  tinted.specular = 0.6f;
  tinted.specular_color = {1, 0.4f, 0.2f};
  list.push_back({"half metal with tinted specular", tinted});

  SurfaceParams glossy = base;
  glossy.model = LobeModel::specular_glossiness;
  glossy.base_color = {0.5f, 0.4f, 0.3f};
  glossy.f0 = {0.2f, 0.5f, 0.1f};
  list.push_back({"specular-glossiness", glossy});

  list.push_back({"glass from outside", glass(distribution, alpha, 1.5f, false)});
  list.push_back({"glass from inside", glass(distribution, alpha, 1.5f, false), true});
  list.push_back({"dense glass from inside", glass(distribution, alpha, 2.4f, false), true});
  list.push_back({"thin wall", glass(distribution, alpha, 1.5f, true)});

  SurfaceParams mixed = glass(distribution, alpha, 1.33f, false);
  mixed.base_color = {0.9f, 0.5f, 0.7f};
  mixed.transmission = 0.6f;
  mixed.metallic = 0.2f;
  list.push_back({"everything from outside", mixed});
  list.push_back({"everything from inside", mixed, true});

  SurfaceParams matched = mixed;
  matched.ior = 1;
  list.push_back({"index-matched mixture", matched});
  return list;
}

inline NamedMaterial lambert_material() {
  SurfaceParams params;
  params.base_color = {0.7f, 0.4f, 0.2f};
  return {"lambert", params};
}

}  // namespace helio::test
