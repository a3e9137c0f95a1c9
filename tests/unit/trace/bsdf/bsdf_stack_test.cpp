// Clearcoat, sheen, anisotropy, iridescence and diffuse transmission: sampling, energy, reciprocity, extremes.
#include "renderer/trace/bsdf/bsdf_stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <map>
#include <thread>

#include "renderer/trace/bsdf/bsdf_sheen.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/trace/bsdf/thin_film.h"
#include "renderer/trace/bsdf/thin_film_base.h"
#include "renderer/trace/sampling/warp.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/bsdf_checks.h"
#include "tests/unit/trace/bsdf/layer_cases.h"

namespace helio::test {
namespace {

// At most 1.003 of the light comes back. The nearer to that an estimate is, the finer the next: the third errs by less
// than 0.0005. Returns the largest weight of the first.
float expect_no_gain(const SurfaceParams& params, const V3f& wo) {
  Furnace furnace = light_returned_evenly(params, wo, 4096);
  const float largest_weight = furnace.largest_weight;
  if (max_component(furnace.power) > 0.997f) furnace = light_returned_evenly(params, wo, 32'768);
  if (max_component(furnace.power) > 1.0005f) furnace = light_returned_evenly(params, wo, 131'072);
  EXPECT_LE(max_component(furnace.power), 1.003f);
  return largest_weight;
}

TEST(BsdfStack, WeightIsValueOverDensity) {
  for (const float alpha : {0.05f, 0.3f, 1.0f}) {
    for (const NamedMaterial& material : layered_materials(alpha, false)) {
      SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
      check_weights(material, 2e-3, 2e-3);
    }
  }
}

// f(wo, wi) = f(wi, wo) for reflection, and through thin surfaces. A coat with another normal than its base is left
// out: its cosines are those of its own normal, as with every shading normal (Veach 1997, 5.3).
TEST(BsdfStack, IsReciprocal) {
  for (const float alpha : {0.1f, 0.3f, 1.0f}) {
    for (const NamedMaterial& material : layered_materials(alpha, false)) {
      if (material.name == "coat with its own normal") continue;
      SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
      check_reflection_is_reciprocal(material, 1e-5, 1e-3);
      if (!material.params.thin) continue;
      Random random(37);
      for (int i = 0; i < 1000; ++i) {
        const V3f a = random_direction(random, 1), b = random_direction(random, 1);
        const V3f b_below(b.x, b.y, -b.z), a_below(a.x, a.y, -a.z);
        const Rgb through = evaluate_bsdf(material.params, a, b_below).f_cos / std::fabs(b.z);
        const Rgb back = evaluate_bsdf(material.params, b, a_below).f_cos / std::fabs(a.z);
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(through[c], back[c], 1e-3 * through[c] + 1e-5);
      }
    }
  }
}

TEST(BsdfStack, RefractionIsReciprocalUpToTheSquaredIndex) {
  for (const float alpha : {0.1f, 0.5f}) {
    SurfaceParams clear = glass(MicrofacetDistribution::ggx, alpha, 1.5f, false);
    LayerParams layers;
    layers.clearcoat = 0.8f;
    layers.clearcoat_alpha = 0.1f;
    layers.sheen_color = {0.3f, 0.2f, 0.1f};
    layers.sheen_alpha = 0.2f;
    layers.anisotropy = 0.6f;
    layers.iridescence = 1;
    layers.film_thickness = 350;
    const SurfaceParams params = with_layers(clear, layers);
    check_refraction_is_reciprocal(params, 2.25f);
  }
}

// Roughnesses below 0.01 and angles near to the horizon are where tables of albedos err most.
TEST(BsdfStack, NoSurfaceReturnsMoreThanItGets) {
  for (const float alpha : {0.0f, 0.002f, 0.005f, 0.02f, 0.1f, 1.0f}) {
    for (const NamedMaterial& material : layered_materials(alpha, true)) {
      for (const double angle : {0.0, 84.0, 88.0, 89.5, 89.999}) {
        V3f wo = direction_at(angle, 25);
        if (material.from_inside) wo.z = -wo.z;
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha) + " angle " + std::to_string(angle));
        EXPECT_LE(expect_no_gain(material.params, wo), 12) << "a weight this large is a firefly";
      }
    }
  }
}

// One facet's light by strata of visible normals, that of further facets by the film's mean reflectance.
TEST(BsdfStack, FilmOnMetalTintsTheLightOfFurtherFacets) {
  constexpr float kAlpha = 1;
  constexpr int kStrata = 256;
  SurfaceParams metal = metallic_roughness(MicrofacetDistribution::ggx, kAlpha);
  metal.metallic = 1;
  metal.base_color = {0, 0.3f, 0.8f};
  LayerParams layers;
  layers.iridescence = 1;
  layers.film_ior = 2.2f;
  layers.film_thickness = 300;
  ThinFilm film;
  film.cover = film.metal = 1;
  film.ior = layers.film_ior;
  film.thickness = layers.film_thickness;
  film.metal_f0 = metal.base_color;
  const Microfacet facets{MicrofacetDistribution::ggx, kAlpha};
  const double lost = double(mean_albedo(MicrofacetDistribution::ggx, kAlpha).loss);
  for (const float z : {1.0f, 0.5f}) {
    const V3f wo = direction_with_z(z);
    V3d first(0, 0, 0);
    for (int i = 0; i < kStrata * kStrata; ++i) {
      const V2f u((float(i % kStrata) + 0.5f) / kStrata, (float(i / kStrata) + 0.5f) / kStrata);
      const V3f m = facets.sample_visible_normal(wo, u);
      const float c = std::max(0.0f, dot(wo, m));
      first += V3d(film.over_opaque(Rgb(0, 0, 0), c) * facets.masking(m * (2 * c) - wo)) / (kStrata * kStrata);
    }
    const Rgb power = light_returned_evenly(with_layers(metal, layers), wo, 1 << 16).power;
    const double loss = double(directional_albedo(MicrofacetDistribution::ggx, kAlpha, z).loss);
    for (int k = 0; k < 3; ++k) {
      const double f = double(film.mean_over_metal()[k]), further = loss * f * f * (1 - lost) / (1 - f * lost);
      EXPECT_NEAR(double(power[k]), first[k] + further, 0.004) << z << ' ' << k;
    }
  }
}

TEST(BsdfStack, BlackMetalUnderAFilmHasNoFireflies) {
  for (const float alpha : {0.05f, 0.2f, 0.5f, 1.0f}) {
    for (const float ior : {1.3f, 1.8f, 2.4f}) {
      SurfaceParams metal = metallic_roughness(MicrofacetDistribution::ggx, alpha);
      metal.metallic = 1;
      metal.base_color = {0, 0, 0};
      LayerParams film;
      film.iridescence = 1;
      film.film_ior = ior;
      film.film_thickness = 400;
      for (const double angle : {0.0, 60.0, 85.0}) {
        EXPECT_LE(expect_no_gain(with_layers(metal, film), direction_at(angle, 25)), 12) << alpha << ' ' << ior;
      }
    }
  }
}

// Against 2,000 points in the cosine itself.
TEST(ThinFilm, MeanOverMetalIsTheIntegral) {
  ThinFilm film;
  film.metal = 1;
  for (const float ior : {1.2f, 1.3f, 1.8f, 2.4f}) {
    for (const float thickness : {100.0f, 400.0f, 825.0f, 1000.0f}) {
      for (const Rgb& f0 : {Rgb(0, 0.3f, 0.9f), Rgb(0.6f, 0.1f, 1)}) {
        for (const float cover : {0.4f, 1.0f}) {
          film.ior = ior;
          film.thickness = thickness;
          film.metal_f0 = f0;
          film.cover = cover;
          constexpr int kPoints = 2000;
          V3d expected(0, 0, 0);
          for (int i = 0; i < kPoints; ++i) {
            const float c = (float(i) + 0.5f) / kPoints;
            const Rgb bare = f0 + (Rgb(1) - f0) * schlick_term(c);
            expected += V3d(film.over_opaque(bare, c)) * (2.0 * double(c) / kPoints);
          }
          const Rgb mean = film.mean_over_metal();
          for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(double(mean[k]), expected[k], 0.01) << ior << ' ' << thickness << ' ' << f0 << ' ' << cover;
          }
        }
      }
    }
  }
}

// Films that differ in one number each, in an order in which some come again at once, some late and some never did.
TEST(ThinFilm, WhatAThreadRemembersIsWhatAnotherWorksOut) {
  struct Asked {
    ThinFilm film;
    float bare_f0 = 0.04f, f90 = 0.9f, alpha = 0.3f;
    MicrofacetDistribution distribution = MicrofacetDistribution::ggx;
  };
  Asked plain;
  plain.film.cover = 0.7f;
  plain.film.thickness = 400;
  plain.film.metal_f0 = {0.9f, 0.5f, 0.2f};
  plain.film.dielectric_f0 = {0.04f, 0.05f, 0.06f};
  std::vector<Asked> all;
  for (int step = 0; step < 40; ++step) {
    for (int number = 0; number < 13; ++number) {
      Asked asked = plain;
      float* const numbers[] = {&asked.film.cover,
                                &asked.film.ior,
                                &asked.film.thickness,
                                &asked.film.metal_f0.x,
                                &asked.film.metal_f0.y,
                                &asked.film.metal_f0.z,
                                &asked.film.dielectric_f0.x,
                                &asked.film.dielectric_f0.y,
                                &asked.film.dielectric_f0.z,
                                &asked.bare_f0,
                                &asked.f90,
                                &asked.alpha};
      if (number < 12)
        *numbers[number] *= 1 + 0.002f * float(step);
      else
        asked.distribution = step % 2 ? MicrofacetDistribution::beckmann : MicrofacetDistribution::ggx;
      all.push_back(asked);
    }
  }
  const auto answer = [](const Asked& asked) {
    const FilmedBase base = FilmedBase::recent(asked.film, asked.bare_f0, asked.f90, asked.distribution, asked.alpha);
    return std::array<Rgb, 3>{base.entering(0.6f), base.leaving(0.3f), asked.film.mean_over_metal()};
  };
  Random random(91);
  for (int i = 0; i < 2000; ++i) {
    const Asked& asked =
        all[std::min(all.size() - 1, std::size_t(random.next_float() * float(i % 3 ? 40 : all.size())))];
    const std::array<Rgb, 3> here = answer(asked);
    std::array<Rgb, 3> elsewhere;
    std::thread([&] { elsewhere = answer(asked); }).join();
    const FilmedBase made(asked.film, asked.bare_f0, asked.f90, asked.distribution, asked.alpha);
    ASSERT_EQ(here, elsewhere) << i;
    ASSERT_EQ(here[0], made.entering(0.6f)) << i;
    ASSERT_EQ(here[1], made.leaving(0.3f)) << i;
  }
}

// Brushed metal, whose albedo is not tabled.
TEST(BsdfStack, BrushedMetalReturnsNoMoreInAnyAzimuth) {
  for (const float alpha : {0.02f, 0.1f, 0.3f, 0.6f}) {
    for (const float strength : {0.3f, 0.7f, 1.0f}) {
      SurfaceParams metal = metallic_roughness(MicrofacetDistribution::ggx, alpha);
      metal.metallic = 1;
      LayerParams brushed;
      brushed.anisotropy = strength;
      brushed.anisotropy_direction = V2f(1, 0);
      for (const double angle : {0.0, 60.0, 80.0, 88.0}) {
        for (const double azimuth : {0.0, 30.0, 60.0, 90.0}) {
          SCOPED_TRACE(std::to_string(alpha) + ' ' + std::to_string(strength) + ' ' + std::to_string(angle) + ' ' +
                       std::to_string(azimuth));
          EXPECT_LE(light_returned_evenly(with_layers(metal, brushed), direction_at(angle, azimuth), 131'072).power.x,
                    1.004f);
        }
      }
    }
  }
}

// Every layer at random, films of all thicknesses.
TEST(BsdfStack, NoMixtureOfLayersReturnsMoreThanItGets) {
  Random random(97);
  const auto from = [&](float low, float high) { return low + (high - low) * random.next_float(); };
  const auto decades = [&](float count) { return std::pow(10.0f, -count * random.next_float()); };
  const auto maybe = [&](float value) { return random.next_float() < 0.4f ? value : 0.0f; };
  for (int i = 0; i < 60; ++i) {
    const bool beckmann = random.next_float() < 0.3f;
    SurfaceParams base = metallic_roughness(beckmann ? MicrofacetDistribution::beckmann : MicrofacetDistribution::ggx,
                                            maybe(decades(3)));
    base.ior = from(1, 2.5f);
    base.specular = 1 - maybe(random.next_float());
    base.metallic = maybe(random.next_float());
    base.transmission = maybe(random.next_float());
    base.thin = random.next_float() < 0.5f;
    LayerParams layers;
    layers.clearcoat = maybe(from(0.5f, 1));
    layers.clearcoat_alpha = maybe(decades(3));
    layers.sheen_color = Rgb(1, 0.6f, 0.3f) * maybe(1);
    layers.sheen_alpha = decades(2);
    layers.anisotropy = maybe(random.next_float());
    layers.iridescence = maybe(from(0.5f, 1));
    layers.film_ior = from(1, 2.5f);
    layers.film_thickness = i % 5 == 0 ? 1e6f * decades(6) : from(0, 1200);
    layers.diffuse_transmission = maybe(random.next_float());
    // Diffuse and refracted light in one direction: a sample of both has no single factor to make power of radiance.
    if (!base.thin && base.transmission > 0) layers.diffuse_transmission = 0;
    const SurfaceParams params = with_layers(base, layers);
    for (const double angle : {30.0, 80.0, 88.0}) {
      for (const float side : {1.0f, -1.0f}) {
        if (base.thin && side < 0) continue;
        V3f wo = direction_at(angle, 25);
        wo.z *= side;
        SCOPED_TRACE("mixture " + std::to_string(i) + " angle " + std::to_string(angle) + " side " +
                     std::to_string(side));
        expect_no_gain(params, wo);
      }
    }
  }
}

TEST(BsdfStack, FeatureAlbedoIsCloseToTheLightReturned) {
  for (const NamedMaterial& material : layered_materials(0.2f, false)) {
    if (material.name.find("film") != std::string::npos || material.name.find("everything") == 0) continue;
    for (const float z : {1.0f, 0.5f, 0.2f}) {
      V3f wo = direction_with_z(z);
      if (material.from_inside) wo.z = -wo.z;
      SCOPED_TRACE(material.name + " cosine " + std::to_string(wo.z));
      const Rgb albedo = surface_albedo(material.params, wo);
      const Furnace furnace = light_returned(material.params, wo, 20'000);
      const double tolerance = (material.from_inside ? 0.25 : 0.2) + 4 * furnace.largest_deviation();
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(albedo[c], furnace.power[c], tolerance);
    }
  }
}

// What a white furnace gives back over a white base, printed: the table of scenes/README.md.
TEST(BsdfStack, LossesAreAsDocumented) {
  constexpr float kCosine[3] = {1, 0.5f, 0.1f};
  const std::map<std::string, std::array<float, 3>> documented = {
      {"smooth coat", {0.959f, 0.964f, 0.997f}},
      {"rough coat", {0.970f, 0.978f, 0.999f}},
      {"rough coat on beckmann", {0.971f, 0.978f, 0.999f}},
      {"coat with its own normal", {0.989f, 0.901f, 0.916f}},
      {"sheen 0.5", {0.868f, 0.964f, 0.998f}},
      {"sheen 0.25", {0.915f, 0.946f, 0.990f}},
      {"sheen 1", {0.904f, 0.981f, 0.999f}},
      {"brushed metal", {0.838f, 0.879f, 0.928f}},
      {"brushed plastic", {0.996f, 0.990f, 0.951f}},
      {"brushed glass", {0.974f, 0.869f, 0.661f}},
      {"brushed glass from inside", {0.805f, 0.683f, 0.537f}},
      {"leaf", {1.000f, 1.000f, 0.999f}},
      {"wax", {1.000f, 1.000f, 0.999f}},
      {"wax from inside", {1.000f, 1.000f, 0.999f}},
      {"film on plastic", {0.998f, 0.997f, 0.997f}},
      {"film on metal", {1.000f, 1.000f, 0.999f}},
      {"film on glass", {0.983f, 0.953f, 0.856f}},
      {"film on glass from inside", {0.941f, 0.870f, 0.799f}},
      {"everything, thin", {0.833f, 0.889f, 0.982f}},
      {"everything, volume", {0.943f, 0.957f, 0.992f}},
      {"everything, volume from inside", {0.902f, 0.874f, 0.886f}}};
  std::printf("%-34s  mu = 1   mu = 0.5  mu = 0.1\n", "white furnace, base alpha 0.2");
  for (const NamedMaterial& material : layered_materials(0.2f, true)) {
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

TEST(BsdfStack, ExtremesAreFinite) {
  constexpr float kHeights[] = {1, 0.7f, 1e-2f, 1.7453e-5f, 1e-10f, 1e-30f, 1e-44f, 0.0f, -0.0f, -1e-30f, -0.5f, -1.0f};
  constexpr float kVariates[] = {0, 0x1p-24f, 0.5f, kOneMinusEpsilon};
  for (const float alpha : {0.0f, 1e-4f, 1e-3f, 0.0099f, 0.5f, 1.0f}) {
    std::vector<NamedMaterial> materials = layered_materials(alpha, false);
    for (const Rgb& color : {Rgb(0, 0, 0), Rgb(1, 1, 1)}) {
      for (const float extreme : {0.0f, 1e-40f, 1.0f}) {
        LayerParams layers;
        layers.clearcoat = layers.anisotropy = layers.iridescence = layers.diffuse_transmission = extreme;
        layers.clearcoat_alpha = layers.sheen_alpha = 1 - extreme;
        layers.sheen_color = layers.diffuse_transmission_color = color;
        layers.film_ior = 1 + 99 * extreme;
        layers.film_thickness = extreme * 1e6f;
        SurfaceParams base = metallic_roughness(MicrofacetDistribution::ggx, alpha);
        base.base_color = color;
        materials.push_back({"extreme", with_layers(base, layers)});
      }
    }
    for (const NamedMaterial& material : materials) {
      for (const float z : kHeights) {
        SCOPED_TRACE(material.name + " alpha " + std::to_string(alpha));
        const V3f wo = direction_with_z(z);
        ASSERT_TRUE(is_sane(surface_albedo(material.params, wo)));
        ASSERT_LE(max_component(surface_albedo(material.params, wo)), 1);
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

TEST(BsdfStack, PureDeltaMeansThatEvaluationIsZero) {
  Random random(53);
  for (const float alpha : {0.0f, 0.3f}) {
    for (const NamedMaterial& material : layered_materials(alpha, false)) {
      if (material.from_inside || material.params.transmission == 0) continue;
      bool always_zero = true;
      for (int i = 0; i < 400; ++i) {
        const V3f wo = random_direction(random, 1), wi = random_direction(random, i % 2 ? 1.0f : -1.0f);
        const BsdfSample sample = sample_bsdf(material.params, wo, random.next_float(), random.next_v2f());
        if (sample.valid() && !sample.delta) always_zero = false;
        if (evaluate_bsdf(material.params, wo, wi).pdf_w > 0) always_zero = false;
      }
      EXPECT_EQ(is_pure_delta(material.params), always_zero) << material.name << ' ' << alpha;
    }
  }
}

// No layer at all is the plain model.
TEST(BsdfStack, WithoutLayersItIsTheBase) {
  Random random(71);
  for (const NamedMaterial& base : materials_at(MicrofacetDistribution::ggx, 0.3f)) {
    if (base.params.model != LobeModel::metallic_roughness) continue;
    const SurfaceParams stack = with_layers(base.params, LayerParams{});
    for (int i = 0; i < 500; ++i) {
      const V3f wo = random_direction(random, base.from_inside ? -1.0f : 1.0f);
      const V3f wi = random_direction(random, i % 2 ? 1.0f : -1.0f);
      const BsdfValue a = evaluate_bsdf(base.params, wo, wi), b = evaluate_bsdf(stack, wo, wi);
      ASSERT_EQ(a.f_cos, b.f_cos) << base.name;
      ASSERT_EQ(a.pdf_w, b.pdf_w) << base.name;
    }
  }
}

// The coat's value by the formula of its extension, computed from the definitions: c D F G1 G1 / (4 cos cos), F = 0.04
// + 0.96 (1 - cos)^5, here in the mirror direction of 60 degrees, where m is the normal: D = 1 / (pi alpha^2).
TEST(BsdfStack, CoatOverBlackIsItsFormula) {
  SurfaceParams black = metallic_roughness(MicrofacetDistribution::ggx, 1);
  black.base_color = {0, 0, 0};
  black.specular = 0;
  LayerParams coat;
  coat.clearcoat = 0.5f;
  coat.clearcoat_alpha = 0.2f;
  const V3f wo = direction_at(60, 0), wi = direction_at(60, 180);
  const double a2 = 0.04, cosine = 0.5, tan2 = 3;
  const double g1 = 2 / (1 + std::sqrt(1 + a2 * tan2));
  const double fresnel = 0.04 + 0.96 * std::pow(0.5, 5);
  const double f = 0.5 * fresnel * g1 * g1 / (std::numbers::pi * a2) / (4 * cosine * cosine);
  EXPECT_NEAR(evaluate_bsdf(with_layers(black, coat), wo, wi).f_cos.x, f * cosine, 1e-4 * f);
}

TEST(Sheen, TableIsAtLeastTheAlbedoAndCloseToIt) {
  for (const float alpha : {0.01f, 0.04f, 0.1f, 0.3f, 1.0f}) {
    for (const float mu : {0.02f, 0.1f, 0.4f, 0.8f, 1.0f}) {
      const V3f wo(std::sqrt(1 - mu * mu), 0, mu);
      const auto lobe = [&](const V3f& wi) {
        return wi.z > 0 ? evaluate_sheen(alpha, wo, wi, sheen_albedo(alpha, mu), sheen_albedo(alpha, wi.z)) : 0.0f;
      };
      const double albedo = integrate_sphere(SphereMap(V3f(0, 0, 1), 1), lobe, 1e-6);
      const double table = sheen_albedo(alpha, mu);
      EXPECT_LE(albedo, 1.01 * std::min(1.0, table) + 2e-3) << alpha << ' ' << mu;
      // Where E stays below 1 for all directions the lobe is D V itself: E is its albedo.
      if (sheen_albedo(alpha, 0) >= 1) continue;
      EXPECT_NEAR(albedo, table, 0.01 * table + 2e-3) << alpha << ' ' << mu;
    }
  }
}

// alpha = 1, mu = 1: D V = (3 / 2 pi) sin(m) / 4, m at half the angle of wi:
// E = 2 pi int 3 / (8 pi) sqrt((1 - z) / 2) z dz = 3 / (4 sqrt 2) int sqrt(1 - z) z dz = 3 / (4 sqrt 2) (2/3 - 2/5).
TEST(Sheen, KnownInClosedForm) {
  EXPECT_NEAR(sheen_albedo(1, 1), 0.2 / std::sqrt(2.0), 5e-4);
}

// Thick films do not interfere: R = r12 + t^2 r23 / (1 - r12 r23), the sum over all bounces.
TEST(ThinFilm, ThickFilmsAddIntensities) {
  for (const float cosine : {1.0f, 0.5f}) {
    for (const float f0 : {0.02f, 0.3f, 0.9f}) {
      const double ior = 1.4, c2 = std::sqrt(1 - (1 - double(cosine) * cosine) / (ior * ior));
      const auto schlick = [](double r0, double c) { return r0 + (1 - r0) * std::pow(1 - c, 5); };
      const double base = (1 + std::sqrt(f0)) / (1 - std::sqrt(f0)) / ior;
      const double r12 = schlick(std::pow((ior - 1) / (ior + 1), 2), cosine);
      const double r23 = schlick(std::pow((base - 1) / (base + 1), 2), c2);
      const double expected = r12 + (1 - r12) * (1 - r12) * r23 / (1 - r12 * r23);
      const Rgb film = thin_film_reflectance(cosine, 1.4f, 1e6f, Rgb(f0, f0, f0));
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(film[c], expected, 1e-4) << cosine << ' ' << f0;
    }
  }
}

// Air to film to a denser base: both reflections turn the phase by half a wave. At a quarter wave (550 nm / 4 / 1.38 =
// 100 nm, the coating of lenses) they cancel in green; ior 1.38 on f0 0.043 (ior 1.52) leaves about 1.3 %, bare 4.3 %.
TEST(ThinFilm, QuarterWaveCoatingOfLensesReducesReflection) {
  const Rgb coated = thin_film_reflectance(1, 1.38f, 100, Rgb(0.0426f, 0.0426f, 0.0426f));
  EXPECT_GT(coated.y, 0.005f);
  EXPECT_LT(coated.y, 0.022f);
  const Rgb half_wave = thin_film_reflectance(1, 1.38f, 200, Rgb(0.0426f, 0.0426f, 0.0426f));
  EXPECT_GT(half_wave.y, 0.03f);
}

// The path through the film and back is 2 n d cos(angle inside): the thickness that cancels green grows with the slant
// by one over that cosine. What the interfaces reflect changes with the angle but not with the thickness.
TEST(ThinFilm, SlantedLightNeedsAThickerFilm) {
  constexpr float kIor = 1.38f;
  const auto darkest = [](float cos_i) {
    float best = 0, least = 1;
    for (float thickness = 60; thickness < 160; thickness += 0.25f) {
      const float green = thin_film_reflectance(cos_i, kIor, thickness, Rgb(0.0426f, 0.0426f, 0.0426f)).y;
      if (green < least) {
        least = green;
        best = thickness;
      }
    }
    return best;
  };
  const float upright = darkest(1);
  EXPECT_NEAR(upright, 100, 5);
  for (const float cos_i : {0.8f, 0.5f}) {
    const float inside = std::sqrt(1 - (1 - cos_i * cos_i) / (kIor * kIor));
    EXPECT_NEAR(darkest(cos_i) * inside, upright, 1) << cos_i;
  }
}

}  // namespace
}  // namespace helio::test
