// What each integrator says of scenes of each kind.
#include "renderer/trace/selection/unsampled_light.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace helio {
namespace {

constexpr Integrator kConnecting[] = {Integrator::bdpt, Integrator::pt_bdpt, Integrator::lvc};

SceneFeatures diffuse(bool delta_lights, bool area_lights) {
  SceneFeatures features;
  features.only_lambert = true;
  features.delta_lights = delta_lights;
  features.area_lights = area_lights;
  return features;
}

SceneFeatures with_glass(SceneFeatures features) {
  features.only_lambert = false;
  features.delta_lobes = features.microfacet = features.caustics = true;
  return features;
}

// How many sentences begin so; every one begins with its kind.
int count(Integrator integrator, const SceneFeatures& features, const std::string& kind) {
  const std::vector<std::string> all = unsampled_light(integrator, features);
  return int(std::count_if(all.begin(), all.end(), [&](const auto& text) { return text.rfind(kind + ": ", 0) == 0; }));
}
int missing(Integrator integrator, const SceneFeatures& features) {
  return count(integrator, features, "missing");
}
int by_chance(Integrator integrator, const SceneFeatures& features) {
  return count(integrator, features, "by chance alone");
}

TEST(UnsampledLight, NothingWhereSurfacesAreDiffuse) {
  for (const bool delta : {false, true}) {
    for (const Integrator integrator : kEveryIntegrator) {
      if (merges(integrator)) continue;
      EXPECT_TRUE(unsampled_light(integrator, diffuse(delta, true)).empty()) << to_string(integrator);
    }
  }
}

TEST(UnsampledLight, PointLightsBehindGlassAreNotFoundByCameraPaths) {
  const SceneFeatures point = with_glass(diffuse(true, false)), lamp = with_glass(diffuse(false, true));
  EXPECT_EQ(missing(Integrator::path, point), 1);
  EXPECT_EQ(by_chance(Integrator::path, point), 0) << "there is no other light";
  EXPECT_EQ(missing(Integrator::path, lamp), 0);
  EXPECT_EQ(by_chance(Integrator::path, lamp), 1);
  SceneFeatures both = lamp;
  both.delta_lights = true;
  EXPECT_EQ(missing(Integrator::path, both), 1);
  EXPECT_EQ(by_chance(Integrator::path, both), 1);
}

// Rough metal focuses, but next-event estimation reaches it.
TEST(UnsampledLight, GlossySurfacesHideNothing) {
  SceneFeatures glossy = diffuse(true, false);
  glossy.only_lambert = false;
  glossy.microfacet = glossy.caustics = true;
  for (const Integrator integrator : {Integrator::path, Integrator::bdpt, Integrator::light})
    EXPECT_TRUE(unsampled_light(integrator, glossy).empty()) << to_string(integrator);
  glossy.environment = true;
  EXPECT_EQ(by_chance(Integrator::path, glossy), 1);
  EXPECT_EQ(by_chance(Integrator::bdpt, glossy), 0);
}

TEST(UnsampledLight, CausticsInMirrorsAreJoinedToNothing) {
  for (const Integrator integrator : kConnecting) {
    // Tiles without light paths miss what the path tracer misses.
    const int expected = integrator == Integrator::pt_bdpt ? 2 : 1;
    EXPECT_EQ(missing(integrator, with_glass(diffuse(true, false))), expected) << to_string(integrator);
    EXPECT_EQ(missing(integrator, with_glass(diffuse(false, true))), 0) << to_string(integrator);
    EXPECT_EQ(by_chance(integrator, with_glass(diffuse(false, true))), 1) << to_string(integrator);
    EXPECT_NE(unsampled_light(integrator, with_glass(diffuse(true, false)))[0],
              unsampled_light(Integrator::path, with_glass(diffuse(true, false)))[0])
        << to_string(integrator) << " finds more than the path tracer";
  }
}

TEST(UnsampledLight, LightTracingShowsNoMirrorsAndNoBentNormals) {
  EXPECT_EQ(missing(Integrator::light, with_glass(diffuse(false, true))), 1);
  for (const auto bent : {&SceneFeatures::smooth_normals, &SceneFeatures::normal_maps}) {
    SceneFeatures features = diffuse(false, true);
    features.*bent = true;
    EXPECT_EQ(missing(Integrator::light, features), 1);
    EXPECT_EQ(missing(Integrator::bdpt, features), 0);
  }
  SceneFeatures sky = diffuse(false, false);
  sky.environment = true;
  EXPECT_EQ(by_chance(Integrator::light, sky), 1);
  EXPECT_EQ(by_chance(Integrator::path, sky), 0);
}

// Merging finds everything, and is biased whatever there is.
TEST(UnsampledLight, MergingIsBiased) {
  for (const Integrator integrator : {Integrator::vcm, Integrator::photon}) {
    for (const SceneFeatures& features : {diffuse(true, false), with_glass(diffuse(true, true))}) {
      EXPECT_EQ(count(integrator, features, "biased"), 1) << to_string(integrator);
      EXPECT_EQ(unsampled_light(integrator, features).size(), 1u) << to_string(integrator);
    }
  }
}

}  // namespace
}  // namespace helio
