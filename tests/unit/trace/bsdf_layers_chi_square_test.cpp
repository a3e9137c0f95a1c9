// Samples follow the density: layered materials, and those that only Mitsuba scenes have.
#include <gtest/gtest.h>

#include "tests/unit/trace/bsdf_checks.h"
#include "tests/unit/trace/layer_cases.h"
#include "tests/unit/trace/mitsuba_cases.h"

namespace helio::test {
namespace {

const std::vector<NamedMaterial>& sampled_materials() {
  static const std::vector<NamedMaterial> list = [] {
    std::vector<NamedMaterial> all;
    for (NamedMaterial& material : layered_materials(0.2f, false)) {
      material.name = "gltf " + material.name;
      all.push_back(material);
    }
    for (NamedMaterial& material : mitsuba_materials(0.2f, false)) {
      material.name = "mitsuba " + material.name;
      all.push_back(material);
    }
    return all;
  }();
  return list;
}

class LayersChiSquare : public testing::TestWithParam<std::size_t> {};

TEST_P(LayersChiSquare, SamplesFollowTheDensity) {
  check_samples_follow_density(sampled_materials()[GetParam()], 61, int(sampled_materials().size()));
}

INSTANTIATE_TEST_SUITE_P(, LayersChiSquare, testing::Range(std::size_t(0), sampled_materials().size()),
                         [](const auto& info) { return letters_and_digits(sampled_materials()[info.param].name); });

}  // namespace
}  // namespace helio::test
