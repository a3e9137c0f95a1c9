#include <gtest/gtest.h>

#include <complex>

#include "renderer/trace/bsdf/fresnel.h"

namespace helio::test {
namespace {

// Textbook amplitudes in double: Snell's cosine is complex beyond the critical angle and in metals.
double textbook_reflectance(double cos_i, std::complex<double> n) {
  const std::complex<double> cos_t = std::sqrt(1.0 - (1 - cos_i * cos_i) / (n * n));
  const std::complex<double> r_s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
  const std::complex<double> r_p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
  return 0.5 * (std::norm(r_s) + std::norm(r_p));
}

TEST(FresnelDielectric, EqualsTheTextbook) {
  for (const float eta : {1 / 2.4f, 1 / 1.5f, 0.999f, 1.0001f, 1.01f, 1.33f, 1.5f, 2.4f, 10.0f}) {
    for (const float c : {1.0f, 0.9f, 0.5f, 0.2f, 0.05f, 1e-3f, 1.7e-5f}) {
      const double expected = textbook_reflectance(c, eta);
      EXPECT_NEAR(fresnel_dielectric(c, eta).reflectance, expected, 1e-5 * expected + 1e-12) << eta << ' ' << c;
    }
  }
}

TEST(FresnelDielectric, NormalIncidenceAndBrewster) {
  EXPECT_NEAR(fresnel_dielectric(1, 1.5f).reflectance, 0.04, 1e-7);  // (0.5 / 2.5)^2
  EXPECT_NEAR(dielectric_f0(1.5f), 0.04, 1e-7);
  EXPECT_FLOAT_EQ(dielectric_f0(0), 1);
  // At Brewster's angle (tan = eta) only s light is reflected: ((eta^2 - 1) / (eta^2 + 1))^2 / 2.
  const double eta = 1.5, c = 1 / std::sqrt(1 + eta * eta);
  EXPECT_NEAR(fresnel_dielectric(float(c), float(eta)).reflectance, 0.5 * std::pow(1.25 / 3.25, 2), 1e-7);
}

TEST(FresnelDielectric, MatchedIndexIsNoInterface) {
  for (const float c : {0.0f, 1e-30f, 1e-5f, 0.5f, 1.0f}) {
    const DielectricFresnel f = fresnel_dielectric(c, 1);
    EXPECT_EQ(f.reflectance, 0);
    EXPECT_EQ(f.cos_t, c);
  }
}

TEST(FresnelDielectric, TotalInternalReflection) {
  // From glass: sin of the critical angle = 1 / 1.5.
  const float critical = std::sqrt(1 - 1 / 2.25f);
  EXPECT_LT(fresnel_dielectric(critical + 1e-3f, 1 / 1.5f).reflectance, 1);
  const DielectricFresnel beyond = fresnel_dielectric(critical - 1e-3f, 1 / 1.5f);
  EXPECT_EQ(beyond.reflectance, 1);
  EXPECT_EQ(beyond.cos_t, 0);
}

TEST(FresnelDielectric, SameFromBothSides) {
  for (const float c : {0.05f, 0.3f, 0.8f, 1.0f}) {
    const DielectricFresnel in = fresnel_dielectric(c, 1.5f);
    const DielectricFresnel out = fresnel_dielectric(in.cos_t, 1 / 1.5f);
    EXPECT_NEAR(out.reflectance, in.reflectance, 1e-5);
    EXPECT_NEAR(out.cos_t, c, 2e-6);
  }
}

TEST(Refract, ObeysSnell) {
  for (const float eta : {1 / 1.5f, 1.001f, 1.5f, 2.4f}) {
    for (const float c : {1.0f, 0.95f, 0.8f}) {
      const float s = std::sqrt(1 - c * c);
      const V3f w(s * 0.6f, s * 0.8f, c);
      const DielectricFresnel f = fresnel_dielectric(c, eta);
      const V3f t = refract(w, V3f(0, 0, 1), c, f.cos_t, eta);
      EXPECT_NEAR(length(t), 1, 1e-6);
      EXPECT_NEAR(eta * std::hypot(t.x, t.y), s, 1e-6);
      EXPECT_NEAR(t.x * w.y - t.y * w.x, 0, 1e-6);
      EXPECT_LE(t.x * w.x + t.y * w.y, 0);
      EXPECT_NEAR(t.z, -f.cos_t, 1e-6);
    }
  }
}

TEST(FresnelConductor, EqualsTheTextbook) {
  const std::complex<float> kMetals[] = {{0.2f, 3.9f}, {1.1f, 2.14f}, {0.01f, 10.0f},
                                         {3.0f, 0.0f}, {0.05f, 0.5f}, {50, 50}};
  for (const auto& metal : kMetals) {
    for (const float c : {1.0f, 0.9f, 0.5f, 0.2f, 0.05f, 1e-3f}) {
      EXPECT_NEAR(fresnel_conductor(c, metal.real(), metal.imag()),
                  textbook_reflectance(c, {metal.real(), metal.imag()}), 2e-6)
          << metal << ' ' << c;
    }
  }
}

TEST(FresnelConductor, WithoutAbsorptionIsADielectric) {
  for (const float c : {1.0f, 0.7f, 0.3f, 0.01f}) {
    EXPECT_NEAR(fresnel_conductor(c, 1.5f, 0), fresnel_dielectric(c, 1.5f).reflectance, 1e-6);
    EXPECT_NEAR(fresnel_conductor(c, 1, 0), 0, 1e-7);
  }
}

TEST(Fresnel, StaysInRangeEverywhere) {
  const float cosines[] = {-1.0f, -1e-7f, 0.0f, 1e-38f, 1e-20f, 1.7e-5f, 0.5f, 1.0f, 1.0000001f};
  for (const float c : cosines) {
    for (const float eta : {1e-3f, 0.5f, 1.0f, 1.0000001f, 1.5f, 1e3f}) {
      const DielectricFresnel f = fresnel_dielectric(c, eta);
      EXPECT_TRUE(f.reflectance >= 0 && f.reflectance <= 1) << c << ' ' << eta;
      EXPECT_TRUE(f.cos_t >= 0 && f.cos_t <= 1.000001f) << c << ' ' << eta;
      for (const float k : {0.0f, 1e-3f, 1.0f, 1e3f}) {
        const float r = fresnel_conductor(c, eta, k);
        EXPECT_TRUE(r >= 0 && r <= 1) << c << ' ' << eta << ' ' << k;
      }
    }
    EXPECT_TRUE(schlick_term(c) >= 0 && schlick_term(c) <= 1);
  }
  EXPECT_FLOAT_EQ(schlick_term(0.5f), 1.0f / 32);
}

}  // namespace
}  // namespace helio::test
