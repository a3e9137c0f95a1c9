// Point, spot and directional lights against the formulas of KHR_lights_punctual.
#include "renderer/trace/lights/punctual_light.h"

#include <gtest/gtest.h>

namespace helio {
namespace {

PunctualLight light_of(PunctualKind kind) {
  PunctualLight light;
  light.kind = kind;
  light.position = V3d(1, 5, 2);
  light.direction = V3d(0, -1, 0);
  light.intensity = Rgb(8, 4, 2);
  light.inner_cone_angle = 0.3f;
  light.outer_cone_angle = 0.7f;
  return light;
}

TEST(PunctualLight, PointFallsOffWithTheSquareOfTheDistance) {
  const PunctualSource source = make_punctual_source(light_of(PunctualKind::point));
  const PunctualArrival arrival = arrive(source, {1, 3, 2});
  EXPECT_FLOAT_EQ(arrival.distance, 2);
  EXPECT_EQ(arrival.direction, V3f(0, 1, 0));
  EXPECT_EQ(arrival.radiance, Rgb(2, 1, 0.5f));  // I / 4
}

TEST(PunctualLight, RangeWindowsTheFalloff) {
  PunctualLight light = light_of(PunctualKind::point);
  light.range = 4;
  const PunctualSource source = make_punctual_source(light);
  // (1 - (d / range)^4) / d^2 at d = 2: 15 / 64.
  EXPECT_FLOAT_EQ(arrive(source, {1, 3, 2}).radiance.x, 8 * 15 / 64.0f);
  EXPECT_TRUE(is_black(arrive(source, {1, 1, 2}).radiance));    // at the range
  EXPECT_TRUE(is_black(arrive(source, {1, -50, 2}).radiance));  // beyond
  EXPECT_GT(arrive(source, {1, 1.01f, 2}).radiance.x, 0);
}

TEST(PunctualLight, SpotFadesBetweenItsCones) {
  const PunctualSource source = make_punctual_source(light_of(PunctualKind::spot));
  const auto at_angle = [&](double angle) {  // at distance 2
    return arrive(source, V3f(V3d(1, 5, 2) + V3d(std::sin(angle), -std::cos(angle), 0) * 2.0)).radiance.x;
  };
  EXPECT_NEAR(at_angle(0), 2, 1e-6);
  EXPECT_NEAR(at_angle(0.29), 2, 1e-5);
  for (const double angle : {0.35, 0.5, 0.65}) {
    const double ramp = (std::cos(angle) - std::cos(0.7)) / (std::cos(0.3) - std::cos(0.7));
    EXPECT_NEAR(at_angle(angle), 2 * ramp * ramp, 1e-5) << angle;
  }
  EXPECT_EQ(at_angle(0.71), 0);
  EXPECT_EQ(at_angle(3.1), 0);
}

TEST(PunctualLight, SpotWithEqualConesIsFinite) {
  PunctualLight light = light_of(PunctualKind::spot);
  light.inner_cone_angle = light.outer_cone_angle = 0.5f;
  const PunctualSource source = make_punctual_source(light);
  EXPECT_FLOAT_EQ(arrive(source, {1, 3, 2}).radiance.x, 2);
  EXPECT_EQ(arrive(source, {5, 3, 2}).radiance.x, 0);
  // Light up to the edge: the ramp is no wider than floats need.
  for (const auto& [angle, wanted] : {std::pair(0.4999, 2.0), std::pair(0.5001, 0.0)}) {
    const V3d point = V3d(1, 5, 2) + V3d(std::sin(angle), -std::cos(angle), 0) * 2.0;
    EXPECT_NEAR(double(arrive(source, V3f(point)).radiance.x), wanted, 1e-5) << angle;
  }
}

TEST(PunctualLight, DirectionalIsTheSameEverywhere) {
  const PunctualSource source = make_punctual_source(light_of(PunctualKind::directional));
  for (const V3f& point : {V3f(0, 0, 0), V3f(1e7f, 3, -5)}) {
    const PunctualArrival arrival = arrive(source, point);
    EXPECT_EQ(arrival.direction, V3f(0, 1, 0));
    EXPECT_TRUE(std::isinf(arrival.distance));
    EXPECT_EQ(arrival.radiance, Rgb(8, 4, 2));
  }
}

TEST(PunctualLight, ExtremesAreFiniteOrBlack) {
  PunctualLight light = light_of(PunctualKind::point);
  light.intensity = Rgb(1e9f);
  for (const float range : {std::numeric_limits<float>::infinity(), 1e-6f, 1e9f}) {
    light.range = range;
    const PunctualSource source = make_punctual_source(light);
    for (const V3f& offset : {V3f(0, 0, 0), V3f(1e-7f, 0, 0), V3f(0, 1e7f, 0), V3f(1e15f, 0, 0)}) {
      const PunctualArrival arrival = arrive(source, V3f(1, 5, 2) + offset);
      EXPECT_TRUE(is_finite(arrival.radiance)) << offset;
      EXPECT_TRUE(is_black(arrival.radiance) || std::abs(length(arrival.direction) - 1) < 1e-5f);
    }
  }
}

// 8 / (1e-14)^2 = 8e28 is a float, times 1e12 it is none: not hidden, so that the film can count the sample.
TEST(PunctualLight, NearerThanAFloatCanSayIsInfinite) {
  PunctualLight light = light_of(PunctualKind::point);
  light.position = V3d(0, 0, 0);
  EXPECT_TRUE(is_finite(arrive(make_punctual_source(light), {0, 1e-14f, 0}).radiance));
  light.intensity = Rgb(8e12f, 0, 1);
  const Rgb radiance = arrive(make_punctual_source(light), {0, 1e-14f, 0}).radiance;
  EXPECT_EQ(radiance.x, std::numeric_limits<float>::infinity());
  EXPECT_EQ(radiance.y, 0);
  EXPECT_TRUE(std::isfinite(radiance.z));
}

}  // namespace
}  // namespace helio
