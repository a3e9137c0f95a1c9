// Every input that a scene can produce gives finite, non-negative answers.
#include <gtest/gtest.h>

#include "renderer/trace/bsdf/bsdf.h"
#include "tests/unit/trace/bsdf/bsdf_checks.h"

namespace helio::test {
namespace {

constexpr float kHeights[] = {1,       0x1.fffffep-1f, 0.7f,   1e-2f, 1.7453e-5f /* 89.999 degrees */,
                              1e-10f,  1e-30f,         1e-44f, 0.0f,  -0.0f,
                              -1e-30f, -1e-5f,         -0.5f,  -1.0f};
constexpr float kAlphas[] = {0, 1e-4f, 1e-3f, 0.0099f, 0.01f, 0.5f, 1};
constexpr float kVariates[] = {0, 0x1p-24f, 0.5f, kOneMinusEpsilon};

void expect_sane(const SurfaceParams& params, const V3f& wo) {
  ASSERT_TRUE(is_sane(surface_albedo(params, wo)) && max_component(surface_albedo(params, wo)) <= 1);
  for (const float z : kHeights) {
    // Along, against and across wo.
    for (const V3f& wi : {direction_with_z(z), -direction_with_z(-z), V3f(std::sqrt(1 - z * z), 0, z)}) {
      const BsdfValue value = evaluate_bsdf(params, wo, wi);
      ASSERT_TRUE(is_sane(value.f_cos) && std::isfinite(value.pdf_w) && value.pdf_w >= 0) << wo << wi;
      ASSERT_TRUE(value.pdf_w > 0 || max_component(value.f_cos) < 1e-6f) << wo << wi;
    }
  }
  for (const float u_lobe : kVariates) {
    for (const float x : kVariates) {
      for (const float y : kVariates) {
        const BsdfSample sample = sample_bsdf(params, wo, u_lobe, V2f(x, y));
        ASSERT_NO_FATAL_FAILURE(check_sample_is_sane(sample, wo)) << u_lobe << ' ' << x << ' ' << y;
        if (!sample.valid()) continue;
        ASSERT_NE(sample.wi.z, 0);
        ASSERT_TRUE(std::isfinite(sample.eta) && sample.eta > 0);
      }
    }
  }
}

class BsdfExtreme : public testing::TestWithParam<MicrofacetDistribution> {};

TEST_P(BsdfExtreme, AllDirectionsAndVariates) {
  for (const float alpha : kAlphas) {
    std::vector<NamedMaterial> materials = materials_at(GetParam(), alpha);
    materials.push_back(lambert_material());
    for (const NamedMaterial& material : materials) {
      for (const float z : kHeights) {
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
        expect_sane(material.params, direction_with_z(z));
        if (HasFatalFailure()) return;
      }
    }
  }
}

// Colours of vertices are not bounded by 1: what facets of such a metal send to one another has no sum.
TEST_P(BsdfExtreme, MetalBrighterThanWhite) {
  for (const float alpha : kAlphas) {
    SurfaceParams metal = metallic_roughness(GetParam(), alpha);
    metal.metallic = 1;
    metal.base_color = {1, 1.5f, 3};
    for (const float z : kHeights) {
      SCOPED_TRACE(alpha);
      expect_sane(metal, direction_with_z(z));
      if (HasFatalFailure()) return;
    }
  }
}

TEST_P(BsdfExtreme, AllIndicesAndColours) {
  for (const float alpha : {0.0f, 1e-3f, 1.0f}) {
    for (const float ior : {0.0f, 1.0f, 1.0001f, 1.0009f, 1.0011f, 1.5f, 100.0f}) {
      for (const float share : {0.0f, 0.5f, 1.0f}) {
        for (const float specular : {0.0f, 1.0f}) {
          for (const Rgb& color : {Rgb(0, 0, 0), Rgb(1, 0, 0), Rgb(1, 1, 1)}) {
            for (const bool thin : {false, true}) {
              SurfaceParams params = glass(GetParam(), alpha, ior, thin);
              params.transmission = share;
              params.specular = specular;
              params.specular_color = color;
              params.base_color = Rgb(1, 1, 1) - color;
              SCOPED_TRACE("alpha " + std::to_string(alpha) + " ior " + std::to_string(ior));
              for (const float z : {1.0f, 0.5f, 1e-5f, 0.0f, -1e-5f, -0.5f}) {
                expect_sane(params, direction_with_z(z));
                if (HasFatalFailure()) return;
              }
            }
          }
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, BsdfExtreme, testing::Values(MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann),
                         [](const auto& info) { return name_of(info.param); });

TEST(BsdfExtremeView, HorizontalViewSeesNothing) {
  for (const float z : {0.0f, -0.0f}) {
    for (const NamedMaterial& material : materials_at(MicrofacetDistribution::ggx, 0.3f)) {
      EXPECT_FALSE(sample_bsdf(material.params, V3f(1, 0, z), 0.5f, V2f(0.5f, 0.5f)).valid()) << material.name;
      EXPECT_EQ(evaluate_bsdf(material.params, V3f(1, 0, z), V3f(0, 0, 1)).pdf_w, 0) << material.name;
    }
  }
}

}  // namespace
}  // namespace helio::test
