// White furnaces: what comes back from a surface that absorbs nothing, lobe by lobe.
#include <gtest/gtest.h>

#include "renderer/trace/bsdf.h"
#include "renderer/trace/fresnel.h"
#include "renderer/trace/microfacet_albedo.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf_checks.h"

namespace helio::test {
namespace {

constexpr float kAlphas[] = {0, 1e-3f, 0.002f, 0.01f, 0.1f, 0.4f, 1};
constexpr float kCosines[] = {1, 0.6f, 0.2f, 0.05f, 1.75e-5f};
constexpr MicrofacetDistribution kDistributions[] = {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann};
// What the tables may add: their interpolation error.
constexpr double kTableError = 0.002;
constexpr int kSamples = 20'000;

std::vector<NamedMaterial> white_materials(MicrofacetDistribution distribution, float alpha) {
  std::vector<NamedMaterial> list;
  SurfaceParams metal = metallic_roughness(distribution, alpha);
  metal.metallic = 1;
  list.push_back({"white metal", metal});
  list.push_back({"white plastic", metallic_roughness(distribution, alpha)});
  SurfaceParams dense = metallic_roughness(distribution, alpha);
  dense.ior = 3;
  list.push_back({"white dense plastic", dense});
  SurfaceParams reflector = metallic_roughness(distribution, alpha);
  reflector.ior = 0;
  list.push_back({"perfect reflector over white", reflector});
  SurfaceParams glossy = metallic_roughness(distribution, alpha);
  glossy.model = LobeModel::specular_glossiness;
  list.push_back({"specular-glossiness", glossy});
  for (const float ior : {1.0f, 1.01f, 1.5f, 2.4f}) {
    list.push_back({"glass " + std::to_string(ior), glass(distribution, alpha, ior, false)});
    list.push_back({"glass from inside " + std::to_string(ior), glass(distribution, alpha, ior, false), true});
    list.push_back({"thin wall " + std::to_string(ior), glass(distribution, alpha, ior, true)});
  }
  SurfaceParams mixed = glass(distribution, alpha, 1.5f, false);
  mixed.metallic = 0.3f;
  mixed.transmission = 0.5f;
  list.push_back({"everything", mixed});
  list.push_back({"everything from inside", mixed, true});
  return list;
}

TEST(BsdfEnergy, NoSurfaceReturnsMoreThanItGets) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : kAlphas) {
      for (const NamedMaterial& material : white_materials(distribution, alpha)) {
        for (const float z : kCosines) {
          V3f wo = direction_with_z(z);
          if (material.from_inside) wo.z = -wo.z;
          const Furnace furnace = light_returned(material.params, wo, 5000);
          SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha) + " cosine " + std::to_string(z));
          EXPECT_LE(max_component(furnace.power), 1 + kTableError + 4 * furnace.deviation.x);
          EXPECT_LE(furnace.largest_weight, 3.5f) << "a weight this large is a firefly";
        }
      }
    }
  }
}

TEST(BsdfEnergy, LambertReturnsItsAlbedo) {
  SurfaceParams params;
  params.base_color = {1, 0.5f, 0};
  const Furnace furnace = light_returned(params, direction_with_z(0.3f), 1000);
  EXPECT_FLOAT_EQ(furnace.power.x, 1);
  EXPECT_FLOAT_EQ(furnace.power.y, 0.5f);
  EXPECT_FLOAT_EQ(furnace.power.z, 0);
}

TEST(BsdfEnergy, SmoothGlassLosesNothingInAnySample) {
  for (const bool thin : {false, true}) {
    for (const float ior : {1.0f, 1.0005f, 1.01f, 1.5f, 2.4f}) {
      const SurfaceParams params = glass(MicrofacetDistribution::ggx, 0, ior, thin);
      for (const float z : kCosines) {
        for (const float side : {1.0f, -1.0f}) {
          if (thin && side < 0) continue;
          V3f wo = direction_with_z(z);
          wo.z *= side;
          Random random(29);
          for (int i = 0; i < 200; ++i) {
            const BsdfSample sample = sample_bsdf(params, wo, random.next_float(), random.next_v2f());
            ASSERT_TRUE(sample.valid() && sample.delta);
            const float power = sample.weight.x * (sample.transmitted ? sqr(sample.eta) : 1.0f);
            ASSERT_NEAR(power, 1, 1e-5) << ior << ' ' << wo.z;
          }
        }
      }
    }
  }
}

TEST(BsdfEnergy, WhitePlasticReturnsNearlyEverything) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : kAlphas) {
      for (const float z : {1.0f, 0.6f, 0.2f, 0.1f}) {
        const Furnace furnace = light_returned(metallic_roughness(distribution, alpha), direction_with_z(z), kSamples);
        EXPECT_NEAR(furnace.power.x, 1, 0.004 + 4 * furnace.deviation.x) << alpha << ' ' << z;
      }
    }
  }
}

// The loss of white rough metal is exactly the one that microfacet_albedo.h states.
TEST(BsdfEnergy, RoughMetalLosesWhatTheTableSays) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : {0.1f, 0.4f, 1.0f}) {
      SurfaceParams metal = metallic_roughness(distribution, alpha);
      metal.metallic = 1;
      for (const float z : {1.0f, 0.6f, 0.2f}) {
        const Furnace furnace = light_returned(metal, direction_with_z(z), kSamples);
        const AlbedoTerms terms = directional_albedo(distribution, alpha, z);
        EXPECT_NEAR(furnace.power.x, terms.a + terms.b, kTableError + 4 * furnace.deviation.x) << alpha << ' ' << z;
      }
    }
  }
}

TEST(BsdfEnergy, AlbedoFeatureIsCloseToTheLightReturned) {
  for (const auto distribution : kDistributions) {
    for (const float alpha : {0.0f, 0.1f, 0.5f}) {
      for (const NamedMaterial& material : materials_at(distribution, alpha)) {
        for (const float z : {1.0f, 0.5f, 0.2f}) {
          V3f wo = direction_with_z(z);
          if (material.from_inside) wo.z = -wo.z;
          SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha) + " cosine " + std::to_string(wo.z));
          const Rgb albedo = surface_albedo(material.params, wo);
          const Furnace furnace = light_returned(material.params, wo, kSamples);
          // Rough glass from inside: the critical angle of the facets is smeared, that of the estimate is not.
          const double tolerance = (alpha == 0 ? 0.01 : material.from_inside ? 0.25 : 0.15) + 4 * furnace.deviation.x;
          for (int c = 0; c < 3; ++c) EXPECT_NEAR(albedo[c], furnace.power[c], tolerance);
        }
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
