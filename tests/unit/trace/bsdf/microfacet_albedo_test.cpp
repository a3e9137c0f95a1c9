#include "renderer/trace/bsdf/microfacet_albedo.h"

#include <gtest/gtest.h>

#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet.h"
#include "tests/support/chi_square.h"
#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {
namespace {

// Straight from the definition: int D G1(wo) G1(wi) F / (4 wo.z) dwi over the hemisphere, without importance sampling.
double brute_force_albedo(const Microfacet& microfacet, double mu, bool schlick) {
  const V3f wo(float(std::sqrt(1 - mu * mu)), 0, float(mu));
  return integrate_sphere(
      SphereMap(V3f(-wo.x, 0, wo.z), 2 * microfacet.alpha),
      [&](const V3f& wi) {
        if (wi.z <= 0) return 0.0;
        const V3f m = normalize(wo + wi);
        const double f = schlick ? schlick_term(dot(wo, m)) : 1;
        return f * microfacet.normal_density(m) * microfacet.masking(wo) * microfacet.masking(wi) / (4 * mu);
      },
      1e-6);
}

TEST(MicrofacetAlbedo, TableEqualsBruteForce) {
  for (const auto distribution : {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann}) {
    for (const float alpha : {0.05f, 0.2f, 0.5f, 0.83f, 1.0f}) {
      for (const double mu : {0.03, 0.1, 0.4, 0.75, 1.0}) {
        const AlbedoTerms terms = directional_albedo(distribution, alpha, float(mu));
        const Microfacet microfacet{distribution, alpha};
        const double total = brute_force_albedo(microfacet, mu, false);
        const double grazing = brute_force_albedo(microfacet, mu, true);
        EXPECT_NEAR(terms.a + terms.b, total, 0.003) << alpha << ' ' << mu;
        EXPECT_NEAR(terms.b, grazing, 0.003) << alpha << ' ' << mu;
        EXPECT_NEAR(terms.s, grazing / total, 0.003) << alpha << ' ' << mu;
      }
    }
  }
}

// Mean of kept(c, s) over 256 x 256 strata of visible normals: what facets seen under the cosine c keep of light.
template <typename Kept>
double mean_over_visible_normals(const Microfacet& microfacet, float mu, const Kept& reflectance) {
  constexpr int kStrata = 256;
  const V3f wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
  double sum = 0;
  for (int i = 0; i < kStrata * kStrata; ++i) {
    const V2f u((float(i % kStrata) + 0.5f) / kStrata, (float(i / kStrata) + 0.5f) / kStrata);
    const V3f m = microfacet.sample_visible_normal(wo, u);
    const float c = std::max(0.0f, dot(wo, m));
    sum += double(microfacet.masking(m * (2 * c) - wo)) * reflectance(c);
  }
  return sum / (kStrata * kStrata);
}

// Where the albedo falls within a hundredth of the cosine.
TEST(MicrofacetAlbedo, TableIsRightForSmoothSurfacesSeenFromNearTheHorizon) {
  for (const auto distribution : {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann}) {
    for (const float alpha : {1e-3f, 0.0013f, 0.0021f, 0.0034f, 0.008f, 0.03f}) {
      for (const float mu : {0.0087f, 0.013f, 0.02f, 0.04f, 0.1f}) {
        const AlbedoTerms terms = directional_albedo(distribution, alpha, mu);
        const Microfacet microfacet{distribution, alpha};
        const auto schlick = [](float c) { return schlick_term(c); };
        EXPECT_NEAR(terms.a + terms.b, mean_over_visible_normals(microfacet, mu, [](float) { return 1.0f; }), 0.003)
            << name_of(distribution) << ' ' << alpha << ' ' << mu;
        EXPECT_NEAR(terms.b, mean_over_visible_normals(microfacet, mu, schlick), 0.003)
            << name_of(distribution) << ' ' << alpha << ' ' << mu;
      }
    }
  }
}

// A reflectance that waves with the cosine, as films' do.
TEST(MicrofacetAlbedo, WeightsGiveTheAlbedoOfAnyReflectance) {
  const auto wave = [](float c) { return 0.3f + 0.2f * std::cos(7 * c); };
  const auto reflectance = [&](float c) { return wave(c) + (1 - wave(c)) * schlick_term(c); };
  for (const auto distribution : {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann}) {
    for (const float alpha : {0.005f, 0.1f, 0.5f, 1.0f}) {
      for (const float mu : {0.02f, 0.1f, 0.4f, 1.0f}) {
        const AlbedoTerms terms = directional_albedo(distribution, alpha, mu);
        const CosineWeights weights = directional_weights(albedo_row(distribution, alpha), mu);
        float albedo = terms.b, sum = 0;
        for (std::size_t k = 0; k < CosineWeights::kNodes; ++k) {
          albedo += weights.w[k] * wave(float(k) / float(CosineWeights::kNodes - 1));
          sum += weights.w[k];
        }
        EXPECT_NEAR(sum, terms.a, 1e-5);
        EXPECT_NEAR(albedo, mean_over_visible_normals({distribution, alpha}, mu, reflectance), 0.004)
            << name_of(distribution) << ' ' << alpha << ' ' << mu;
      }
    }
  }
}

// The mean is 2 int E mu dmu of the interpolated albedo.
TEST(MicrofacetAlbedo, MeansAreThoseOfTheTable) {
  constexpr int kSteps = 20'000;
  for (const float alpha : {0.0f, 0.002f, 0.3f}) {
    double a = 0, first = 0;
    for (int i = 0; i < kSteps; ++i) {
      const float mu = (float(i) + 0.5f) / kSteps;
      a += 2 * mu * directional_albedo(MicrofacetDistribution::ggx, alpha, mu).a / kSteps;
      first += 2 * mu * directional_weights(albedo_row(MicrofacetDistribution::ggx, alpha), mu).w[3] / kSteps;
    }
    EXPECT_NEAR(mean_albedo(MicrofacetDistribution::ggx, alpha).a, a, 1e-4) << alpha;
    EXPECT_NEAR(mean_weights(albedo_row(MicrofacetDistribution::ggx, alpha)).w[3], first, 1e-4) << alpha;
  }
}

// GGX, alpha = 1, normal incidence: D = 1 / pi, m.z = c, wi.z = 2 c^2 - 1 and G1(wi) = 2 wi.z / (wi.z + 1), G1(wo) = 1:
// E = int_{c > 1/sqrt 2} D G1 c 2 pi dc = int 2 c (2 c^2 - 1) / c^2 dc = 1 - ln 2.
TEST(MicrofacetAlbedo, KnownInClosedFormForGgxAtFullRoughness) {
  const AlbedoTerms terms = directional_albedo(MicrofacetDistribution::ggx, 1, 1);
  EXPECT_NEAR(terms.a + terms.b, 1 - std::log(2.0), 1e-3);
}

TEST(MicrofacetAlbedo, MirrorIsSchlickItself) {
  for (const float mu : {0.0f, 0.2f, 0.6f, 1.0f}) {
    const AlbedoTerms terms = directional_albedo(MicrofacetDistribution::ggx, 0, mu);
    EXPECT_NEAR(terms.albedo(0.04f, 1), 0.04f + 0.96f * schlick_term(mu), 5e-4);
    EXPECT_NEAR(terms.entering(0.04f, 1), 0.96f * (1 - schlick_term(mu)), 5e-4);
  }
  // 2 int (1 - mu)^5 mu dmu = 1 / 21.
  EXPECT_NEAR(mean_albedo(MicrofacetDistribution::ggx, 0).b, 1.0 / 21, 2e-4);
}

TEST(MicrofacetAlbedo, EnteringNeverExceedsWhatIsNotReflected) {
  for (const auto distribution : {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann}) {
    for (int a = 0; a <= 50; ++a) {
      for (int i = 0; i <= 100; ++i) {
        const AlbedoTerms terms = directional_albedo(distribution, a / 50.0f, i / 100.0f);
        ASSERT_LE(terms.a + terms.b, 1.0001f);
        for (const float f0 : {0.0f, 0.04f, 0.5f, 1.0f}) {
          ASSERT_LE(terms.entering(f0, 1) + terms.albedo(f0, 1), 1.002f) << a << ' ' << i << ' ' << f0;
          ASSERT_GE(terms.entering(f0, 1), 0);
        }
        ASSERT_EQ(terms.entering(1, 1), 0);
        ASSERT_EQ(terms.entering(0, 0), 1);
      }
    }
  }
}

// Cells are equal in the fourth root of the cosine, as the table's are, but not the same ones.
TEST(MicrofacetAlbedo, DirectionsFollowTheLoss) {
  constexpr int kCells = 150, kPoints = 200;
  for (const auto distribution : {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann}) {
    for (const float alpha : {kDeltaAlpha, 0.004f, 0.05f, 0.37f, 1.0f}) {
      SCOPED_TRACE(name_of(distribution) + ' ' + std::to_string(alpha));
      std::vector<double> observed(kCells, 0.0), expected(kCells, 0.0);
      for (int i = 0; i < kChiSquareSamples; ++i) {
        const float u = (float(i) + 0.5f) / float(kChiSquareSamples);
        const float mu = sample_loss_cosine(albedo_row(distribution, alpha), u);
        ASSERT_TRUE(mu >= 0 && mu <= 1) << u;
        observed[std::size_t(std::min(kCells - 1, int(std::sqrt(std::sqrt(mu)) * kCells)))] += 1;
      }
      double whole = 0, mean_weight = 0;
      for (int i = 0; i < kCells * kPoints; ++i) {
        const double x = (i + 0.5) / (kCells * kPoints), mu = x * x * x * x, width = 4 * x * x * x / (kCells * kPoints);
        const double pdf_w = loss_pdf_w(albedo_row(distribution, alpha), float(mu));
        const double mass = 2 * std::numbers::pi * pdf_w * width;
        expected[std::size_t(i / kPoints)] += mass * kChiSquareSamples;
        whole += mass;
        mean_weight += 2 * mu * width * double(directional_albedo(distribution, alpha, float(mu)).loss);
      }
      EXPECT_NEAR(whole, 1, 1e-3);
      EXPECT_NEAR(mean_weight, double(mean_albedo(distribution, alpha).loss), 1e-3 * mean_weight);
      // Points at equal distances scatter less than random ones: the statistic tells what is wrong, not what is noise.
      const ChiSquareResult result = chi_square_test(observed, expected);
      EXPECT_GT(result.p_value, 1e-3) << result.summary();
    }
  }
}

// The energy that single scattering keeps: the table of microfacet_albedo.h.
TEST(MicrofacetAlbedo, LossesAreAsDocumented) {
  struct Row {
    float roughness, ggx[3], beckmann[3];
  };
  constexpr float kMu[3] = {1, 0.5f, 0.1f};
  constexpr Row kRows[] = {{0.2f, {0.998f, 0.994f, 0.925f}, {1, 1, 0.972f}},
                           {0.4f, {0.968f, 0.925f, 0.866f}, {1, 0.989f, 0.917f}},
                           {0.6f, {0.823f, 0.776f, 0.824f}, {0.996f, 0.902f, 0.934f}},
                           {0.8f, {0.556f, 0.601f, 0.713f}, {0.814f, 0.846f, 0.933f}},
                           {1.0f, {0.307f, 0.41f, 0.558f}, {0.462f, 0.756f, 0.902f}}};
  for (const Row& row : kRows) {
    const float alpha = row.roughness * row.roughness;
    for (int i = 0; i < 3; ++i) {
      const AlbedoTerms ggx = directional_albedo(MicrofacetDistribution::ggx, alpha, kMu[i]);
      const AlbedoTerms beckmann = directional_albedo(MicrofacetDistribution::beckmann, alpha, kMu[i]);
      EXPECT_NEAR(ggx.a + ggx.b, row.ggx[i], 0.005) << row.roughness << ' ' << kMu[i];
      EXPECT_NEAR(beckmann.a + beckmann.b, row.beckmann[i], 0.005) << row.roughness << ' ' << kMu[i];
    }
  }
}

}  // namespace
}  // namespace helio::test
