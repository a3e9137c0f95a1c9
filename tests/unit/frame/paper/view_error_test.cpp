// Eq. 15 of Schalk 2018, and what the paper takes for specular.
#include "renderer/frame/paper/view_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "renderer/trace/bsdf/bsdf_blend.h"

namespace helio {
namespace {

V3f towards(float degrees) {
  const float a = degrees * float(std::numbers::pi) / 180;
  return {std::sin(a), 0, std::cos(a)};
}

// A conductor that reflects everything: eta = 0 makes Fresnel's term 1 for every k.
SurfaceParams mirror_like(float alpha) {
  SurfaceParams params;
  params.model = LobeModel::conductor;
  params.distribution = MicrofacetDistribution::beckmann;
  params.alpha = params.alpha_along = params.alpha_across = alpha;
  params.eta = Rgb(0, 0, 0);
  params.k = Rgb(1, 1, 1);
  return params;
}

// Eq. 13 with F = 1: D and G of Walter et al. 2007, eq. 25 and 26 (Beckmann), G1 by the error function.
double eq13(const V3f& i, const V3f& o, double alpha) {
  const V3f h = (i + o).normalized();
  const double cos_h = h.z, tan2 = (1 - cos_h * cos_h) / (cos_h * cos_h);
  const double d = std::exp(-tan2 / (alpha * alpha)) / (std::numbers::pi * alpha * alpha * std::pow(cos_h, 4));
  const auto g1 = [&](const V3f& w) {
    const double tan_w = std::sqrt(1 - double(w.z) * w.z) / w.z;
    if (tan_w == 0) return 1.0;
    const double a = 1 / (alpha * tan_w);
    return 2 / (1 + std::erf(a) + std::exp(-a * a) / (a * std::sqrt(std::numbers::pi)));
  };
  return g1(i) * g1(o) * d / (4 * double(i.z) * double(o.z));
}

TEST(ViewError, IsEquation15) {
  for (const double alpha : {0.1, 0.4}) {
    const SurfaceParams params = mirror_like(float(alpha));
    const V3f now = towards(20), before = towards(28), light = towards(-25);
    const double expected = std::abs(eq13(light, now, alpha) - eq13(light, before, alpha)) * 3;
    EXPECT_NEAR(view_error(params, now, before, light, Rgb(1, 3, 2)), expected, 2e-3 * expected) << alpha;
    EXPECT_EQ(view_error(params, now, now, light, Rgb(1, 3, 2)), 0);
  }
}

TEST(ViewError, OfAPathOfSmallStepsIsFarBelowThatOfTheWhole) {
  // Over a lobe and down its other side every step's difference is small, and they have no common sign: 60 degrees in
  // 120 steps, none of which is above a tenth of the largest difference on the way.
  const SurfaceParams params = mirror_like(0.3f);
  const V3f light = towards(-30);
  float largest_step = 0, whole = 0;
  for (int i = 0; i < 120; ++i) {
    const V3f now = towards(0.5f * float(i + 1)), before = towards(0.5f * float(i));
    largest_step = std::max(largest_step, view_error(params, now, before, light, Rgb(1, 1, 1)));
    whole = std::max(whole, view_error(params, now, towards(0), light, Rgb(1, 1, 1)));
  }
  EXPECT_GT(whole, 0.5f);  // of a peak of 1 / (4 pi 0.09 cos^2 30) = 1.18
  EXPECT_LT(largest_step, 0.1f * whole);
}

TEST(ViewError, LambertLooksTheSameFromEverywhere) {
  SurfaceParams params;
  params.base_color = Rgb(0.5f, 0.5f, 0.5f);
  EXPECT_EQ(view_error(params, towards(10), towards(80), towards(-30), Rgb(1e9f, 1e9f, 1e9f)), 0);
}

TEST(ViewError, IsInfiniteWhereItIsNotKnown) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const SurfaceParams params = mirror_like(0.3f);
  EXPECT_EQ(view_error(params, towards(20), towards(160), towards(-30), Rgb(1, 1, 1)), kInfinity);
  EXPECT_EQ(view_error(params, towards(20), towards(90), towards(-30), Rgb(1, 1, 1)), kInfinity);
  EXPECT_EQ(view_error(params, towards(20), towards(30), towards(-30), Rgb(nan, 0, 0)), kInfinity);
  EXPECT_EQ(view_error(params, towards(20), towards(30), towards(-30), Rgb(kInfinity, 0, 0)), kInfinity);
  // A light behind the surface, grazing or none at all adds nothing; nothing here is NaN.
  EXPECT_EQ(view_error(params, towards(20), towards(30), towards(120), Rgb(1, 1, 1)), 0);
  EXPECT_FALSE(std::isnan(view_error(params, towards(20), towards(30), V3f(1, 0, 0), Rgb(1, 1, 1))));
  EXPECT_FALSE(std::isnan(view_error(params, towards(20), towards(30), V3f(1, 0, 1e-40f), Rgb(1e9f, 1e-40f, 0))));
  EXPECT_EQ(view_error(params, towards(20), towards(30), towards(-30), Rgb(0, 0, 0)), 0);
}

TEST(ViewError, SpecularIsBelowAHundredthAndWhateverLetsLightThrough) {
  EXPECT_TRUE(is_specular_or_refractive(mirror_like(0.0099f)));
  EXPECT_FALSE(is_specular_or_refractive(mirror_like(0.01f)));
  SurfaceParams params;
  EXPECT_FALSE(is_specular_or_refractive(params));
  params.alpha = 0;  // of no lobe
  EXPECT_FALSE(is_specular_or_refractive(params));
  params.model = LobeModel::none;
  EXPECT_FALSE(is_specular_or_refractive(params));
  params.model = LobeModel::metallic_roughness;
  EXPECT_TRUE(is_specular_or_refractive(params));
  params.alpha = 0.5f;
  EXPECT_FALSE(is_specular_or_refractive(params));
  params.transmission = 0.1f;
  EXPECT_TRUE(is_specular_or_refractive(params));
  params.model = LobeModel::pane;
  EXPECT_TRUE(is_specular_or_refractive(params));

  SurfaceParams coated;
  coated.model = LobeModel::stack;
  coated.alpha = 0.5f;
  LayerParams layers;
  coated.layers = &layers;
  EXPECT_FALSE(is_specular_or_refractive(coated));  // a coat of alpha 0 that is not there
  layers.clearcoat = 0.5f;
  EXPECT_TRUE(is_specular_or_refractive(coated));
  layers.clearcoat_alpha = 0.2f;
  EXPECT_FALSE(is_specular_or_refractive(coated));
  layers.diffuse_transmission = 0.5f;
  EXPECT_TRUE(is_specular_or_refractive(coated));

  SurfaceParams disney;
  disney.model = LobeModel::principled;
  disney.alpha = 0.5f;
  disney.principled.clearcoat_gloss = 1;
  EXPECT_FALSE(is_specular_or_refractive(disney));
  disney.principled.clearcoat = 1;
  EXPECT_TRUE(is_specular_or_refractive(disney));

  BlendParams blend{mirror_like(0.2f), mirror_like(0.005f), 0};
  SurfaceParams mixed;
  mixed.model = LobeModel::blend;
  mixed.blend = &blend;
  EXPECT_FALSE(is_specular_or_refractive(mixed));
  blend.weight = 0.5f;
  EXPECT_TRUE(is_specular_or_refractive(mixed));
}

}  // namespace
}  // namespace helio
