// Selection by power: the alias table draws what it says, fluxes are those of the textbook, textures are averaged.
#include "renderer/trace/lights/light_power.h"

#include <gtest/gtest.h>

#include "renderer/trace/sampling/alias_table.h"
#include "tests/support/chi_square.h"
#include "tests/unit/trace/lights/light_test_scenes.h"

namespace helio {
namespace {

TEST(AliasTable, DrawsWithItsProbabilities) {
  const std::vector<std::vector<double>> sets = {{1},
                                                 {1, 1},
                                                 {1, 2, 3, 4},
                                                 {1e-6, 1e9},
                                                 {0, 1, 0, 5, 0},
                                                 {7, 0},
                                                 std::vector<double>(1000, 2.5),
                                                 {3, 1e-3, 5, 8, 1e2}};
  for (const std::vector<double>& weights : sets) {
    const AliasTable table(weights);
    double total = 0;
    for (const double w : weights) total += w;
    constexpr int kCount = 1000000;
    std::vector<double> observed(weights.size()), expected(weights.size());
    test::Random random(3);
    std::vector<double> rest(10), uniform(10, kCount / 10.0);
    for (int i = 0; i < kCount; ++i) {
      const AliasTable::Choice choice = table.sample(random.next_float());
      ASSERT_LT(choice.index, weights.size());
      ASSERT_EQ(choice.probability, table.probability(choice.index));
      ASSERT_TRUE(choice.u >= 0 && choice.u < 1);
      ++observed[choice.index];
      ++rest[std::size_t(choice.u * 10)];
    }
    for (std::size_t i = 0; i < weights.size(); ++i) {
      EXPECT_NEAR(table.probability(std::uint32_t(i)), weights[i] / total, 1e-6);
      expected[i] = kCount * weights[i] / total;
      EXPECT_TRUE(weights[i] > 0 || observed[i] == 0);
    }
    const test::ChiSquareResult drawn = test::chi_square_test(observed, expected);
    EXPECT_TRUE(drawn.passes(test::kSignificance, int(2 * sets.size()))) << drawn.summary();
    const test::ChiSquareResult left = test::chi_square_test(rest, uniform);
    EXPECT_TRUE(left.passes(test::kSignificance, int(2 * sets.size()))) << left.summary();
  }
}

TEST(AliasTable, AcceptsTheEndsOfTheUnitInterval) {
  const AliasTable table(std::vector<double>{0, 1, 3, 0});
  for (const float u : {0.0f, 1e-30f, kOneMinusEpsilon}) {
    const AliasTable::Choice choice = table.sample(u);
    EXPECT_TRUE(choice.index == 1 || choice.index == 2);
    EXPECT_TRUE(choice.u >= 0 && choice.u < 1);
  }
}

TEST(LightPower, FluxesAreThoseOfTheTextbook) {
  AreaLight quad;
  quad.shape = make_parallelogram_shape({0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 1}, false);
  EXPECT_NEAR(area_flux(quad, 5), kPi * 5 * 6, 1e-4);  // pi L A
  quad.shape.two_sided = true;
  EXPECT_NEAR(area_flux(quad, 5), 2 * kPi * 5 * 6, 1e-4);

  PunctualLight light;
  light.intensity = Rgb(2);
  EXPECT_NEAR(punctual_flux(light, 10), 4 * kPi * 2, 1e-5);
  // A spot's smooth edge is taken as half way: the exact integral of its squared ramp is below, the hard cone above.
  light.kind = PunctualKind::spot;
  light.inner_cone_angle = 0.5f;
  light.outer_cone_angle = 0.6f;
  EXPECT_GT(punctual_flux(light, 10), 2 * kTwoPi * (1 - std::cos(0.5f)));
  EXPECT_LT(punctual_flux(light, 10), 2 * kTwoPi * (1 - std::cos(0.6f)));
  light.kind = PunctualKind::directional;
  EXPECT_NEAR(punctual_flux(light, 10), 2 * kPi * 100, 1e-3);
  EXPECT_NEAR(environment_flux(2, 10), 2 * kPi * kPi * 100, 1e-2);
}

// Columns of 8 texels: white on the left quarter, black elsewhere.
Image quarter_white() {
  Image image;
  image.width = image.height = 8;
  image.channels = 1;
  for (int i = 0; i < 64; ++i) image.texels.push_back(i % 8 < 2 ? 255 : 0);
  return image;
}

TEST(LightPower, TexturesAreAveragedOverTheLight) {
  const std::vector<Image> images = {quarter_white()};
  const TextureTable textures(images);
  std::vector<AreaEmitter> emitters;
  const auto add = [&](float u0, float u1) {
    AreaEmitter e = test::triangle_emitter({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 4);
    e.texture.image = 0;
    e.texture.wrap_u = WrapMode::clamp;
    e.uv[0] = V2f(u0, 0);
    e.uv[1] = V2f(u1, 0);
    e.uv[2] = V2f(u0, 1);
    emitters.push_back(e);
  };
  add(0, 1);          // share of the triangle with u < 1/4: 1 - (3/4)^2 = 7/16
  add(0.07f, 0.18f);  // all white
  add(0.4f, 0.6f);    // all black: a hundredth of the image's mean of 1/4
  const AreaLights grouped = group_area_emitters(emitters);
  const std::vector<double> means = mean_radiances(grouped, emitters, &textures);
  ASSERT_EQ(means.size(), 3u);
  EXPECT_NEAR(means[0], 4 * 7 / 16.0, 0.1);
  EXPECT_NEAR(means[1], 4, 1e-3);
  EXPECT_NEAR(means[2], 4 * 0.25 * 0.01, 1e-3);
}

}  // namespace
}  // namespace helio
