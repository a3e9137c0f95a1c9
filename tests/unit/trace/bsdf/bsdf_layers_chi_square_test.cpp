// Samples follow the density: layered materials, and those that only Mitsuba scenes have.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/trace/bsdf/bsdf_checks.h"
#include "tests/unit/trace/bsdf/layer_cases.h"
#include "tests/unit/trace/bsdf/mitsuba_cases.h"

namespace helio::test {
namespace {

constexpr float kAlphas[] = {0.07f, 0.2f, 0.6f};
const std::vector<NamedMaterial>& sampled_materials() {
  static const std::vector<NamedMaterial> list = [] {
    std::vector<NamedMaterial> all;
    for (const float alpha : kAlphas) {
      const std::string end = " alpha " + std::to_string(std::lround(alpha * 100)) + " percent";
      for (NamedMaterial& material : layered_materials(alpha, false)) {
        material.name = "gltf " + material.name + end;
        all.push_back(material);
      }
      for (NamedMaterial& material : mitsuba_materials(alpha, false)) {
        material.name = "mitsuba " + material.name + end;
        all.push_back(material);
      }
    }
    return all;
  }();
  return list;
}

class LayersChiSquare : public testing::TestWithParam<std::size_t> {};

// From above and from aside; the smoothest from one angle, and the roughest from another.
TEST_P(LayersChiSquare, SamplesFollowTheDensity) {
  const NamedMaterial& material = sampled_materials()[GetParam()];
  const std::size_t of_alpha = sampled_materials().size() / std::size(kAlphas);
  const int tests = 4 * int(of_alpha);
  switch (GetParam() / of_alpha) {
    case 0:
      return check_samples_follow_density(material, {65}, 61, tests);
    case 1:
      return check_samples_follow_density(material, {40, 85}, 61, tests);
    default:
      return check_samples_follow_density(material, {20}, 61, tests);
  }
}

INSTANTIATE_TEST_SUITE_P(, LayersChiSquare, testing::Range(std::size_t(0), sampled_materials().size()),
                         [](const auto& info) { return letters_and_digits(sampled_materials()[info.param].name); });

// In the frame of a mapped normal; what that and the surface's own disagree about is lost, and belongs elsewhere.
TEST(MappedChiSquare, SamplesFollowTheDensity) {
  using enum MicrofacetDistribution;
  std::vector<NamedMaterial> materials = {lambert_material(),
                                          {"metal", mitsuba_conductor(ggx, 0.3f)},
                                          {"plastic", plastic(beckmann, 0.4f, 1.5f, Rgb(0.7f, 0.3f, 0.1f))},
                                          {"glass", glass(ggx, 0.3f, 1.5f, false)},
                                          {"glass from inside", glass(ggx, 0.3f, 1.5f, false), true}};
  for (NamedMaterial& material : materials) {
    material.name += ", mapped";
    material.params.mapped = true;
    material.params.map_normal = direction_at(35, 160);
    material.params.map_alpha2 = 0.06f;
    check_samples_follow_density(material, {15, 60}, 67, 2 * int(materials.size()));
  }
}

bool has_deltas(const NamedMaterial& material) {
  V3f wo = direction_at(55, 25);
  if (material.from_inside) wo.z = -wo.z;
  Random random(70);
  for (int i = 0; i < 1000; ++i) {
    const float u_lobe = random.next_float();
    if (sample_bsdf(material.params, wo, u_lobe, random.next_v2f()).delta) return true;
  }
  return false;
}

// Of lobes that are mixed with others: coats, plastic, blends. The frequency of a delta is what its sample says.
TEST(LayersDelta, ProbabilitiesAreThoseStated) {
  int deltas = 0;
  const auto check = [&](const std::vector<NamedMaterial>& materials, float alpha) {
    for (const NamedMaterial& material : materials) {
      if (material.name.find("own normal") != std::string::npos) continue;  // its mirror image may be below the surface
      if (!has_deltas(material)) continue;
      SCOPED_TRACE(material.name + ", alpha " + std::to_string(alpha));
      check_delta_probabilities(material, 55, 200'000, 71);
      ++deltas;
    }
  };
  for (const float alpha : {0.0f, 0.3f}) {
    check(layered_materials(alpha, false), alpha);
    check(mitsuba_materials(alpha, false), alpha);
  }
  EXPECT_GT(deltas, 12);
}

}  // namespace
}  // namespace helio::test
