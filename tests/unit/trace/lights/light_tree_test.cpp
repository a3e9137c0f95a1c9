// Selection of one of many lights by tree: its probabilities are what it says, no light that reaches a point is left
// out, awkward sets of lights build.
#include "renderer/trace/lights/light_tree.h"

#include <gtest/gtest.h>

#include <numeric>

#include "renderer/trace/lights/light_tree_build.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"

namespace helio {
namespace {

using test::Random;

V3f random_unit(Random& random) {
  const float z = 2 * random.next_float() - 1, phi = kTwoPi * random.next_float(), r = safe_sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

V3f random_point(Random& random, float extent) {
  const float x = random.next_float(), y = random.next_float();
  return V3f(x, y, random.next_float()) * extent;
}

// Facets, bulbs, spots and lights of limited range.
std::vector<LightBounds> mixed_lights(int count, float extent, std::uint64_t seed) {
  Random random(seed);
  std::vector<LightBounds> lights(static_cast<std::size_t>(count));
  for (LightBounds& light : lights) {
    const V3f center = random_point(random, extent);
    light.box = Box3f(center);
    light.intensity = std::pow(10.0, 4 * random.next_double() - 2);
    const std::uint32_t kind = random.next_u32() % 5;
    if (kind <= 1) {
      light.axis = random_unit(random);
      light.box.extendBy(center + Frame(light.axis).s * (0.02f * extent));
      light.two_sided = kind == 1;
    } else if (kind == 2) {
      light.axis = random_unit(random);
      light.theta_e = 0.1f + 1.4f * random.next_float();
    } else {
      light.theta_o = kPi;
      if (kind == 3) light.range = extent * (0.05f + random.next_float());
    }
  }
  return lights;
}

// A node's bounds may promise light that none of its children sends: those selections come back empty. They must be
// few: these lights face every way, so that more clusters than usual lie across the point's horizon.
TEST(LightTree, ProbabilitiesAddUpToOneOrLittleLess) {
  for (const int count : {2, 3, 8, 9, 100, 3000}) {
    const LightTree tree(mixed_lights(count, 1, 1));
    Random random(2);
    double used = 0;
    int lit = 0;
    for (int p = 0; p < 40; ++p) {
      const V3f point = random_point(random, 1.5f);
      const V3f normal = p % 3 == 0 ? V3f(0, 0, 0) : random_unit(random);
      double sum = 0;
      for (int i = 0; i < count; ++i) sum += tree.probability(point, normal, std::uint32_t(i));
      EXPECT_LE(sum, 1 + 1e-4) << count;
      used += sum;
      lit += sum > 0;
    }
    EXPECT_GT(used, 0.8 * lit) << count;
  }
}

TEST(LightTree, SelectsWithTheProbabilityItReports) {
  constexpr int kLights = 300, kCount = 1000000;
  const LightTree tree(mixed_lights(kLights, 1, 3));
  Random random(4);
  for (int p = 0; p < 4; ++p) {
    const V3f point = random_point(random, 1), normal = random_unit(random);
    std::vector<double> observed(kLights + 1), expected(kLights + 1);  // the last: nothing selected
    for (int i = 0; i < kCount; ++i) {
      const LightTree::Choice choice = tree.select(point, normal, random.next_float());
      if (choice.probability == 0) {
        ++observed.back();
        continue;
      }
      ASSERT_NEAR(choice.probability, tree.probability(point, normal, choice.light), 1e-5f * choice.probability);
      ++observed[choice.light];
    }
    expected.back() = kCount;
    for (std::size_t i = 0; i < kLights; ++i) {
      expected[i] = kCount * double(tree.probability(point, normal, std::uint32_t(i)));
      expected.back() -= expected[i];
    }
    if (expected.back() < 1e-3 * kCount) expected.back() = 0;  // rounding
    const test::ChiSquareResult result = test::chi_square_test(observed, expected);
    EXPECT_TRUE(result.passes(test::kSignificance, 4)) << result.summary();
  }
}

TEST(LightTree, SelectsForManyPointsWhatItSelectsForEach) {
  for (const int count : {2, 9, 3000}) {
    const LightTree tree(mixed_lights(count, 1, 11));
    Random random(12);
    for (const std::size_t many : {std::size_t(0), std::size_t(1), std::size_t(7), LightTree::kMostQueries}) {
      std::vector<LightTree::Query> queries(many);
      for (LightTree::Query& query : queries) {
        query.point = random_point(random, 3);
        if (random.next_u32() % 3 != 0) query.normal = random_unit(random);
        query.u = random.next_u32() % 8 == 0 ? 0.0f : random.next_float();
      }
      std::vector<LightTree::Choice> choices(many);
      tree.select(queries, choices.data());
      for (std::size_t i = 0; i < many; ++i) {
        const LightTree::Choice alone = tree.select(queries[i].point, queries[i].normal, queries[i].u);
        EXPECT_EQ(choices[i].light, alone.light);
        EXPECT_EQ(choices[i].probability, alone.probability);
      }
    }
  }
}

TEST(LightTree, AcceptsTheEndsOfTheUnitInterval) {
  std::vector<LightBounds> bulbs = mixed_lights(1000, 1, 5);
  for (LightBounds& bulb : bulbs) {
    bulb.theta_o = kPi;
    bulb.range = std::numeric_limits<float>::infinity();
  }
  const LightTree tree(bulbs);
  Random random(6);
  for (int p = 0; p < 200; ++p) {
    const V3f point = random_point(random, 1);
    for (const float u : {0.0f, 1e-30f, 0x1p-24f, 0.5f, kOneMinusEpsilon}) {
      const LightTree::Choice choice = tree.select(point, {0, 0, 0}, u);
      ASSERT_LT(choice.light, 1000u);
      ASSERT_GT(choice.probability, 0);
    }
  }
}

// A light that sends anything to a point must have a chance: emission within reach, above the horizon, inside the
// range.
TEST(LightTree, NeverLeavesOutALightThatReachesThePoint) {
  for (const float extent : {1e-4f, 1.0f, 1e6f}) {
    const std::vector<LightBounds> lights = mixed_lights(500, extent, 7);
    const LightTree tree(lights);
    Random random(8);
    int reached = 0;
    for (int p = 0; p < 100; ++p) {
      const V3f point = random_point(random, 1.2f * extent), normal = random_unit(random);
      for (std::uint32_t i = 0; i < lights.size(); ++i) {
        const LightBounds& light = lights[i];
        const V3d d = V3d(point) - V3d(light.box.min);  // any of its points will do
        const double distance = length(d), toward = dot(d, V3d(light.axis)) / distance;
        const double emission = light.two_sided ? std::abs(toward) : toward;
        const bool emits = light.theta_o >= kPi || emission > std::cos(double(light.theta_e));
        if (!emits || dot(d, V3d(normal)) >= 0 || distance >= light.range) continue;
        ASSERT_GT(tree.probability(point, normal, i), 0) << "light " << i << " point " << point;
        ++reached;
      }
    }
    EXPECT_GT(reached, 5000);
  }
}

// A cluster of spots that all shine down has a narrow cone of emission; a point among them lies above its centre and is
// reached all the same by the spots above the point.
TEST(LightTree, NeverLeavesOutASpotAboveThePointInsideItsCluster) {
  Random random(9);
  std::vector<LightBounds> spots(300);
  for (LightBounds& spot : spots) {
    spot.box = Box3f(random_point(random, 1));
    spot.axis = normalize(V3f(0.1f * random.next_float(), 0.1f * random.next_float(), -1));
    spot.theta_e = 0.4f;
    spot.intensity = 1;
  }
  const LightTree tree(spots);
  int reached = 0;
  for (int p = 0; p < 300; ++p) {
    const V3f point = random_point(random, 1), normal(0, 0, 1);
    for (std::uint32_t i = 0; i < spots.size(); ++i) {
      const V3d d = V3d(point) - V3d(spots[i].box.min);
      if (dot(d, V3d(spots[i].axis)) <= length(d) * std::cos(double(spots[i].theta_e))) continue;
      ASSERT_GT(tree.probability(point, normal, i), 0) << "spot " << i << " point " << point;
      ++reached;
    }
  }
  EXPECT_GT(reached, 1000);
}

TEST(LightTree, PointsInThePlaneOfAFacetKeepItAlive) {
  LightBounds facet;
  facet.box = Box3f(V3f(0, 0, 0), V3f(1, 1, 0));
  facet.intensity = 1;
  LightBounds other = facet;
  other.box = Box3f(V3f(0, 0, 5), V3f(1, 1, 5));
  const LightTree tree(std::vector<LightBounds>{facet, other});
  for (const float height : {1e-9f, 1e-6f, 1e-3f}) {
    EXPECT_GT(tree.probability({30, 0.5f, height}, {0, 0, 0}, 0), 0) << height;
    EXPECT_GT(tree.probability({0.5f, 0.5f, height}, {0, 0, 1}, 0), 0) << height;
  }
  // Well behind both: neither is selected.
  EXPECT_EQ(tree.select({0.5f, 0.5f, -10}, {0, 0, 0}, 0.5f).probability, 0);
}

TEST(LightTree, BuildsFromAwkwardSets) {
  LightBounds bulb;
  bulb.box = Box3f(V3f(1, 2, 3));
  bulb.theta_o = kPi;
  bulb.intensity = 1;
  std::vector<LightBounds> same(2000, bulb);  // all in one place: no heuristic splits them
  const LightTree stacked(same);
  EXPECT_NEAR(stacked.probability({0, 0, 0}, {0, 0, 0}, 17), 1 / 2000.0, 1e-6);

  std::vector<LightBounds> line;  // distances that double: the heuristic peels one light at a time
  for (int i = 0; i < 100; ++i) {
    LightBounds light = bulb;
    light.box = Box3f(V3f(std::ldexp(1.0f, i - 60), 0, 0));
    line.push_back(light);
  }
  const LightTree peeled(line);
  double sum = 0;
  for (std::uint32_t i = 0; i < 100; ++i) sum += peeled.probability({0, 1, 0}, {0, 0, 0}, i);
  EXPECT_NEAR(sum, 1, 1e-4);

  std::vector<LightBounds> range = {bulb, bulb, bulb};  // intensities from 1e-6 to 1e9, far apart
  range[0].intensity = 1e-6;
  range[1].intensity = 1e9;
  range[2].box = Box3f(V3f(1e7f, 0, 0));
  const LightTree wide(range);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_GT(wide.probability({5, 5, 5}, {0, 0, 0}, i), 0);
    EXPECT_TRUE(std::isfinite(wide.probability({1, 2, 3}, {0, 0, 0}, i)));  // on top of two of them
  }
}

// merge() must contain what it merges: directions of both cones.
TEST(LightTree, MergedConesContainBoth) {
  Random random(12);
  for (int i = 0; i < 2000; ++i) {
    LightBounds a, b;
    a.box = b.box = Box3f(V3f(0, 0, 0));
    a.axis = random_unit(random);
    b.axis = i % 10 == 0 ? -a.axis : i % 10 == 1 ? a.axis : random_unit(random);
    a.theta_o = kPi * sqr(random.next_float());
    b.theta_o = kPi * sqr(random.next_float());
    const LightBounds both = merge(a, b);
    EXPECT_NEAR(length(both.axis), 1, 1e-5);
    for (const LightBounds* part : {&a, &b}) {
      const Frame frame(part->axis);
      for (int k = 0; k < 8; ++k) {
        const float phi = kTwoPi * random.next_float(), theta = part->theta_o;
        const V3f w =
            frame.to_world(V3f(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
        const float angle = std::atan2(length(cross(w, both.axis)), dot(w, both.axis));
        EXPECT_LE(angle, both.theta_o + 1e-3f);
      }
    }
  }
}

TEST(LightTree, HierarchyHoldsEveryLightOnce) {
  const std::vector<LightBounds> lights = mixed_lights(777, 1, 9);
  const std::vector<LightTreeNode> nodes = build_light_hierarchy(lights);
  std::vector<int> seen(lights.size());
  for (const LightTreeNode& node : nodes) {
    if (node.leaf()) {
      ++seen[node.light];
      EXPECT_EQ(node.lights, 1u);
    } else {
      EXPECT_EQ(node.lights, nodes[node.first].lights + nodes[node.second].lights);
      for (const std::uint32_t child : {node.first, node.second}) {
        EXPECT_TRUE(node.bounds.box.intersects(nodes[child].bounds.box.min));
        EXPECT_TRUE(node.bounds.box.intersects(nodes[child].bounds.box.max));
      }
      EXPECT_NEAR(node.bounds.intensity, nodes[node.first].bounds.intensity + nodes[node.second].bounds.intensity,
                  1e-9 * node.bounds.intensity);
    }
  }
  EXPECT_EQ(nodes.size(), 2 * lights.size() - 1);
  EXPECT_EQ(nodes.front().lights, lights.size());
  for (const int count : seen) EXPECT_EQ(count, 1);
}

// Points between the ceiling, whose lamps differ in power by up to 1000, and the floor. What one light brings over its
// probability has a relative variance; that of points right below a lamp, which dominates their light, decides.
TEST(LightTree, FindsTheLampsNearby) {
  constexpr int kSide = 48;
  Random random(11);
  std::vector<LightBounds> lamps(kSide * kSide);
  for (int i = 0; i < kSide * kSide; ++i) {
    LightBounds& lamp = lamps[std::size_t(i)];
    const V3f center(float(i % kSide) + random.next_float(), 0, float(i / kSide) + random.next_float());
    lamp.box = Box3f(center - V3f(0.02f, 0, 0.02f), center + V3f(0.02f, 0, 0.02f));
    lamp.axis = V3f(0, -1, 0);
    lamp.intensity = std::pow(1000.0, random.next_double());
  }
  const LightTree tree(lamps);
  double variance = 0;
  constexpr int kPoints = 200;
  for (int k = 0; k < kPoints; ++k) {
    const V3f up(0, 1, 0), point(kSide * random.next_float(), -0.3f - 5 * random.next_float(),
                                 kSide * random.next_float());
    double sum = 0, squares = 0;
    for (std::uint32_t i = 0; i < lamps.size(); ++i) {
      const V3f d = lamps[i].box.center() - point;
      const double squared = length_squared(d), brings = lamps[i].intensity * d.y * d.y / (squared * squared);
      sum += brings;
      squares += brings * brings / double(tree.probability(point, up, i));
    }
    variance += (squares / (sum * sum) - 1) / kPoints;
  }
  EXPECT_LT(variance, 0.65);  // 0.53; 0.86 with clusters of many lights spread as those of few are
}

}  // namespace
}  // namespace helio
