// Which pixels show more than the surfaces that centres tell of: a lamp smaller than a pixel, leaves, stairs far away.
// Every sample's first hit is held against what its pixel's centre meets, as pixels are against each other
// (surface_steps.h): another instance, a normal more than 37 degrees off, or a step of more than a pixel's side. One
// sample that differs is enough, so what covers a share p of a pixel is found by n samples with probability
// 1 - (1 - p)^n, and what none has met is in none of their radiances. A sample that differs is traced once more under
// the centres' chance: a pane that lets every other one through is one surface all the same.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/film.h"
#include "renderer/trace/path_kernel.h"

namespace helio {

struct PathGroup;

// Of the samples of one piece.
class MixedPixels {
 public:
  // Asks of those pixels of the task's window whose centres are known and that are not known to be mixed.
  explicit MixedPixels(const WindowTask& task);

  // The camera rays of the group have been traced.
  void look(const PathGroup& group);
  // Notes what was found (CarriedPixel::mixed()). Thread safe beside pieces of the other half.
  void commit();

 private:
  struct Centre {
    std::uint32_t instance;
    V3f origin, offset;  // from where it is seen, and to where its surface lies from there
    V3f normal;          // geometric, towards the viewer
    float step;          // side of a pixel there
    bool asked = false, mixed = false;
  };

  static bool differs(const SceneData& scene, const Centre& centre, const Ray& ray, const Hit& hit);

  const SceneData& scene_;
  Film& film_;
  PixelRect window_;
  std::vector<Centre> centres_;  // of the window's pixels, row-major; empty: nobody asks
};

}  // namespace helio
