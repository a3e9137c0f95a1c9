// Which pixels show more than the surfaces that centres tell of: a lamp smaller than a pixel, leaves, stairs far away.
// Every sample's first hit is held against what its pixel's centre meets, as pixels are against each other
// (surface_steps.h): another instance, a normal more than 37 degrees off, or a step of more than a pixel's side. One
// sample that differs is enough, so what covers a share p of a pixel is found by n samples with probability
// 1 - (1 - p)^n. A sample that differs is traced once more under the centres' chance: a pane that lets every other one
// through is one surface all the same. What shows in mirrors, behind panes and in shadows is not found.
//
// What was looked up for a mixed pixel (trace/reuse/reprojection.h) says what the pixel would be without what hides in
// it. A half drops that with its first sample that differs; until then it has met nothing else, and neither has
// history, so that its mean is what fresh samples make it, whichever way. The other half finds out for itself, but for
// a pixel's very first sample: then the other half has none, and what it carries goes, too, lest it weigh as much as
// that sample. Pixels that get no sample keep what was looked up.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/trace/paths/path_kernel.h"

namespace helio {

struct PathGroup;

// Of the samples of one piece.
class PartialCoverage {
 public:
  static constexpr std::uint32_t kNone = ~0u;

  // Asks of those pixels of the task's window whose centres are known and of which there is something to find out.
  explicit PartialCoverage(const WindowTask& task);

  // The camera rays of the group, all of the sample of this index, have been traced.
  void look(const PathGroup& group, std::uint32_t sample);

  bool any() const { return !centres_.empty(); }
  // Of a pixel of the window, row-major: the first sample that differs. Precondition: any().
  std::uint32_t first(std::size_t pixel) const { return centres_[pixel].first; }
  // Notes it in the film, before that sample enters it. Returns the carried samples that were dropped.
  std::uint64_t tell(int x, int y, std::uint32_t sample);

  std::uint64_t rays() const { return rays_; }

 private:
  struct Centre {
    std::uint32_t instance;
    V3f origin, direction;  // from where it is seen
    V3f normal;             // geometric, towards the viewer
    float distance, step;   // to its surface | side of a pixel there
    bool asked = false;
    std::uint32_t first = kNone;
  };

  static bool differs(const SceneData& scene, const Centre& centre, const Ray& ray, const Hit& hit);

  const SceneData& scene_;
  Film& film_;
  int half_;
  PixelRect window_;
  std::vector<Centre> centres_;  // of the window's pixels, row-major; empty: nobody asks
  std::uint64_t rays_ = 0;
};

}  // namespace helio
