// One of the ways in which bidirectional path tracing makes a path, to look at what it does alone.
#pragma once

namespace helio {

// All paths of s light and t camera vertices, the points on the light and on the camera among them (Veach 1997, 10.2):
// s + t - 1 segments. s = 0: a camera path meets a light, or leaves for the environment, t >= 2; s = 1: a light sample,
// t >= 2 (lights seen directly come from s = 0 alone); t = 1: a light path is joined to the camera, s >= 2.
struct Technique {
  int light_vertices = 0;   // s
  int camera_vertices = 2;  // t
  // With the weight 1: the estimate by this technique alone, of the paths that it can make (no setting: tests ask for
  // it). Else with its weight among all techniques: the pictures of all of them add up to that of bdpt with one seed.
  bool unweighted = false;

  int segments() const { return light_vertices + camera_vertices - 1; }
  // Whether this renderer has the technique.
  bool exists() const {
    return light_vertices >= 0 && camera_vertices >= 1 && segments() >= 1 &&
           (light_vertices > 1 || camera_vertices > 1);
  }
  bool operator==(const Technique&) const = default;
};

}  // namespace helio
