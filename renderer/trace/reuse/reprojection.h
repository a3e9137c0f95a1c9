// Carries what earlier pictures know into a film that a new camera looks through.
//
// Reverse mapping (Nehab et al. 2007): the ray through the centre of each new pixel finds its surface; where an earlier
// camera saw that point, the four pixels around it are looked up, those that show the same surface (same instance,
// similar normal, the point within half a pixel of the plane through what the pixel's centre met), bilinearly, their
// radiance over their albedo. Next to where two surfaces meet pixels may show both: they neither give nor take
// anything, for Sobol points find out about edges sooner than interpolation is right about them; what lies just outside
// the region counts there. With a box filter about half of these pixels turn out to show one surface after all, once
// the rays along their rims are traced (silhouette_coverage.h); they are used like any other, unless one of the
// surfaces emits. Samples find what is smaller than that (partial_coverage.h): a pixel whose samples met another
// surface than its centre is looked up by none that shows part of it, and history of a pixel that turns out to be one
// is dropped. The rays of the new picture are the verification: a point that another surface hid from the earlier
// camera finds no pixel that shows it. A camera that comes back to where a picture was taken, to the bit, or that stays
// while the scene is edited, finds it pixel by pixel as it was, those on borders if all that their filter reaches shows
// what it showed. Pixels at the edge of the region are not restored from pictures taken before an edit of visible
// surfaces, because what lay beside the picture then is unknown.
//
// What that may add to the error is estimated and carried (CarriedPixel::bias2), as squares of
//   - resampling, between pixels and between sizes of pixels: by the squared second differences around there
//     (resampling_error2() of history_sample.h),
//   - lookups beside their point, where only some of the four pixels could be used: first differences times distance,
//   - change of view where the camera has moved and not merely turned: what the surface sends to the new camera instead
//     of the old one is worked out from directions that light came from (DirectionReservoir,
//     PrimaryHits::evidence_from, view_reweighting.h), and how far that may be off is carried; for light
//     from directions that the reservoir does not hold, the old picture's mean radiance is assumed, with an error of
//     half of it,
//   - what was carried before: bounds add up, not their squares, for what a steady motion adds has the same sign at
//     every step,
//   - edits of the scene since then, which are among it (trace/reuse/history_invalidation.h).
// Bias b and variance of one sample v cap what history counts: N = 1 / (1 / N_0 + b^2 / v), N_0: samples behind the
// lookup. That is the weight against fresh samples that makes the squared error smallest. Where the change of view is
// known so badly that b is more than half of the mean, nothing counts. Where the interpolated pixels differ in the
// variance of their samples, the new pixel's may be that of any of them, so the part of b that interpolation brings is
// held against the geometric mean of their variances, not their mean (LookupSums::weigh()).
//
// What was traced for one half and for the other never meets, so the halves stay independent, but for the directions,
// which say together how the view has changed. Which lineage is the film's first half alternates from picture to
// picture: a camera that moves on after every sample, which may be one of the first half alone, feeds both. Cameras
// with a lens do not take part, nor do filters that reach beyond eight pixels.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "renderer/film/history/history_source.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/gbuffer/gbuffer_pass.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// A picture that was left, and the camera that saw it.
struct PictureSource {
  CameraPose pose;
  const HistorySource* pixels = nullptr;
  // Later sources are consulted only for pixels where this one has fewer effective samples, both halves.
  float enough = 0;
  bool swap = false;  // what was traced for its first half is carried into the film's second, and the reverse
  // Surfaces or the environment were edited since (HistoryInvalidation): nobody knows what was beside the picture then.
  bool edited = false;
};

class HistoryView;

struct ReprojectionStats {
  std::uint64_t rays = 0;     // of the verification: through pixel centres, and of what edits have changed
  std::uint64_t carried = 0;  // pixels that drew on history
  double samples = 0;         // that they got, both halves
  void add(const ReprojectionStats& other);
};

// Whether pictures of such a camera can be drawn on, and drawn from others.
bool can_reproject(const CameraPose& pose, const PixelFilter& filter);

// Three sweeps over windows of a film, to be shared between threads: carry() of every window, then find_borders() of
// every window, then settle(). What a window's sweep needs of the one before lies within kMostReach pixels of it.
// Windows are disjoint and lie in the region. The bits do not depend on how it was cut along blocks of the film.
class Reprojection {
 public:
  // The film, which must have history, and the sources outlive this. Sources come in the order of preference where they
  // know equally much. At most kMostSources. All have the film's size.
  Reprojection(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region, const CameraPose& pose,
               const PixelFilter& filter, std::vector<PictureSource> sources);

  static constexpr std::size_t kMostSources = 2;
  static constexpr int kMostReach = 8;  // of filters

  struct Glance {
    std::uint64_t asked = 0, known = 0;  // pixels
  };
  // How much of the window sources know, as far as one pixel in 64 tells (more of small films): what they have there,
  // if one was seen by the same camera. More than is carried in the end, which borders take back from. Changes nothing.
  Glance glance(const PixelRect& window, ReprojectionStats& stats) const;
  // In place of the sweeps where can_reproject() says no: nothing is carried, and what centres meet is not known.
  void clear(const PixelRect& window);

  // Clears the window, finds its centre hits, and fills it with what the sources know of them.
  void carry(const PixelRect& window, ReprojectionStats& stats);
  // GbufferPass::find_borders().
  void find_borders(const PixelRect& window, ReprojectionStats& stats);
  // Takes back what was carried there, and gives it what only whole neighbourhoods tell.
  void settle(const PixelRect& window, ReprojectionStats& stats);

 private:
  class Seeker;

  void prepare_lookups() const;
  std::vector<HistoryView> views() const;  // by source

  Film& film_;
  GbufferPass centres_;
  std::vector<PictureSource> sources_;
  std::uint32_t key_ = 0;  // of the view, for choices by chance
  // By source, made by the first sweep that needs it: mean radiance of what it shows, beside lamps, where the camera
  // has moved.
  mutable std::once_flag prepared_;
  mutable Rgb light_[kMostSources];
};

}  // namespace helio
