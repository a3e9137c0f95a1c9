// How much light a rough reflection lobe returns: its directional albedo, and with it the energy that is lost.
//
// For Schlick's Fresnel term the albedo is linear in f0 and f90 (Karis 2013, "split sum"):
//   E(mu) = f0 a + f90 b,   a = <G1(wi) (1 - s)>,  b = <G1(wi) s>,  s = (1 - wo.m)^5 over visible normals m.
// a + b, the albedo for F = 1, is what the single-scattering model keeps of a white furnace; the rest is
// scattered again by other facets: bsdf_layered.h gives it back to metal. Kept, by perceptual roughness r
// (alpha = r^2) and cosine mu, GGX / Beckmann (measured by microfacet_albedo_test, which holds this table to 0.005):
//
//             mu = 1          mu = 0.5        mu = 0.1
//   r = 0.2   0.998 / 1.000   0.994 / 1.000   0.925 / 0.972
//   r = 0.4   0.968 / 1.000   0.925 / 0.989   0.866 / 0.917
//   r = 0.6   0.823 / 0.996   0.776 / 0.902   0.824 / 0.934
//   r = 0.8   0.556 / 0.814   0.601 / 0.846   0.713 / 0.933
//   r = 1.0   0.307 / 0.462   0.410 / 0.756   0.558 / 0.902
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "renderer/scene/description/scene_description.h"

namespace helio {

// The three are averages over the hemisphere of outgoing directions, so that mixtures of them are averages too.
struct AlbedoTerms {
  float a = 1, b = 0;  // as above; a, b >= 0 and a + b <= 1
  float s = 0;         // mean of (1 - wo.m)^5 over the light that leaves: b / (a + b)
  float loss = 0;      // 1 - a - b without cancellation: what facets that reflect all send to others

  float albedo(float f0, float f90) const { return f0 * a + f90 * b; }

  // Share of the light that enters the surface: what the first facet lets in, and of the light that a second facet
  // would receive the part 1 - f0. At most 1 - albedo; 0 for a perfect reflector.
  float entering(float f0, float f90) const {
    const float first = f0 + (f90 - f0) * s;
    return std::max(0.0f, 1 - first + (1 - f0) * (first - albedo(f0, f90)));
  }
};

// The same for any reflectance of a facet that depends on the cosine c alone, as films have it:
//   F = f90 s + (1 - s) q(c),   E(mu) = f90 b + sum_k w_k q(k / (kNodes - 1)),
// exact where q is linear between the nodes. The weights add up to a.
struct CosineWeights {
  static constexpr std::size_t kNodes = 32;
  std::array<float, kNodes> w{};
};

// Where an alpha lies between the nodes of a distribution's tables: made once for lookups of many cosines.
struct AlbedoRow {
  MicrofacetDistribution distribution = MicrofacetDistribution::ggx;
  int index = 0;
  float t = 0;
};
AlbedoRow albedo_row(MicrofacetDistribution distribution, float alpha);

// mu = cosine of the direction, [0, 1]; alpha in [0, 1], 0 being the mirror. Interpolated from a table; absolute error
// below 0.002 for alpha 0 and from kDeltaAlpha on. The table of a distribution is computed on first use (about 70 ms)
// and then immutable.
AlbedoTerms directional_albedo(const AlbedoRow& row, float mu);
inline AlbedoTerms directional_albedo(MicrofacetDistribution distribution, float alpha, float mu) {
  return directional_albedo(albedo_row(distribution, alpha), mu);
}

// Cosine-weighted mean of directional_albedo over the hemisphere, exact for its interpolant.
AlbedoTerms mean_albedo(const AlbedoRow& row);
inline AlbedoTerms mean_albedo(MicrofacetDistribution distribution, float alpha) {
  return mean_albedo(albedo_row(distribution, alpha));
}

// Directional and mean as above.
CosineWeights directional_weights(const AlbedoRow& row, float mu);
CosineWeights mean_weights(const AlbedoRow& row);

// Directions by what facets lose of the light from them: the density follows loss cos, in steps of the table, for
// seven eighths of them; the others follow the cosine alone. The sampled cosine for u in [0, 1); and the density per
// solid angle for a cosine.
float sample_loss_cosine(const AlbedoRow& row, float u);
float loss_pdf_w(const AlbedoRow& row, float mu);

// The numbers behind directional_albedo(), mean_albedo() and the two above, for devices that look them up themselves:
// rows over nodes of the cosine, one a node of alpha. Valid until the program ends.
struct AlbedoTableView {
  std::size_t mu_nodes = 0;                  // equidistant in the fourth root of the cosine, from 0 to 1
  std::span<const AlbedoTerms> directional;  // by row
  std::span<const AlbedoTerms> mean;         // one a row
  std::span<const float> lost_below;         // by row: loss 2 mu dmu integrated up to each node
};
AlbedoTableView albedo_table(MicrofacetDistribution distribution);

// Computes the tables now, so that no frame waits for them. Thread safe.
void prepare_albedo_tables(MicrofacetDistribution distribution);

}  // namespace helio
