// sample, evaluate and is_pure_delta tell one story; reciprocity; refraction; total internal reflection.
#include <gtest/gtest.h>

#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/bsdf/bsdf_lambert.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "tests/unit/trace/bsdf/bsdf_checks.h"

namespace helio::test {
namespace {

constexpr MicrofacetDistribution kDistributions[] = {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann};

std::vector<NamedMaterial> all_materials(MicrofacetDistribution distribution, float alpha) {
  std::vector<NamedMaterial> list = materials_at(distribution, alpha);
  list.push_back(lambert_material());
  return list;
}

TEST(Bsdf, WeightIsValueOverDensity) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : {0.02f, 0.2f, 1.0f}) {
      for (const NamedMaterial& material : all_materials(distribution, alpha)) {
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
        check_weights(material, 1e-3, 0);
      }
    }
  }
}

TEST(Bsdf, ReflectionIsReciprocal) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : {0.05f, 0.3f, 1.0f}) {
      for (const NamedMaterial& material : all_materials(distribution, alpha)) {
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
        check_reflection_is_reciprocal(material, 1e-6, 2e-4);
      }
    }
  }
}

TEST(Bsdf, RefractionIsReciprocalUpToTheSquaredIndex) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : {0.1f, 0.5f, 1.0f}) {
      for (const float ior : {1.2f, 1.5f, 2.4f}) {
        SCOPED_TRACE(std::to_string(alpha) + " " + std::to_string(ior));
        check_refraction_is_reciprocal(glass(distribution, alpha, ior, false), ior * ior);
      }
    }
  }
}

TEST(Bsdf, ThinWallIsReciprocalAndMirrorsItsReflection) {
  SurfaceParams params = glass(MicrofacetDistribution::ggx, 0.3f, 1.5f, true);
  Random random(43);
  for (int i = 0; i < 1000; ++i) {
    const V3f a = random_direction(random, 1), b = random_direction(random, 1);
    const V3f a_below(a.x, a.y, -a.z), b_below(b.x, b.y, -b.z);
    const float ab = evaluate_bsdf(params, a, b_below).f_cos.x / b.z;
    const float ba = evaluate_bsdf(params, b, a_below).f_cos.x / a.z;
    ASSERT_NEAR(ab, ba, 2e-4 * ab + 1e-6);
    // One facet reflects F of the light and passes 1 - F into the mirrored direction.
    const float cos_m = dot(a, normalize(a + b)), f = fresnel_dielectric(cos_m, 1.5f).reflectance;
    const float reflected = evaluate_bsdf(params, a, b).f_cos.x / b.z;
    ASSERT_NEAR(ab * f, reflected * (1 - f), 1e-3f * reflected + 1e-6f);
  }
}

TEST(Bsdf, SmoothGlassObeysSnellAndFresnel) {
  const SurfaceParams params = glass(MicrofacetDistribution::ggx, 0, 1.5f, false);
  for (const float z : {1.0f, 0.8f, 0.3f, 0.01f}) {
    const V3f wo = direction_with_z(z);
    const float f = fresnel_dielectric(z, 1.5f).reflectance;
    const BsdfSample up = sample_bsdf(params, wo, 0, V2f(0.5f, 0.5f));
    EXPECT_NEAR(up.pdf_w, f, 1e-6);
    EXPECT_EQ(up.wi, V3f(-wo.x, -wo.y, wo.z));
    EXPECT_EQ(up.eta, 1);
    const BsdfSample down = sample_bsdf(params, wo, kOneMinusEpsilon, V2f(0.5f, 0.5f));
    ASSERT_TRUE(down.transmitted && down.delta);
    EXPECT_NEAR(down.pdf_w, 1 - f, 1e-6);
    EXPECT_NEAR(down.weight.x, 1 / 2.25f, 1e-6);  // radiance spreads: 1 / eta^2
    EXPECT_FLOAT_EQ(down.eta, 1.5f);
    EXPECT_NEAR(1.5 * std::hypot(down.wi.x, down.wi.y), std::hypot(wo.x, wo.y), 1e-6);
    // And back: the same way out, the radiance factor undone.
    const BsdfSample out = sample_bsdf(params, down.wi, kOneMinusEpsilon, V2f(0.5f, 0.5f));
    ASSERT_TRUE(out.transmitted);
    EXPECT_NEAR(length(out.wi - wo), 0, 1e-5 / z);
    EXPECT_NEAR(down.weight.x * out.weight.x, 1, 1e-5);
    EXPECT_NEAR(down.eta * out.eta, 1, 1e-6);
  }
}

TEST(Bsdf, TotalInternalReflectionIsTotal) {
  for (const float specular : {1.0f, 0.0f}) {
    SurfaceParams params = glass(MicrofacetDistribution::ggx, 0, 1.5f, false);
    params.specular = specular;
    params.base_color = {0.1f, 0.2f, 0.3f};
    const V3f wo = direction_at(130, 0);  // 50 degrees from the inner normal; critical: 41.8
    for (const float u_lobe : {0.0f, 0.5f, kOneMinusEpsilon}) {
      const BsdfSample sample = sample_bsdf(params, wo, u_lobe, V2f(0.3f, 0.7f));
      ASSERT_TRUE(sample.delta);
      EXPECT_FALSE(sample.transmitted);
      EXPECT_EQ(sample.wi, V3f(-wo.x, -wo.y, wo.z));
      EXPECT_EQ(sample.weight, Rgb(1, 1, 1));
      EXPECT_EQ(sample.pdf_w, 1);
    }
  }
}

TEST(Bsdf, MatchedIndexPassesThroughWhateverTheRoughness) {
  for (const float alpha : {0.0f, 0.3f, 1.0f}) {
    for (const float side : {1.0f, -1.0f}) {
      SurfaceParams params = glass(MicrofacetDistribution::ggx, alpha, 1, false);
      params.base_color = {0.5f, 1, 0.25f};
      const V3f wo = direction_at(side > 0 ? 75 : 105, 10);
      const BsdfSample sample = sample_bsdf(params, wo, 0.4f, V2f(0.1f, 0.9f));
      ASSERT_TRUE(sample.delta && sample.transmitted);
      EXPECT_EQ(sample.wi, -wo);
      EXPECT_EQ(sample.weight, params.base_color);
      EXPECT_EQ(sample.eta, 1);
      EXPECT_TRUE(is_pure_delta(params));
    }
  }
}

TEST(Bsdf, NearlyMatchedIndexIsExactWhereSmooth) {
  const SurfaceParams params = glass(MicrofacetDistribution::ggx, 0, 1.0005f, false);
  const V3f wo = direction_at(88, 10);
  const BsdfSample sample = sample_bsdf(params, wo, kOneMinusEpsilon, V2f(0.1f, 0.9f));
  ASSERT_TRUE(sample.delta && sample.transmitted);
  EXPECT_NEAR(1 - sample.pdf_w, fresnel_dielectric(wo.z, 1.0005f).reflectance, 1e-6);
  EXPECT_NEAR(1.0005 * std::hypot(sample.wi.x, sample.wi.y), std::hypot(wo.x, wo.y), 1e-6);
}

TEST(Bsdf, ThinSmoothWallPassesStraight) {
  SurfaceParams params = glass(MicrofacetDistribution::ggx, 0, 1.5f, true);
  params.base_color = {0.5f, 0.6f, 0.7f};
  const V3f wo = direction_at(40, 10);
  const BsdfSample sample = sample_bsdf(params, wo, kOneMinusEpsilon, V2f(0.1f, 0.9f));
  ASSERT_TRUE(sample.transmitted && sample.delta);
  EXPECT_EQ(sample.wi, -wo);
  EXPECT_EQ(sample.eta, 1);
  // weight x probability = tint (1 - F), channel by channel.
  const float passed = 1 - fresnel_dielectric(wo.z, 1.5f).reflectance;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sample.weight[c] * sample.pdf_w, params.base_color[c] * passed, 1e-6);
  }
}

TEST(Bsdf, MaterialWithoutSpecularIsLambert) {
  SurfaceParams params = metallic_roughness(MicrofacetDistribution::ggx, 1);
  params.specular = 0;
  params.base_color = {0.7f, 0.4f, 0.1f};
  SurfaceParams diffuse = params;
  diffuse.model = LobeModel::lambert;
  Random random(47);
  for (int i = 0; i < 200; ++i) {
    const V3f wo = random_direction(random, 1), wi = random_direction(random, 1);
    const BsdfValue full = evaluate_bsdf(params, wo, wi), lambert = evaluate_bsdf(diffuse, wo, wi);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(full.f_cos[c], lambert.f_cos[c], 1e-6);
    EXPECT_NEAR(full.pdf_w, lambert.pdf_w, 1e-6);
    EXPECT_NEAR(lambert.f_cos.x, 0.7f * wi.z / kPi, 1e-6);
  }
}

TEST(Bsdf, PureDeltaMeansThatEvaluationIsZero) {
  Random random(53);
  for (const float alpha : {0.0f, 0.99f * kDeltaAlpha, kDeltaAlpha, 0.01f, 0.3f}) {
    for (const NamedMaterial& material : all_materials(MicrofacetDistribution::ggx, alpha)) {
      bool always_zero = true;
      for (int i = 0; i < 200; ++i) {
        const V3f wo = random_direction(random, material.from_inside ? -1.0f : 1.0f);
        const BsdfSample sample = sample_bsdf(material.params, wo, random.next_float(), random.next_v2f());
        if (sample.valid() && !sample.delta) always_zero = false;
        const V3f wi = random_direction(random, i % 2 == 0 ? 1.0f : -1.0f);
        if (evaluate_bsdf(material.params, wo, wi).pdf_w > 0) always_zero = false;
      }
      EXPECT_EQ(is_pure_delta(material.params), always_zero) << material.name << ' ' << alpha;
    }
  }
  SurfaceParams none;
  none.model = LobeModel::none;
  EXPECT_TRUE(is_pure_delta(none));
  EXPECT_FALSE(sample_bsdf(none, V3f(0, 0, 1), 0, V2f(0, 0)).valid());
}

TEST(Bsdf, OnlyVolumesAreSeenFromBelow) {
  const V3f below = direction_at(120, 0);
  for (NamedMaterial& material : all_materials(MicrofacetDistribution::ggx, 0.3f)) {
    material.params.thin = true;
    EXPECT_FALSE(sample_bsdf(material.params, below, 0.5f, V2f(0.5f, 0.5f)).valid()) << material.name;
    EXPECT_EQ(evaluate_bsdf(material.params, below, below).pdf_w, 0) << material.name;
    EXPECT_TRUE(is_black(surface_albedo(material.params, below)));
    material.params.thin = false;
    EXPECT_GT(evaluate_bsdf(material.params, below, V3f(-below.x, 0, below.z)).pdf_w, 0) << material.name;
  }
}

}  // namespace
}  // namespace helio::test
