#include <gtest/gtest.h>

#include "renderer/trace/bsdf/microfacet.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {
namespace {

constexpr MicrofacetDistribution kDistributions[] = {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann};
constexpr float kAlphas[] = {1e-3f, 0.03f, 0.3f, 1.0f};
constexpr double kAngles[] = {0, 30, 70, 89, 89.999};

std::string trace_of(const Microfacet& microfacet, double angle) {
  return name_of(microfacet.distribution) + " alpha " + std::to_string(microfacet.alpha) + ", " +
         std::to_string(angle) + " degrees";
}

TEST(InverseErf, InvertsTheErrorFunction) {
  for (float x = -3.7f; x <= 3.7f; x += 1e-3f) {
    const float y = std::erf(x);
    EXPECT_NEAR(std::erf(inverse_erf(y)), y, 3e-7) << x;
    // Rounding y to a float moves the inverse by up to 2^-24 sqrt(pi) / 2 exp(x^2).
    EXPECT_NEAR(inverse_erf(y), x, 2e-6 + 4e-7 * std::exp(x * x)) << x;
  }
  for (const float edge : {-2.0f, -1.0f, 1.0f, 2.0f}) EXPECT_TRUE(std::isfinite(inverse_erf(edge)));
  EXPECT_EQ(inverse_erf(0), 0);
}

TEST(MicrofacetDistribution, ProjectedNormalsCoverTheGroundOnce) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : kAlphas) {
      const Microfacet microfacet{distribution, alpha};
      const double area = integrate_sphere(SphereMap(V3f(0, 0, 1), alpha), [&](const V3f& m) {
        return double(microfacet.normal_density(m)) * std::max(0.0f, m.z);
      });
      EXPECT_NEAR(area, 1, 2e-4) << trace_of(microfacet, 0);
    }
  }
}

// Heitz 2014, eq. 14: the projected area of the visible microsurface is the integral of D max(0, w.m) over normals,
// masked; for Smith's masking sigma(w) = int D(m) max(0, w.m) dm exactly.
TEST(MicrofacetDistribution, ProjectedAreaIsTheIntegralOverFacingNormals) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : kAlphas) {
      const Microfacet microfacet{distribution, alpha};
      for (const double angle : kAngles) {
        const V3f w = direction_at(angle, 40);
        const double area = integrate_sphere(SphereMap(V3f(0, 0, 1), alpha), [&](const V3f& m) {
          return double(microfacet.normal_density(m)) * std::max(0.0f, dot(w, m));
        });
        EXPECT_NEAR(microfacet.projected_area(w) / area, 1, 2e-3) << trace_of(microfacet, angle);
        EXPECT_NEAR(microfacet.masking(w), w.z / area, 2e-3) << trace_of(microfacet, angle);
      }
    }
  }
}

TEST(MicrofacetDistribution, VisibleNormalsHaveTheirDensity) {
  const int kSamples = kChiSquareSamples;
  const int tests = int(std::size(kDistributions) * std::size(kAlphas) * std::size(kAngles));
  for (const auto distribution : kDistributions) {
    for (const float alpha : kAlphas) {
      const Microfacet microfacet{distribution, alpha};
      for (const double angle : kAngles) {
        const V3f wo = direction_at(angle, 40);
        Random random(5);
        SphereHistogram histogram(V3f(0, 0, 1), alpha, 20, 40);
        for (int i = 0; i < kSamples; ++i) histogram.add(microfacet.sample_visible_normal(wo, random.next_v2f()));
        const ChiSquareResult result = histogram.test([&](const V3f& m) {
          return double(microfacet.normal_density(m)) * std::max(0.0f, dot(wo, m)) / microfacet.projected_area(wo);
        });
        EXPECT_TRUE(result.passes(kSignificance, tests)) << trace_of(microfacet, angle) << ": " << result.summary();
      }
    }
  }
}

TEST(MicrofacetDistribution, VisibleNormalsAreUnitAndUpAtTheEdges) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : {1e-3f, 0.5f, 1.0f}) {
      for (const float z : {1.0f, 0.5f, 1e-5f, 1e-20f, 0.0f}) {
        for (const float ux : {0.0f, 0x1p-24f, 0.5f, kOneMinusEpsilon}) {
          for (const float uy : {0.0f, 0x1p-24f, 0.5f, kOneMinusEpsilon}) {
            const V3f m = Microfacet{distribution, alpha}.sample_visible_normal(direction_with_z(z), V2f(ux, uy));
            ASSERT_NEAR(length(m), 1, 1e-5) << alpha << ' ' << z << ' ' << ux << ' ' << uy;
            ASSERT_GE(m.z, 0);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
