// What a few directions say of how a surface looks from elsewhere.
#include "renderer/trace/gbuffer/light_reweighting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {
namespace {

const V3f kBefore = direction_at(35, 0), kNow = direction_at(25, 20);

// A surface under some lamps, seen along two directions.
class Lit {
 public:
  struct Lamp {
    V3f wi;
    Rgb radiance;
  };

  Lit(const SurfaceParams& params, std::vector<Lamp> lamps) : params_(params), lamps_(std::move(lamps)) {
    for (const Lamp& lamp : lamps_) {
      const SeenLight seen = along(kBefore, lamp.wi);
      const float brought = luminance(seen.all * lamp.radiance);
      const float varies = brought * varying_share(seen.all, seen.matte);
      light_ += double(brought);
      varies_ += double(varies);
      counts_.push_back(double(varies + DirectionReservoir::kMatte * (brought - varies)));
      counted_ += counts_.back();
    }
  }

  SeenLight along(const V3f& wo, const V3f& wi) const {
    return {evaluate_bsdf(params_, wo, wi).f_cos, matte_cos(params_, wo, wi)};
  }
  Rgb radiance(const V3f& wo) const {
    Rgb sum(0, 0, 0);
    for (const Lamp& lamp : lamps_) sum += along(wo, lamp.wi).all * lamp.radiance;
    return sum;
  }
  double share() const { return varies_ / light_; }

  // By directions of some samples, each picked in proportion to what its light counts.
  ViewEvidence evidence(int directions, Random& random, const V3f& now = kNow) const {
    LightReweighting change(light_);
    for (int k = 0; k < directions; ++k) {
      double at = random.next_double() * counted_;
      std::size_t lamp = 0;
      while (lamp + 1 < lamps_.size() && at >= counts_[lamp]) at -= counts_[lamp++];
      change.add(float(counted_ / directions), along(kBefore, lamps_[lamp].wi), along(now, lamps_[lamp].wi));
    }
    ViewEvidence told;
    change.tell(told);
    return told;
  }

 private:
  SurfaceParams params_;
  std::vector<Lamp> lamps_;
  std::vector<double> counts_;
  double light_ = 0, varies_ = 0, counted_ = 0;
};

SurfaceParams coated(float alpha, const Rgb& base) {
  SurfaceParams params = metallic_roughness(MicrofacetDistribution::ggx, alpha);
  params.base_color = base;
  return params;
}

// White light from all around, and a lamp near where the lobe was.
std::vector<Lit::Lamp> a_room(float lamp) {
  std::vector<Lit::Lamp> lamps;
  for (int i = 0; i < 40; ++i) lamps.push_back({direction_at(5 + 2 * i, 47 * i), Rgb(1)});
  lamps.push_back({direction_at(30, 185), Rgb(lamp)});
  return lamps;
}

// Over many choices of the directions the mean is what the surface sends, of every colour; so is what is said of the
// scatter.
TEST(LightReweighting, IsWhatTheSurfaceSendsInTheMean) {
  for (const float lamp : {0.0f, 5.0f}) {
    for (const SurfaceParams& params :
         {coated(0.3f, Rgb(0.5f)), coated(0.3f, Rgb(0.9f, 0.4f, 0.1f)), coated(0.15f, Rgb(0.02f))}) {
      const Lit lit(params, a_room(lamp));
      const Rgb before = lit.radiance(kBefore), now = lit.radiance(kNow);
      const double truth = double(luminance(now) / luminance(before)) - 1;
      Random random(5);
      constexpr int kTimes = 40000;
      double mean = 0, squares = 0, scatter = 0;
      V3d change(0, 0, 0);
      for (int i = 0; i < kTimes; ++i) {
        const ViewEvidence told = lit.evidence(4, random);
        mean += double(told.off) / kTimes;
        squares += double(told.off) * double(told.off) / kTimes;
        scatter += double(told.scatter) / kTimes;
        change += V3d(told.change) / double(kTimes);
      }
      const double variance = squares - mean * mean;
      EXPECT_NEAR(mean, truth, 5 * std::sqrt(variance / kTimes) + 1e-3) << lit.share();
      EXPECT_NEAR(scatter / variance, 1, 0.1);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(change[c], double(now[c] / before[c]) - 1, 0.03) << c;
    }
  }
}

// Where little of the light depends on the view, four directions that tell of that little alone are off by less than
// four of all light, f_now / f_before of each.
TEST(LightReweighting, ScattersLessThanDirectionsOfAllLight) {
  const Lit lit(coated(0.2f, Rgb(0.8f)), a_room(0));
  ASSERT_LT(lit.share(), 0.15);
  Random random(6);
  constexpr int kTimes = 20000;
  double mean = 0, squares = 0;
  for (int i = 0; i < kTimes; ++i) {
    const double off = double(lit.evidence(4, random).off);
    mean += off / kTimes;
    squares += off * off / kTimes;
  }
  const double variance = squares - mean * mean;
  double all = 0, ratio = 0, ratio2 = 0;
  for (const Lit::Lamp& lamp : a_room(0)) {
    const float before = luminance(lit.along(kBefore, lamp.wi).all * lamp.radiance);
    const float now = luminance(lit.along(kNow, lamp.wi).all * lamp.radiance);
    if (!(before > 0)) continue;
    all += double(before);
    ratio += double(now);
    ratio2 += double(now) * double(now) / double(before);
  }
  const double plain = (ratio2 / all - ratio / all * ratio / all) / 4;
  std::printf("variance of four directions: %.3g, of all light %.3g\n", variance, plain);
  EXPECT_LT(variance, 0.7 * plain);
}

TEST(LightReweighting, WithoutAChangeOfViewIsNoneToTheBit) {
  const Lit lit(coated(0.2f, Rgb(0.8f, 0.5f, 0.1f)), a_room(5));
  Random random(7);
  const ViewEvidence told = lit.evidence(4, random, kBefore);
  EXPECT_TRUE(told.lit);
  EXPECT_EQ(told.off, 0);
  EXPECT_EQ(told.scatter, 0);
  EXPECT_EQ(told.unknown, 0);
  EXPECT_EQ(told.change, Rgb(0, 0, 0));
}

// One lamp that lobes turn to: seen by its share of the base, which kMatte leaves among the picks.
TEST(LightReweighting, ALobeThatComesIsSeenByTheBase) {
  const V3f towards = direction_at(25, 200);
  const Lit lit(coated(0.1f, Rgb(0.5f)), {{towards, Rgb(1)}});
  const double truth = double(luminance(lit.radiance(kNow)) / luminance(lit.radiance(kBefore))) - 1;
  ASSERT_GT(truth, 1);
  Random random(8);
  EXPECT_NEAR(double(lit.evidence(4, random).off) / truth, 1, 0.01);
}

TEST(LightReweighting, WhatIsNotKnownIsSaid) {
  const SeenLight nothing{Rgb(0, 0, 0), Rgb(0, 0, 0)}, white{Rgb(1), Rgb(1)};
  ViewEvidence told;
  LightReweighting(0).tell(told);
  EXPECT_FALSE(told.lit);
  EXPECT_EQ(told.directions, 0);
  LightReweighting black(4);
  EXPECT_LT(black.add(4, nothing, white), 0);
  black.tell(told);
  EXPECT_TRUE(told.lit);
  EXPECT_EQ(told.unknown, 1);
  EXPECT_EQ(told.directions, 0);
  // All that was picked is a mirror's, for a tenth of the light: no more than that is unknown.
  LightReweighting tenth(4);
  tenth.add_unknown(0.4f);
  tenth.tell(told);
  EXPECT_NEAR(told.unknown, 0.1, 1e-6);
  // Half by mirrors: that may change altogether, and is taken to stay.
  LightReweighting half(2);
  half.add_unknown(1);
  EXPECT_FLOAT_EQ(half.add(DirectionReservoir::kMatte, white, {Rgb(0.5f), Rgb(0.5f)}), 0.5f);
  half.tell(told);
  EXPECT_NEAR(told.unknown, 0.5, 1e-6);
  EXPECT_NEAR(told.off, -0.25, 1e-3);
  EXPECT_NEAR(told.change.y, -0.25, 1e-3);
}

TEST(LightReweighting, ExtremeNumbersStayNumbers) {
  for (const float value : {1e-40f, 1e-30f, 1e-10f, 1e10f, 1e30f}) {
    for (const float weight : {1e-40f, 1e-20f, 1.0f, 1e20f, 1e38f}) {
      for (const float later : {0.0f, 1e-30f, 1.0f, 1e30f}) {
        LightReweighting change(2 * double(weight));
        const float counts = change.add(weight, {Rgb(value), Rgb(0, 0, 0)}, {Rgb(later), Rgb(0, 0, 0)});
        change.add(weight, {Rgb(value), Rgb(value)}, {Rgb(value), Rgb(value)});
        EXPECT_TRUE(std::isfinite(counts));
        EXPECT_LE(counts, 1.001f * kMostRatio);
        ViewEvidence told;
        change.tell(told);
        EXPECT_TRUE(std::isfinite(told.off) && std::isfinite(told.scatter) && std::isfinite(told.unknown));
        EXPECT_GE(told.off, -1.001f);
        EXPECT_LE(told.off, kMostRatio);
        for (int c = 0; c < 3; ++c) {
          EXPECT_GE(told.change[c], -1);
          EXPECT_LE(told.change[c], kMostRatio - 1);
        }
      }
    }
  }
  // Bases, too, are cut off: one that was next to black, as at grazing angles under a coat, must not outweigh all else.
  LightReweighting grazing(2);
  EXPECT_LE(grazing.add(1, {Rgb(1e-30f), Rgb(1e-30f)}, {Rgb(1), Rgb(1)}), 1.001f * kMostRatio);
  EXPECT_LT(grazing.add(0, {Rgb(1), Rgb(1)}, {Rgb(1), Rgb(1)}), 0) << "of no weight";
  LightReweighting change(1);
  EXPECT_LT(change.add(1, {Rgb(INFINITY), Rgb(0, 0, 0)}, {Rgb(1), Rgb(0, 0, 0)}), 0);
  EXPECT_LT(change.add(1, {Rgb(1), Rgb(0, 0, 0)}, {Rgb(NAN), Rgb(0, 0, 0)}), 0);
}

}  // namespace
}  // namespace helio::test
