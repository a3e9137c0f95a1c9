// Anisotropic microfacets, plastic, pane, principled and blend: sampling, energy, reciprocity, extremes, and values
// worked out from the definitions.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/sampling/warp.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/bsdf_checks.h"
#include "tests/unit/trace/bsdf/mitsuba_cases.h"

namespace helio::test {
namespace {

constexpr float kCosines[] = {1, 0.6f, 0.2f, 0.05f, 1.75e-5f};

TEST(BsdfMitsuba, WeightIsValueOverDensity) {
  for (const float alpha : {0.05f, 0.3f, 0.5f}) {
    for (const NamedMaterial& material : mitsuba_materials(alpha, false)) {
      SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
      check_weights(material, 2e-3, 2e-3);
    }
  }
}

TEST(BsdfMitsuba, ReflectionIsReciprocal) {
  for (const float alpha : {0.1f, 0.3f, 0.5f}) {
    for (const NamedMaterial& material : mitsuba_materials(alpha, false)) {
      SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
      check_reflection_is_reciprocal(material, 1e-5, 1e-3);
    }
  }
}

TEST(BsdfMitsuba, RefractionIsReciprocalUpToTheSquaredIndex) {
  for (const NamedMaterial& material : mitsuba_materials(0.2f, false)) {
    if (material.params.thin || material.params.model == LobeModel::blend || material.from_inside) continue;
    SCOPED_TRACE(material.name);
    check_refraction_is_reciprocal(material.params, sqr(material.params.ior));
  }
}

bool is_empirical(const NamedMaterial& material) {
  return material.params.model == LobeModel::principled;
}

TEST(BsdfMitsuba, NoSurfaceButBurleysReturnsMoreThanItGets) {
  for (const float alpha : {0.002f, 0.1f, 0.4f}) {
    for (const NamedMaterial& material : mitsuba_materials(alpha, true)) {
      for (const float z : kCosines) {
        V3f wo = direction_with_z(z);
        if (material.from_inside) wo.z = -wo.z;
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha) + " cosine " + std::to_string(z));
        const Furnace furnace = light_returned(material.params, wo, 10'000);
        EXPECT_LE(furnace.largest_weight, 12) << "a weight this large is a firefly";
        if (is_empirical(material)) continue;
        EXPECT_LE(max_component(furnace.power), 1.005 + 4 * furnace.largest_deviation());
      }
    }
  }
}

// Smooth and white, plastic returns everything; the pane too.
TEST(BsdfMitsuba, SmoothWhitePlasticAndPaneLoseNothing) {
  for (const float ior : {1.1f, 1.49f, 1.9f, 3.0f}) {
    for (const bool nonlinear : {false, true}) {
      const SurfaceParams white = plastic(MicrofacetDistribution::ggx, 0, ior, Rgb(1, 1, 1), nonlinear);
      for (const float z : {1.0f, 0.5f, 0.1f}) {
        const Furnace furnace = light_returned(white, direction_with_z(z), 20'000);
        // Averaged over all directions it is 1; by direction F(z) + (1 - F(z)) x 1.
        EXPECT_NEAR(furnace.power.x, 1, 2e-3 + 4 * furnace.largest_deviation()) << ior << ' ' << z;
      }
    }
    for (const float z : {1.0f, 0.5f, 0.1f}) {
      const Furnace furnace = light_returned(pane(ior), direction_with_z(z), 1000);
      EXPECT_FLOAT_EQ(furnace.power.x, 1);
    }
  }
}

TEST(BsdfMitsuba, FeatureAlbedoIsCloseToTheLightReturned) {
  for (const NamedMaterial& material : mitsuba_materials(0.2f, false)) {
    for (const float z : {1.0f, 0.5f}) {
      V3f wo = direction_with_z(z);
      if (material.from_inside) wo.z = -wo.z;
      SCOPED_TRACE(material.name + " cosine " + std::to_string(wo.z));
      const Rgb albedo = surface_albedo(material.params, wo);
      const Furnace furnace = light_returned(material.params, wo, 20'000);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(albedo[c], furnace.power[c], 0.25 + 4 * furnace.largest_deviation());
    }
  }
}

// 1 - R_i = (1 - R_e) / n^2, with Walsh's closed form for R_e (Walsh 1926; in Egan and Hilgeman 1979, eq. 5.36).
TEST(Plastic, InternalReflectanceIsWalshs) {
  for (const double n : {1.1, 1.5, 2.5}) {
    const double n2 = n * n, n4 = n2 * n2;
    const double external = 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
                            n2 * (n2 - 1) * (n2 - 1) / std::pow(n2 + 1, 3) * std::log((n - 1) / (n + 1)) -
                            2 * n2 * n * (n2 + 2 * n - 1) / ((n2 + 1) * (n4 - 1)) +
                            8 * n4 * (n4 + 1) / ((n2 + 1) * (n4 - 1) * (n4 - 1)) * std::log(n);
    EXPECT_NEAR(diffuse_internal_reflectance(float(n)), 1 - (1 - external) / n2, 2e-5) << n;
  }
}

// The base's colour shifts: d / (1 - R d) for the nonlinear one against d / (1 - R).
TEST(Plastic, NonlinearBaseIsMoreSaturated) {
  const Rgb base(0.8f, 0.4f, 0.1f);
  const V3f wo = direction_at(30, 0), wi = direction_at(40, 200);
  const float r = diffuse_internal_reflectance(1.5f);
  const Rgb linear = evaluate_bsdf(plastic(MicrofacetDistribution::ggx, 0, 1.5f, base), wo, wi).f_cos;
  const Rgb shifted = evaluate_bsdf(plastic(MicrofacetDistribution::ggx, 0, 1.5f, base, true), wo, wi).f_cos;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(shifted[c] / linear[c], (1 - r) / (1 - r * base[c]), 1e-5);
}

// As rough plastic grows smooth it becomes smooth plastic: at 1e-3 the interface passes 1 - F.
TEST(Plastic, AlmostSmoothInterfacePassesWhatTheSmoothDoes) {
  const auto rough = make_plastic_interface(MicrofacetDistribution::ggx, kDeltaAlpha, 1.5f, false);
  const auto smooth = make_plastic_interface(MicrofacetDistribution::ggx, 0, 1.5f, false);
  ASSERT_TRUE(smooth->smooth && !rough->smooth);
  for (const float z : {1.0f, 0.7f, 0.3f}) EXPECT_NEAR(rough->transmitted(z), smooth->transmitted(z), 2e-3) << z;
  // The mean over nodes of a function that ends in F0 at 1: 1 / 63 of 2 x F0 less than the integral.
  EXPECT_NEAR(rough->internal_reflectance, smooth->internal_reflectance, 0.015);
}

// Both sides of a sheet of glass at normal incidence: R = 0.04, 2 R / (1 + R) = 1 / 13.
TEST(Pane, ReflectsTwice) {
  const BsdfSample up = sample_bsdf(pane(1.5f), V3f(0, 0, 1), 0, V2f(0.5f, 0.5f));
  EXPECT_TRUE(up.delta && !up.transmitted);
  EXPECT_NEAR(up.pdf_w, 1.0 / 13, 1e-6);
  const V3f wo = direction_at(50, 20);
  const BsdfSample through = sample_bsdf(pane(1.5f), wo, kOneMinusEpsilon, V2f(0.5f, 0.5f));
  EXPECT_TRUE(through.delta && through.transmitted);
  EXPECT_EQ(through.wi, -wo);
  EXPECT_EQ(through.eta, 1);
  EXPECT_TRUE(is_pure_delta(pane(1.5f)));
}

TEST(Pane, TintsWhatItReflectsAndWhatItPasses) {
  SurfaceParams params = pane(1.5f);
  params.specular_color = Rgb(0.2f, 0.4f, 0.6f);
  params.base_color = Rgb(0.9f, 0.8f, 0.7f);
  const V3f wo = direction_at(50, 20);
  EXPECT_EQ(sample_bsdf(params, wo, 0, V2f(0.5f, 0.5f)).weight, params.specular_color);
  EXPECT_EQ(sample_bsdf(params, wo, kOneMinusEpsilon, V2f(0.5f, 0.5f)).weight, params.base_color);
}

TEST(Pane, DeltaProbabilities) {
  for (const float ior : {0.7f, 1.0f, 1.5f, 2.4f}) {
    for (const double angle : {0.0, 55.0, 80.0, 89.9}) {
      SCOPED_TRACE(std::to_string(ior) + ", " + std::to_string(angle) + " degrees");
      check_delta_probabilities({"pane", pane(ior)}, angle, kChiSquareSamples, 23);
    }
  }
}

// Burley 2012, eq. 4, seen and lit along the normal: schlick terms 0, so f = base / pi (and the facets, taken away by
// an ior of 1).
TEST(Principled, DiffuseAlongTheNormalIsLamberts) {
  const SurfaceParams params = principled(0.25f, 1, Rgb(0.5f, 0.25f, 1), {});
  const Rgb f = evaluate_bsdf(params, V3f(0, 0, 1), V3f(0, 0, 1)).f_cos;
  EXPECT_NEAR(f.x, 0.5 / std::numbers::pi, 1e-6);
  EXPECT_NEAR(f.y, 0.25 / std::numbers::pi, 1e-6);
}

// At grazing retro-reflection of both: Fd90 = 2 roughness cos^2(0) ... f = base / pi (1/4 + r (2 + r - 1)) with r = 2 x
// roughness = 1 for alpha 0.25: 1/4 + 2.
TEST(Principled, GrazingRetroReflectionIsBurleys) {
  const SurfaceParams params = principled(0.25f, 1, Rgb(1, 1, 1), {});
  const float z = 1e-4f;
  const V3f w(std::sqrt(1 - z * z), 0, z);
  EXPECT_NEAR(evaluate_bsdf(params, w, w).f_cos.x / z, 2.25 / std::numbers::pi, 3e-3);
}

// Light that enters and leaves takes the root of the colour twice: what refracts in one channel is to that of another
// as the roots of their colours.
TEST(Principled, RefractionIsTintedByTheRoot) {
  SurfaceParams params = principled(0.2f, 1.5f, Rgb(0.81f, 0.36f, 0.04f), {});
  params.transmission = 1;
  params.thin = false;
  const V3f wo = direction_at(20, 0);
  const Rgb f = evaluate_bsdf(params, wo, -direction_at(10, 180)).f_cos;
  ASSERT_GT(f.x, 0);
  EXPECT_NEAR(f.y / f.x, 0.6 / 0.9, 1e-5);
  EXPECT_NEAR(f.z / f.x, 0.2 / 0.9, 1e-5);
}

// Metal: facets with Schlick's reflectance of the base colour; at the mirror direction of 60 degrees, where m is the
// normal and D = 1 / (pi alpha^2), F = c + (1 - c) / 32.
TEST(Principled, MetalIsGgxWithSchlick) {
  SurfaceParams params = principled(0.2f, 1.5f, Rgb(0.9f, 0.5f, 0.1f), {});
  params.metallic = 1;
  const V3f wo = direction_at(60, 0), wi = direction_at(60, 180);
  const double a2 = 0.04, g1 = 2 / (1 + std::sqrt(1 + a2 * 3));
  const Rgb f = evaluate_bsdf(params, wo, wi).f_cos;
  for (int c = 0; c < 3; ++c) {
    const double base = params.base_color[c], fresnel = base + (1 - base) / 32;
    EXPECT_NEAR(f[c], fresnel * g1 * g1 / (std::numbers::pi * a2) / (4 * 0.5), 1e-4);
  }
}

// The coat alone over a black base, along the normal: c / 4 x 0.04 x D, D = (a^2 - 1) / (pi log(a^2) a^2), a = 0.1.
TEST(Principled, CoatIsGtr1) {
  PrincipledMaterial own;
  own.clearcoat = 1;
  const SurfaceParams params = principled(1, 1, Rgb(0, 0, 0), own);
  const double a2 = 0.01, d = (a2 - 1) / (std::numbers::pi * std::log(a2) * a2);
  EXPECT_NEAR(evaluate_bsdf(params, V3f(0, 0, 1), V3f(0, 0, 1)).f_cos.x, 0.25 * 0.04 * d, 1e-5);
}

TEST(Blend, IsTheWeightedSumOfItsParts) {
  const SurfaceParams metal = mitsuba_conductor(MicrofacetDistribution::ggx, 0.3f), white = lambert_material().params;
  const SurfaceParams mixed = blend(white, metal, 0.3f);
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    const V3f wo = random_direction(random, 1), wi = random_direction(random, 1);
    const BsdfValue a = evaluate_bsdf(white, wo, wi), b = evaluate_bsdf(metal, wo, wi);
    const BsdfValue m = evaluate_bsdf(mixed, wo, wi);
    ASSERT_NEAR(m.pdf_w, 0.7f * a.pdf_w + 0.3f * b.pdf_w, 1e-5f * m.pdf_w);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(m.f_cos[c], 0.7f * a.f_cos[c] + 0.3f * b.f_cos[c], 1e-5f * m.pdf_w);
  }
}

TEST(Blend, EndsAreTheParts) {
  const SurfaceParams metal = mitsuba_conductor(MicrofacetDistribution::ggx, 0), white = lambert_material().params;
  EXPECT_FALSE(is_pure_delta(blend(white, metal, 0)));
  EXPECT_TRUE(is_pure_delta(blend(white, metal, 1)));
  EXPECT_FALSE(is_pure_delta(blend(white, metal, 0.5f)));
  for (const float u : {0.0f, 0.5f, kOneMinusEpsilon}) {
    EXPECT_FALSE(sample_bsdf(blend(white, metal, 0), V3f(0, 0, 1), u, V2f(0.5f, 0.2f)).delta);
    EXPECT_TRUE(sample_bsdf(blend(white, metal, 1), V3f(0, 0, 1), u, V2f(0.5f, 0.2f)).delta);
  }
}

// Conty Estevez et al. 2019: the shadowing is Smith's of alpha^2 = tan^2 / 8 of the angle between the normals, here 45
// degrees, for light 60 degrees off the unmapped normal: 2 / (1 + sqrt(1 + 3 / 8)). The light is 15 degrees off the
// mapped normal, whose cosine Lambert's law takes.
TEST(MappedNormal, TurnsTheFrameAndShadows) {
  SurfaceParams params = lambert_material().params;
  const V3f wo = direction_at(10, 0), wi = direction_at(60, 0);
  const float plain = evaluate_bsdf(params, wo, V3f(0, 0, 1)).f_cos.x;
  params.mapped = true;
  params.map_normal = direction_at(45, 0);
  const float mapped = evaluate_bsdf(params, wo, wi).f_cos.x;
  EXPECT_NEAR(mapped / plain, std::cos(15 * kPi / 180), 1e-5);
  params.map_alpha2 = 0.125f;
  EXPECT_NEAR(evaluate_bsdf(params, wo, wi).f_cos.x / mapped, 2 / (1 + std::sqrt(1.375)), 1e-5);
  const BsdfSample sample = sample_bsdf(params, wo, 0.5f, V2f(0.3f, 0.6f));
  const BsdfValue value = evaluate_bsdf(params, wo, sample.wi);
  EXPECT_NEAR(sample.weight.x, value.f_cos.x / value.pdf_w, 1e-5);
}

// Directions that one of the two normals has above and the other below get nothing, by evaluation and by sampling.
TEST(MappedNormal, SidesMustAgree) {
  SurfaceParams params = lambert_material().params;
  params.mapped = true;
  params.map_normal = direction_at(60, 0);
  const V3f wo = direction_at(10, 0);
  EXPECT_GT(evaluate_bsdf(params, wo, direction_at(80, 0)).f_cos.x, 0);
  EXPECT_EQ(evaluate_bsdf(params, wo, direction_at(100, 0)).f_cos.x, 0);   // above the mapped one alone
  EXPECT_EQ(evaluate_bsdf(params, wo, direction_at(40, 180)).f_cos.x, 0);  // above the unmapped one alone
  Random random(3);
  int lost = 0;
  for (int i = 0; i < 1000; ++i) {
    const BsdfSample sample = sample_bsdf(params, wo, 0.5f, random.next_v2f());
    lost += !sample.valid();
    EXPECT_TRUE(!sample.valid() || sample.wi.z > 0);
  }
  // Lambert's share beyond a plane tilted by 60 degrees: (1 - cos 60) / 2 = 1 / 4. Three deviations: 41.
  EXPECT_NEAR(lost, 250, 41);
}

// Equal roughness both ways is the isotropic distribution, whatever the direction.
TEST(AnisotropicMicrofacets, EqualWaysAreIsotropic) {
  Random random(9);
  for (const MicrofacetDistribution distribution : {MicrofacetDistribution::ggx, MicrofacetDistribution::beckmann}) {
    const SurfaceParams plain = mitsuba_conductor(distribution, 0.3f), turned = brushed(plain, 0.3f, 0.3f);
    for (int i = 0; i < 500; ++i) {
      const V3f wo = random_direction(random, 1), wi = random_direction(random, 1);
      const BsdfValue a = evaluate_bsdf(plain, wo, wi), b = evaluate_bsdf(turned, wo, wi);
      ASSERT_NEAR(a.pdf_w, b.pdf_w, 1e-3f * a.pdf_w + 1e-7f);
      ASSERT_NEAR(a.f_cos.x, b.f_cos.x, 1e-3f * a.f_cos.x + 1e-7f);
    }
  }
}

TEST(BsdfMitsuba, ExtremesAreFinite) {
  constexpr float kHeights[] = {1, 0.7f, 1e-2f, 1.7453e-5f, 1e-10f, 1e-30f, 1e-44f, 0.0f, -0.0f, -1e-30f, -0.5f, -1.0f};
  constexpr float kVariates[] = {0, 0x1p-24f, 0.5f, kOneMinusEpsilon};
  for (const float alpha : {1e-3f, 0.0099f, 0.5f, 1.0f}) {
    std::vector<NamedMaterial> materials = mitsuba_materials(alpha, false);
    for (const float extreme : {0.0f, 1e-40f, 1.0f}) {
      for (const Rgb& color : {Rgb(0, 0, 0), Rgb(1, 0, 1), Rgb(1, 1, 1)}) {
        PrincipledMaterial own;
        own.spec_tint = own.sheen = own.sheen_tint = own.flatness = own.clearcoat = own.clearcoat_gloss = extreme;
        SurfaceParams burley = principled(alpha, 1 + 0.001f * extreme, color, own);
        materials.push_back({"principled extreme", burley});
        burley.metallic = burley.transmission = extreme;
        burley.thin = false;
        materials.push_back({"principled extreme volume", burley});
        SurfaceParams coated = plastic(MicrofacetDistribution::ggx, alpha, 1.0001f + 50 * extreme, color, extreme > 0);
        coated.specular_color = Rgb(extreme);
        materials.push_back({"plastic extreme", coated});
        materials.push_back({"blend extreme", blend(burley, coated, extreme)});
        SurfaceParams sheet = pane(1 + 99 * extreme);
        sheet.base_color = color;
        materials.push_back({"pane extreme", sheet});
      }
    }
    for (const NamedMaterial& material : materials) {
      for (const float z : kHeights) {
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
        const V3f wo = direction_with_z(z);
        ASSERT_TRUE(is_sane(surface_albedo(material.params, wo)));
        ASSERT_LE(max_component(surface_albedo(material.params, wo)), 1 + 1e-6f);
        for (const float zi : kHeights) {
          for (const V3f& wi : {direction_with_z(zi), V3f(std::sqrt(1 - zi * zi), 0, zi)}) {
            const BsdfValue value = evaluate_bsdf(material.params, wo, wi);
            ASSERT_TRUE(is_sane(value.f_cos) && std::isfinite(value.pdf_w) && value.pdf_w >= 0) << wo << wi;
          }
        }
        for (const float u_lobe : {0.0f, 0.03f, 0.2f, 0.5f, 0.8f, kOneMinusEpsilon}) {
          for (const float x : kVariates) {
            for (const float y : kVariates) {
              ASSERT_NO_FATAL_FAILURE(check_sample_is_sane(sample_bsdf(material.params, wo, u_lobe, V2f(x, y)), wo))
                  << u_lobe << ' ' << x << ' ' << y;
            }
          }
        }
      }
    }
  }
}

// What a white furnace returns, printed; the principled model's own gain and loss with it.
TEST(BsdfMitsuba, LossesAreAsDocumented) {
  constexpr float kCosine[3] = {1, 0.5f, 0.1f};
  const std::map<std::string, std::array<float, 3>> documented = {
      {"brushed ggx conductor", {0.966f, 0.913f, 0.878f}},
      {"brushed beckmann conductor", {1.000f, 0.999f, 0.908f}},
      {"brushed glass", {1.000f, 0.993f, 0.947f}},
      {"brushed glass from inside", {1.000f, 0.965f, 0.924f}},
      {"smooth plastic", {1.000f, 1.000f, 1.000f}},
      {"rough ggx plastic", {0.796f, 0.785f, 0.752f}},
      {"rough beckmann plastic nonlinear", {0.893f, 0.891f, 0.872f}},
      {"principled dielectric", {1.041f, 1.076f, 1.177f}},
      {"principled everything", {0.900f, 1.029f, 1.164f}},
      {"principled volume", {0.947f, 0.962f, 0.973f}},
      {"principled volume from inside", {0.386f, 0.314f, 0.258f}},
      {"diffuse and metal", {0.982f, 0.963f, 0.952f}},
      {"plastic and mirror", {0.845f, 0.833f, 0.802f}},
      {"glass and diffuse", {1.000f, 0.995f, 0.962f}},
      {"glass and diffuse from inside", {0.700f, 0.675f, 0.645f}},
      {"blend in blend", {0.973f, 0.962f, 0.939f}}};
  std::printf("%-34s  mu = 1   mu = 0.5  mu = 0.1\n", "white furnace, alpha 0.2");
  for (const NamedMaterial& material : mitsuba_materials(0.2f, true)) {
    ASSERT_TRUE(documented.contains(material.name)) << material.name;
    std::printf("%-34s", material.name.c_str());
    for (int i = 0; i < 3; ++i) {
      V3f wo = direction_with_z(kCosine[i]);
      if (material.from_inside) wo.z = -wo.z;
      const Furnace furnace = light_returned(material.params, wo, 200'000);
      const float power = (furnace.power.x + furnace.power.y + furnace.power.z) / 3;
      std::printf("  %.3f  ", power);
      EXPECT_NEAR(power, documented.at(material.name)[std::size_t(i)], 0.01) << material.name << ' ' << kCosine[i];
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace helio::test
