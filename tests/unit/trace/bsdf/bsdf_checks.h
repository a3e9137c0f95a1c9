// What every BSDF is asked: one story told by sample and evaluate, reciprocity, energy, samples that follow the
// density. Checks fail the test that calls them; name the material by SCOPED_TRACE.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/sampling/warp.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {

// By the cosine, not nearer to the horizon than 1e-3. `sign`: 1 above, -1 below.
inline V3f random_direction(Random& random, float sign) {
  V3f w = square_to_cosine_hemisphere(random.next_v2f());
  w.z = std::max(w.z, 1e-3f);
  w = normalize(w);
  return {w.x, w.y, sign * w.z};
}

// For the names of parameterised tests.
inline std::string letters_and_digits(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
  return name;
}

// A sample's weight is value over density, within `absolute` + `relative` weight.
inline void check_weights(const NamedMaterial& material, double absolute, double relative) {
  Random random(31);
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const V3f wo = random_direction(random, material.from_inside ? -1.0f : 1.0f);
    const float u_lobe = random.next_float();
    const BsdfSample sample = sample_bsdf(material.params, wo, u_lobe, random.next_v2f());
    if (!sample.valid() || sample.delta) continue;
    const BsdfValue value = evaluate_bsdf(material.params, wo, sample.wi);
    // The half vector of two float directions is known to about 1e-7 / |wo + wi| of alpha.
    ASSERT_NEAR(value.pdf_w / sample.pdf_w, 1, 0.03) << wo << sample.wi;
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(value.f_cos[c] / value.pdf_w, sample.weight[c], absolute + relative * sample.weight[c]);
    ASSERT_EQ(sample.transmitted, wo.z * sample.wi.z < 0);
    ASSERT_NEAR(length(sample.wi), 1, 1e-5);
    ++compared;
  }
  EXPECT_GT(compared, 300);
}

// f(a, b) = f(b, a) for reflection, within `absolute` + `relative` f.
inline void check_reflection_is_reciprocal(const NamedMaterial& material, double absolute, double relative) {
  const float sign = material.from_inside ? -1.0f : 1.0f;
  Random random(37);
  int positive = 0;
  for (int i = 0; i < 1000; ++i) {
    const V3f a = random_direction(random, sign), b = random_direction(random, sign);
    const Rgb ab = evaluate_bsdf(material.params, a, b).f_cos / std::fabs(b.z);
    const Rgb ba = evaluate_bsdf(material.params, b, a).f_cos / std::fabs(a.z);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(ab[c], ba[c], relative * ab[c] + absolute);
    positive += max_component(ab) > 0;
  }
  EXPECT_GT(positive, 100);
}

// f(wo, wi) / n_o^2 = f(wi, wo) / n_i^2 (Veach 1997, eq. 5.14); ior2: squared index below over that above.
inline void check_refraction_is_reciprocal(const SurfaceParams& params, float ior2) {
  Random random(41);
  int positive = 0;
  for (int i = 0; i < 2000; ++i) {
    const V3f above = random_direction(random, 1), below = random_direction(random, -1);
    const Rgb down = evaluate_bsdf(params, above, below).f_cos / -below.z;
    const Rgb up = evaluate_bsdf(params, below, above).f_cos / above.z;
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(down[c] * ior2, up[c], 5e-3 * up[c] + 1e-5) << above << below;
    positive += max_component(down) > 0;
  }
  EXPECT_GT(positive, 20);
}

// Shape and mass over the whole sphere, seen from so many degrees off the normal; deltas and invalid samples are
// "elsewhere". `tests`: how many of these there are, an angle and a material each.
inline void check_samples_follow_density(const NamedMaterial& material, std::initializer_list<double> angles,
                                         std::uint64_t seed, int tests) {
  const int kSamples = kChiSquareSamples;
  for (const double angle : angles) {
    SCOPED_TRACE(material.name + ", " + std::to_string(angle) + " degrees");
    V3f wo = direction_at(angle, 25);
    if (material.from_inside) wo.z = -wo.z;
    SphereHistogram histogram(V3f(0, 0, 1), 1, 16, 32);
    Random random(seed);
    for (int i = 0; i < kSamples; ++i) {
      const float u_lobe = random.next_float();
      const BsdfSample sample = sample_bsdf(material.params, wo, u_lobe, random.next_v2f());
      sample.valid() && !sample.delta ? histogram.add(sample.wi) : histogram.add_elsewhere();
    }
    double mass = 0;
    const ChiSquareResult result =
        histogram.test([&](const V3f& wi) { return evaluate_bsdf(material.params, wo, wi).pdf_w; }, &mass);
    EXPECT_TRUE(result.passes(kSignificance, tests)) << result.summary() << ", mass " << mass;
    EXPECT_LE(mass, 1 + 1e-4);
  }
}

// The probability that a delta sample reports is the frequency with which it comes, each lobe's its own where several
// are mixed; the rest is the density's, and what is missing from 1 that of invalid samples.
inline void check_delta_probabilities(const NamedMaterial& material, double angle, int samples, std::uint64_t seed) {
  V3f wo = direction_at(angle, 25);
  if (material.from_inside) wo.z = -wo.z;
  std::map<std::pair<bool, float>, int> deltas;  // by side and probability
  double diffuse = 0, invalid = 0;
  Random random(seed);
  for (int i = 0; i < samples; ++i) {
    const float u_lobe = random.next_float();
    const BsdfSample sample = sample_bsdf(material.params, wo, u_lobe, random.next_v2f());
    if (!sample.delta) {
      ++(sample.valid() ? diffuse : invalid);
      continue;
    }
    ++deltas[{sample.transmitted, sample.pdf_w}];
  }
  const double p_diffuse = integrate_sphere(
      SphereMap(V3f(0, 0, 1), 1), [&](const V3f& wi) { return evaluate_bsdf(material.params, wo, wi).pdf_w; });
  const auto five_sigma = [&](double p) { return 5 * std::sqrt(p * (1 - p) / samples) + 1e-4; };
  double p_all = p_diffuse;
  for (const auto& [lobe, count] : deltas) {
    const double p = double(lobe.second);
    EXPECT_NEAR(double(count) / samples, p, five_sigma(p)) << (lobe.first ? "transmitted" : "reflected");
    p_all += p;
  }
  EXPECT_NEAR(p_all, 1 - invalid / samples, five_sigma(invalid / samples));
  EXPECT_NEAR(diffuse / samples, p_diffuse, five_sigma(p_diffuse));
}

struct Furnace {
  Rgb power{0, 0, 0};        // returned, the radiance factor of refraction taken out
  V3d deviation{0, 0, 0};    // its standard error
  float largest_weight = 0;  // of any sample and channel

  double largest_deviation() const { return std::max({deviation.x, deviation.y, deviation.z}); }
};

// Under light of 1 from everywhere. variates(i): those of sample i, the lobe's in z.
template <typename Variates>
Furnace light_returned(const SurfaceParams& params, const V3f& wo, int count, const Variates& variates) {
  Furnace furnace;
  V3d sum(0, 0, 0), squares(0, 0, 0);
  for (int i = 0; i < count; ++i) {
    const V3f u = variates(i);
    const BsdfSample sample = sample_bsdf(params, wo, u.z, V2f(u.x, u.y));
    if (!sample.valid()) continue;
    const V3d power(sample.weight * (sample.transmitted ? sqr(sample.eta) : 1.0f));
    sum += power;
    squares += power * power;
    furnace.largest_weight = std::max(furnace.largest_weight, max_component(Rgb(power)));
  }
  furnace.power = Rgb(sum / count);
  for (int c = 0; c < 3; ++c) {
    const double mean = sum[c] / count;
    furnace.deviation[c] = std::sqrt(std::max(0.0, squares[c] / count - mean * mean) / count);
  }
  return furnace;
}

inline Furnace light_returned(const SurfaceParams& params, const V3f& wo, int count) {
  Random random(23);
  return light_returned(params, wo, count, [&](int i) {
    const float u_lobe = (i + random.next_float()) / count;
    const V2f u = random.next_v2f();
    return V3f(u.x, u.y, u_lobe);
  });
}

// By an additive recurrence in three dimensions (powers of the root of x^4 = x + 1), whose error is a tenth and less of
// that of random points: below 0.0005 for 131,072. The deviations are those of random points.
inline Furnace light_returned_evenly(const SurfaceParams& params, const V3f& wo, int count) {
  constexpr double kRoot = 1.2207440846057595;
  return light_returned(params, wo, count, [](int i) {
    double u[3], step = 1;
    for (double& x : u) {
      step /= kRoot;
      x = 0.5 + step * (i + 1);
      x -= std::floor(x);
    }
    return V3f(std::min(float(u[1]), kOneMinusEpsilon), std::min(float(u[2]), kOneMinusEpsilon),
               std::min(float(u[0]), kOneMinusEpsilon));
  });
}

inline bool is_sane(const Rgb& c) {
  return is_finite(c) && c.x >= 0 && c.y >= 0 && c.z >= 0;
}

// Of the extremest input: finite, unit, on the side that it says.
inline void check_sample_is_sane(const BsdfSample& sample, const V3f& wo) {
  ASSERT_TRUE(std::isfinite(sample.pdf_w) && sample.pdf_w >= 0);
  if (!sample.valid()) return;
  ASSERT_TRUE(is_sane(sample.weight)) << sample.weight;
  ASSERT_LT(max_component(sample.weight), 200) << wo;
  ASSERT_NEAR(length(sample.wi), 1, 1e-4);
  ASSERT_EQ(sample.transmitted, (wo.z > 0) != (sample.wi.z > 0)) << wo << sample.wi;
}

}  // namespace helio::test
