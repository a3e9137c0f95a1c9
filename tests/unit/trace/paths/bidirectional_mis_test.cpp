// The recursion of the weights against the densities themselves, multiplied out for every technique.
#include "renderer/trace/paths/bidirectional_mis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace helio {
namespace {

// A path x_0 (light) to x_k (camera) with made-up densities; edge i leads from x_i to x_(i+1).
struct MadeUpPath {
  struct Edge {
    double distance, cos_from, cos_to;  // at x_i and at x_(i+1)
  };
  struct Vertex {
    double forward, reverse;  // densities of going on to the camera's side, and to the light's
    bool delta = false;
  };
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;  // 1 to k - 1 are surfaces
  double pdf_emission = 1, pdf_direct = 1, density = 1;
  TechniqueCounts counts;
  bool delta_light = false, finite_light = true, finite_camera = true;

  int segments() const { return int(edges.size()); }
  // What turns the direction from one end of edge i to the other into an area there.
  double onto_camera_side(int i) const { return edges[i].cos_to / measure(i); }
  double onto_light_side(int i) const { return edges[i].cos_from / measure(i); }
  double measure(int i) const {
    const bool parallel = (i == 0 && !finite_light) || (i == segments() - 1 && !finite_camera);
    return parallel ? 1 : edges[i].distance * edges[i].distance;
  }
  double forward(int i) const { return vertices[i].delta ? 1 : vertices[i].forward; }
  double reverse(int i) const { return vertices[i].delta ? 1 : vertices[i].reverse; }

  // Of a light path that gets to x_i.
  double light_density(int i) const {
    double p = pdf_emission * onto_camera_side(0);
    for (int j = 1; j < i; ++j) p *= forward(j) * onto_camera_side(j);
    return p;
  }
  // Of a camera path that gets to x_i.
  double camera_density(int i) const {
    double p = density * onto_light_side(segments() - 1);
    for (int j = segments() - 1; j > i; --j) {
      // The environment is met in a direction, not at a point.
      p *= reverse(j) * (j == 1 && !finite_light ? 1 : onto_light_side(j - 1));
    }
    return p;
  }

  // Density of the path made with s vertices by a light path, times the number of tries; 0: it cannot be.
  double density_of(int s) const {
    const int k = segments(), t = k + 1 - s;
    if (s == k + 1) return 0;
    if (s == 0 && delta_light) return 0;
    if (s == k && k == 1) return 0;  // a light is not joined to the camera
    // Joined vertices must not be deltas.
    if (s >= 2 && vertices[s - 1].delta) return 0;
    if (s >= 1 && t >= 2 && vertices[s].delta) return 0;
    double p = 1;
    if (s == 1) p = pdf_direct * (delta_light || !finite_light ? 1 : onto_light_side(0));
    if (s >= 2) p = light_density(s - 1);
    if (t == 1) return p * counts.light_paths;
    if (s >= 2) p *= counts.connections;
    return p * camera_density(s);
  }

  // The same of a path that is merged at x_i.
  double merging_density(int i) const {
    return vertices[i].delta ? 0 : light_density(i) * camera_density(i) * counts.merging;
  }

  // Of the technique that has this density.
  double exact_weight(double own) const {
    double sum = 0;
    for (int other = 0; other <= segments(); ++other) sum += mis_ratio(density_of(other), own);
    for (int i = 1; i < segments(); ++i) sum += mis_ratio(merging_density(i), own);
    return 1 / sum;
  }

  double cos_light() const { return finite_light && !delta_light ? edges[0].cos_from : 1; }

  // Of the light path that has just arrived at x_i.
  MisState light_state(int at) const {
    MisState mis = MisState::light(pdf_emission, cos_light(), delta_light);
    mis.arrive_from_light(edges[0].distance, edges[0].cos_to, finite_light, delta_light, pdf_direct, pdf_emission,
                          cos_light());
    for (int i = 1; i < at; ++i) {
      if (vertices[i].delta)
        mis.scatter_delta(edges[i].cos_from);
      else
        mis.scatter(vertices[i].forward, vertices[i].reverse, edges[i].cos_from, counts);
      mis.arrive(edges[i].distance, edges[i].cos_to, true);
    }
    return mis;
  }

  // Of the camera path at x_i; at 0 of one that meets an environment nothing turns its direction into an area.
  MisState camera_state(int at) const {
    MisState mis = MisState::camera(density, counts.light_paths);
    for (int i = segments() - 1;; --i) {
      if (i > 0 || finite_light) mis.arrive(edges[i].distance, edges[i].cos_from, i < segments() - 1 || finite_camera);
      if (i == at) return mis;
      if (vertices[i].delta)
        mis.scatter_delta(edges[i - 1].cos_to);
      else
        mis.scatter(vertices[i].reverse, vertices[i].forward, edges[i - 1].cos_to, counts);
    }
  }

  double weight(int s) const {
    const int k = segments(), t = k + 1 - s;
    if (s == 0) {
      return weight_of_hit(camera_state(0), pdf_direct * (finite_light ? onto_light_side(0) : 1), pdf_emission, counts);
    }
    if (t == 1) {
      return weight_of_splat(light_state(k - 1), density * onto_light_side(k - 1), vertices[k - 1].reverse, counts);
    }
    if (s == 1) {
      return weight_of_light_sample(camera_state(1), pdf_direct, pdf_emission, delta_light,
                                    finite_light ? edges[0].distance : std::numeric_limits<double>::infinity(),
                                    cos_light(), edges[0].cos_to, vertices[1].reverse, vertices[1].forward, counts);
    }
    const int light = s - 1, camera = s;
    return weight_of_connection(camera_state(camera), light_state(light),
                                vertices[light].forward * onto_camera_side(light), vertices[camera].forward,
                                vertices[camera].reverse * onto_light_side(light), vertices[light].reverse, counts);
  }

  double merging_weight(int i) const {
    return weight_of_merging(camera_state(i), light_state(i), vertices[i].forward, vertices[i].reverse, counts);
  }
};

class RandomPaths {
 public:
  MadeUpPath make(int segments) {
    MadeUpPath path;
    for (int i = 0; i < segments; ++i) path.edges.push_back({spread(3), spread(1, true), spread(1, true)});
    for (int i = 0; i <= segments; ++i) path.vertices.push_back({spread(8), spread(8)});
    path.pdf_emission = spread(8);
    path.pdf_direct = spread(8);
    path.density = spread(1e6);
    path.counts.light_paths = 65536;
    return path;
  }
  // Log-uniform over [1 / range, range], or cosines in [range / 1000, range].
  double spread(double range, bool cosine = false) {
    const double u = std::uniform_real_distribution<double>(cosine ? 0 : -1, 1)(generator_);
    return cosine ? std::pow(1e-3, u) : std::pow(range, u);
  }
  std::mt19937_64 generator_{7};
};

void expect_exact(const MadeUpPath& path) {
  double sum = 0;
  for (int s = 0; s <= path.segments(); ++s) {
    if (path.density_of(s) == 0) continue;
    const double weight = path.weight(s);
    EXPECT_NEAR(weight, path.exact_weight(path.density_of(s)), 1e-9)
        << "s " << s << " of " << path.segments() << " segments";
    sum += weight;
  }
  for (int i = 1; i < path.segments(); ++i) {
    if (path.merging_density(i) == 0) continue;
    const double weight = path.merging_weight(i);
    EXPECT_NEAR(weight, path.exact_weight(path.merging_density(i)), 1e-9) << "merged at " << i;
    sum += weight;
  }
  if (sum > 0) {
    EXPECT_NEAR(sum, 1, 1e-9);
  }
}

TEST(BidirectionalMis, WeightsAreThoseOfTheDensities) {
  RandomPaths random;
  for (int n = 0; n < 2000; ++n) expect_exact(random.make(2 + n % 8));
}

TEST(BidirectionalMis, ManyConnectionsAndMerging) {
  RandomPaths random;
  for (int n = 0; n < 4000; ++n) {
    MadeUpPath path = random.make(2 + n % 8);
    path.counts.connections = random.spread(16);
    path.counts.merging = n % 2 == 0 ? 0 : random.spread(1e4);
    path.delta_light = n % 3 == 0;
    path.finite_light = n % 5 != 0;
    path.finite_camera = n % 7 != 0;
    for (int i = 1; i < path.segments(); ++i) path.vertices[i].delta = random.spread(1, true) < 0.02;
    expect_exact(path);
  }
}

TEST(BidirectionalMis, LightsThatCannotBeMet) {
  RandomPaths random;
  for (int n = 0; n < 1000; ++n) {
    MadeUpPath path = random.make(2 + n % 5);
    path.delta_light = true;
    expect_exact(path);
  }
}

TEST(BidirectionalMis, LightFromInfinity) {
  RandomPaths random;
  for (int n = 0; n < 2000; ++n) {
    MadeUpPath path = random.make(2 + n % 5);
    path.finite_light = false;
    path.delta_light = n % 2 == 1;
    expect_exact(path);
  }
}

TEST(BidirectionalMis, OrthographicCameras) {
  RandomPaths random;
  for (int n = 0; n < 1000; ++n) {
    MadeUpPath path = random.make(2 + n % 5);
    path.finite_camera = false;
    expect_exact(path);
  }
}

TEST(BidirectionalMis, MirrorsAreJoinedToNothing) {
  RandomPaths random;
  for (int n = 0; n < 4000; ++n) {
    MadeUpPath path = random.make(2 + n % 6);
    for (int i = 1; i < path.segments(); ++i) path.vertices[i].delta = random.spread(1, true) < 0.05;
    expect_exact(path);
  }
}

TEST(BidirectionalMis, ExtremesGiveWeights) {
  RandomPaths random;
  for (int n = 0; n < 2000; ++n) {
    MadeUpPath path = random.make(3 + n % 4);
    path.edges[n % 3].distance = n % 2 == 0 ? 1e-12 : 1e12;
    path.edges[(n + 1) % 3].cos_to = n % 5 == 0 ? 0 : 1e-20;
    path.vertices[1].forward = n % 3 == 0 ? 1e30 : 1e-30;
    path.pdf_direct = n % 7 == 0 ? 1e30 : 0;
    for (int s = 0; s <= path.segments(); ++s) {
      if (path.density_of(s) == 0) continue;
      const double weight = path.weight(s);
      EXPECT_TRUE(weight >= 0 && weight <= 1) << weight << " of s " << s;
    }
  }
}

// What no camera path finds is worth more than any noise: a thousandth of the light weighs as an error of one.
TEST(RareSquares, CountWhatThePathTracerLeavesOut) {
  EXPECT_DOUBLE_EQ(rare_squares(2, 0.5, 4, 0).path, 2 * 2 / (0.5 * 2));
  EXPECT_EQ(rare_squares(2, 0.5, 4, 3).path, 0) << "not rare";
  EXPECT_EQ(rare_squares(2, 0, 4, 0).path, 0);
  EXPECT_GE(rare_squares(1e-3, 1, 0, 30).path, 0.99);
}

// What is found by the path tracer's own techniques is as rare in either picture; squares begin at that of `rare`.
TEST(RareSquares, AreAlikeWhereBothTechniquesFindAlike) {
  const RareSquares found = rare_squares(5, 1, 1, 3);
  EXPECT_DOUBLE_EQ(found.path, 5 * 5 - 3 * 3);
  EXPECT_DOUBLE_EQ(found.bdpt, found.path);
  EXPECT_EQ(rare_squares(2, 0.01, 1, 3).bdpt, 0) << "a small weight takes away what is rare";
  EXPECT_GT(rare_squares(2, 0.01, 1, 3).path, 100);
}

// No light path leaves along its light's surface: none of the techniques that begin with one could have made the path,
// whose cosine at the light is rounded to 0.
TEST(BidirectionalMis, ALightSeenEdgeOnIsWeighedAgainstHitsAlone) {
  RandomPaths random;
  for (int i = 0; i < 1000; ++i) {
    const MadeUpPath path = random.make(2 + i % 4);
    TechniqueCounts counts = path.counts;
    if (i % 2) counts.merging = 3.6e9;
    const double forward = path.vertices[1].reverse, reverse = path.vertices[1].forward;
    const double weight =
        weight_of_light_sample(path.camera_state(1), path.pdf_direct, 0, false, path.edges[0].distance, 0,
                               path.edges[0].cos_to, forward, reverse, counts);
    EXPECT_DOUBLE_EQ(weight, 1 / (1 + mis_ratio(forward, path.pdf_direct))) << i;
  }
}

}  // namespace
}  // namespace helio
