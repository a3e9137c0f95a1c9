// sample_bsdf draws from the density that evaluate_bsdf states, in shape and in total: what is missing from 1 is the
// share of deltas and of invalid samples.
#include <gtest/gtest.h>

#include "renderer/trace/bsdf/bsdf.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/bsdf_checks.h"

namespace helio::test {
namespace {

// Of each of some four hundred tests: densities that are off by 2 % in half of the cells fail, as does a mass that is
// off by 1 %.
const int kSamples = kChiSquareSamples / 2;
constexpr float kAlphas[] = {0.01f, 0.15f, 0.7f};
// The roughest, and those next to the delta switch: the smallest that is a lobe, and one a little larger.
constexpr float kHardAlphas[] = {kDeltaAlpha, 0.0011f, 0.5f, 1.0f};
constexpr double kAngles[] = {0, 50, 80, 89.9};
constexpr MicrofacetDistribution kDistributions[] = {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann};
// Materials x distributions x alphas x angles x parts: an upper bound suffices.
constexpr int kTests = 13 * 2 * 3 * 4 * 2 + 3 * 2 * 4 * 3 * 3;

// Which light a histogram counts: every other sample belongs elsewhere.
enum class Part { reflected, transmitted };

// Tests in the domain of half vectors, where a lobe of roughness alpha has the width alpha whatever the incidence. The
// Jacobians are the textbook's (Walter 2007, eq. 13 to 17), in double.
class HalfVectorDomain {
 public:
  HalfVectorDomain(const SurfaceParams& params, const V3f& wo, Part part)
      : params_(params), wo_(wo), sign_(wo.z > 0 ? 1 : -1), part_(part) {
    const bool refracts = part == Part::transmitted && !params.thin;
    if (refracts) eta_ = wo.z > 0 ? params.ior : 1.0 / params.ior;
    mirrored_ = part == Part::transmitted && params.thin;
    above_ = V3d(wo.x, wo.y, std::fabs(wo.z));
  }

  V3f half_vector(const V3f& wi) const {
    V3d w(wi.x, wi.y, wi.z * sign_ * (mirrored_ ? -1 : 1));
    const V3d h = (above_ + w * eta_).normalized();
    return V3f(h.z < 0 ? -h : h);
  }

  double density(const V3f& m_float) const {
    const V3d m = V3d(m_float).normalized();
    const double c = above_.dot(m);
    if (m.z <= 0 || c <= 0) return 0;
    if (part_ == Part::reflected || mirrored_) {
      const V3d wi = m * (2 * c) - above_;
      return wi.z > 0 ? pdf_w(V3d(wi.x, wi.y, mirrored_ ? -wi.z : wi.z)) * 4 * c : 0;
    }
    const double cos_t2 = 1 - (1 - c * c) / (eta_ * eta_);
    if (cos_t2 <= 0) return 0;
    const double cos_t = std::sqrt(cos_t2);
    const V3d wi = m * (c / eta_ - cos_t) - above_ / eta_;
    if (wi.z >= 0) return 0;
    return pdf_w(wi) * std::pow(c - eta_ * cos_t, 2) / (eta_ * eta_ * cos_t);
  }

 private:
  double pdf_w(const V3d& wi) const { return evaluate_bsdf(params_, wo_, V3f(V3d(wi.x, wi.y, wi.z * sign_))).pdf_w; }

  const SurfaceParams& params_;
  V3f wo_;
  V3d above_;
  double sign_, eta_ = 1;
  Part part_;
  bool mirrored_ = false;
};

bool belongs(const BsdfSample& sample, Part part) {
  return sample.valid() && !sample.delta && sample.transmitted == (part == Part::transmitted);
}

// What leaves a rough volume from beyond 85 degrees is left out: from 89.9 degrees a share of at most 0.004 goes to
// within 0.15 degrees of the horizon, a band that is too narrow to integrate in either domain.
std::vector<Part> parts_of(const SurfaceParams& params, const V3f& wo, double angle) {
  const bool transmits = params.transmission > 0 && std::fabs(params.ior - 1) > 0.01f;
  if (transmits && (wo.z > 0 || angle < 85)) return {Part::reflected, Part::transmitted};
  return {Part::reflected};
}

// What is compared of one part of the samples: half vectors, and directions where these are smooth enough to integrate.
struct PartHistograms {
  PartHistograms(const SurfaceParams& params, const V3f& wo, double angle, Part part)
      : part(part),
        up((wo.z > 0) == (part == Part::reflected) ? 1.0f : -1.0f),
        also_directions(params.alpha > 0.1f && angle < 85),
        domain(params, wo, part),
        half_vectors(V3f(0, 0, 1), params.alpha, 16, 32),
        directions(V3f(0, 0, up), 1, 16, 32) {}

  void add(const BsdfSample& sample) {
    if (!belongs(sample, part)) {
      half_vectors.add_elsewhere();
      directions.add_elsewhere();
      return;
    }
    half_vectors.add(domain.half_vector(sample.wi));
    if (also_directions) directions.add(sample.wi);
  }

  Part part;
  float up;
  bool also_directions;
  HalfVectorDomain domain;
  SphereHistogram half_vectors, directions;
};

void expect_samples_follow_density(const NamedMaterial& material, double angle) {
  V3f wo = direction_at(angle, 25);
  if (material.from_inside) wo.z = -wo.z;
  const SurfaceParams& params = material.params;
  std::vector<PartHistograms> parts;
  for (const Part part : parts_of(params, wo, angle)) parts.emplace_back(params, wo, angle, part);
  Random random(17);
  for (int i = 0; i < kSamples; ++i) {
    const float u_lobe = random.next_float();
    const BsdfSample sample = sample_bsdf(params, wo, u_lobe, random.next_v2f());
    for (PartHistograms& part : parts) part.add(sample);
  }
  for (const PartHistograms& part : parts) {
    SCOPED_TRACE(material.name + ", " + std::to_string(angle) + " degrees, " +
                 (part.part == Part::reflected ? "reflected" : "transmitted"));
    // The mass as well: an integral that misses a lobe has no cells to compare.
    const auto expect_agreement = [&](const char* domain, const SphereHistogram& histogram, const auto& density) {
      double mass = 0;
      const ChiSquareResult result = histogram.test(density, &mass);
      EXPECT_TRUE(result.passes(kSignificance, kTests)) << domain << ": " << result.summary() << ", mass " << mass;
      EXPECT_NEAR(mass, histogram.share(), 6 * std::sqrt((histogram.share() + 1e-5) / kSamples) + 2e-4) << domain;
    };
    expect_agreement("half vectors", part.half_vectors, [&](const V3f& m) { return part.domain.density(m); });
    if (!part.also_directions) continue;
    expect_agreement("directions", part.directions,
                     [&](const V3f& wi) { return wi.z * part.up > 0 ? evaluate_bsdf(params, wo, wi).pdf_w : 0.0f; });
  }
}

TEST(BsdfChiSquare, Lambert) {
  for (const double angle : kAngles) expect_samples_follow_density(lambert_material(), angle);
}

class BsdfChiSquareAtAlpha : public testing::TestWithParam<std::tuple<MicrofacetDistribution, float>> {};

TEST_P(BsdfChiSquareAtAlpha, EveryMaterialAndAngle) {
  for (const NamedMaterial& material : materials_at(std::get<0>(GetParam()), std::get<1>(GetParam()))) {
    for (const double angle : kAngles) expect_samples_follow_density(material, angle);
  }
}

INSTANTIATE_TEST_SUITE_P(, BsdfChiSquareAtAlpha,
                         testing::Combine(testing::ValuesIn(kDistributions), testing::ValuesIn(kAlphas)),
                         [](const auto& info) {
                           return name_of(std::get<0>(info.param)) + "_alpha_" +
                                  std::to_string(std::lround(std::get<1>(info.param) * 100)) + "_percent";
                         });

class BsdfChiSquareAtHardAlpha : public testing::TestWithParam<std::tuple<MicrofacetDistribution, float>> {};

TEST_P(BsdfChiSquareAtHardAlpha, ConductorAndGlass) {
  for (const NamedMaterial& material : materials_at(std::get<0>(GetParam()), std::get<1>(GetParam()))) {
    if (material.name != "conductor" && !material.name.starts_with("glass from")) continue;
    ASSERT_FALSE(is_pure_delta(material.params));
    // The half vector of float directions is known to 6e-8 / (2 cosine): at 89.9 degrees to 2 % of the smallest alphas,
    // which half a million samples show.
    for (const double angle : {0.0, 80.0, material.params.alpha < 0.01f ? 89.0 : 89.9})
      expect_samples_follow_density(material, angle);
  }
}

INSTANTIATE_TEST_SUITE_P(, BsdfChiSquareAtHardAlpha,
                         testing::Combine(testing::ValuesIn(kDistributions), testing::ValuesIn(kHardAlphas)),
                         [](const auto& info) {
                           return name_of(std::get<0>(info.param)) + "_alpha_" +
                                  std::to_string(std::lround(std::get<1>(info.param) * 1e4)) + "_of_10000";
                         });

// The delta switch: below it the only density left is that of the diffuse base.
TEST(BsdfChiSquare, SmoothMaterials) {
  for (const NamedMaterial& material : materials_at(MicrofacetDistribution::ggx, 0.5f * kDeltaAlpha)) {
    for (const double angle : {0.0, 60.0, 89.0}) {
      V3f wo = direction_at(angle, 25);
      if (material.from_inside) wo.z = -wo.z;
      SCOPED_TRACE(material.name);
      SphereHistogram histogram(V3f(0, 0, wo.z > 0 ? 1 : -1), 1, 16, 32);
      Random random(18);
      for (int i = 0; i < kSamples; ++i) {
        const float u_lobe = random.next_float();
        const BsdfSample sample = sample_bsdf(material.params, wo, u_lobe, random.next_v2f());
        ASSERT_TRUE(sample.valid());
        sample.delta ? histogram.add_elsewhere() : histogram.add(sample.wi);
      }
      const ChiSquareResult result =
          histogram.test([&](const V3f& wi) { return evaluate_bsdf(material.params, wo, wi).pdf_w; });
      EXPECT_TRUE(result.passes(kSignificance, kTests)) << result.summary();
    }
  }
}

// The probability that a delta sample reports is the frequency with which it comes.
TEST(BsdfChiSquare, DeltaProbabilities) {
  const float below = std::nextafter(kDeltaAlpha, 0.0f);
  for (const float alpha : {0.0f, 1e-4f, below}) {
    for (const NamedMaterial& material : materials_at(MicrofacetDistribution::ggx, alpha)) {
      SCOPED_TRACE(material.name + ", alpha " + std::to_string(alpha));
      check_delta_probabilities(material, 55, kSamples, 19);
    }
  }
}

// Of metal and glass nothing but deltas is left below the switch, whatever the distribution.
TEST(BsdfChiSquare, BelowTheSwitchAllIsDelta) {
  for (const MicrofacetDistribution distribution : kDistributions) {
    for (const float alpha : {0.0f, 1e-4f, std::nextafter(kDeltaAlpha, 0.0f)}) {
      for (const NamedMaterial& material : materials_at(distribution, alpha)) {
        if (material.name != "conductor" && material.name != "metal" && !material.name.starts_with("glass")) continue;
        SCOPED_TRACE(material.name + ", alpha " + std::to_string(alpha));
        EXPECT_TRUE(is_pure_delta(material.params));
        Random random(20);
        for (const double angle : kAngles) {
          V3f wo = direction_at(angle, 25);
          if (material.from_inside) wo.z = -wo.z;
          for (int i = 0; i < 1000; ++i) {
            const float u_lobe = random.next_float();
            const BsdfSample sample = sample_bsdf(material.params, wo, u_lobe, random.next_v2f());
            ASSERT_TRUE(sample.valid() && sample.delta);
            ASSERT_EQ(evaluate_bsdf(material.params, wo, sample.wi).pdf_w, 0);
            if (sample.transmitted) continue;
            ASSERT_LT(length(sample.wi - V3f(-wo.x, -wo.y, wo.z)), 1e-6f);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
