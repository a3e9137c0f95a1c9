// Reprojection as published (Schalk 2018, section 3.2): the baseline of trace/reuse/reprojection.h. Biased, and nothing
// bounds it: bias that each step adds is neither estimated nor carried.
//
// Forward mapping. Each stored first hit of a pixel is looked at from the new camera. Its pixel is copied, with all of
// its samples at once, to where that sees it, if
//   - it is on the film, inside the region (first validation),
//   - a ray from the new camera towards it meets a surface within kVerification of its distance (second),
//   - the surface there is neither specular nor refractive, and eq. 15 stays within the maximum (third; view_error.h),
//   - its pixel's samples met points close to each other (distance test, 3.2.2; first_hits.h).
// Everything else starts over.
//
// Where the text leaves it open, this is how it was read:
//   - Of four stored hits each one asks for a pixel: "the chance that a pixel reprojects at least one value increases".
//     Samples of one pixel may so be copied into several. They are the pixel's own first samples, wherever in it these
//     were: with one, and a view that is shifted by a share f of a pixel, f (1 - f) of the pixels are asked for by
//     nobody and start over, up to a third when it is shifted along both axes.
//   - Where several pixels ask for one, the nearest surface gets it, then the first pixel (the paper's GPU leaves that
//     to the last thread).
//   - V_t-1 is the camera of the picture before, so the error is that of one step: over many small steps it adds up
//     unseen.
//   - Stored hits, N and the mean irradiance come with the pixel and are not replaced: "stored when not yet
//     reprojected".
//   - A hit without a sampled direction L is copied from surfaces that look the same from everywhere, and from others
//     only while the camera stays where it is.
//   - What leaves the scene has no intersection point, and starts over.
// The paper's pixels are boxes and its camera is a pinhole: other filters and lenses start over.
#pragma once

#include <memory>

#include "renderer/frame/paper/first_hits.h"
#include "renderer/trace/accel/accel.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/camera/camera_projection.h"
#include "renderer/trace/reuse/reprojection.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

// "A chosen value epsilon": how far from the stored hit the verification ray may end, as a share of its length.
inline constexpr float kVerification = 1e-3f;
// 1/256: "the smallest integer value difference that can be visualized on most of the standard monitors".
inline constexpr float kPaperMaxError = 1.0f / 256;

bool can_reproject_forward(const CameraPose& pose, const PixelFilter& filter);

// Two sweeps over windows of a film, to be shared between threads: run project() of every window of the picture that
// was left (FirstHits::left()), then carry() of every window of the film. Windows are disjoint, lie in the
// region and are cut at multiples of kFilmBlock. The bits depend neither on the order nor on how it was cut.
class ForwardReprojection {
 public:
  // The film has history and first hits, and outlives this. max_error: of eq. 15, radiance, > 0.
  ForwardReprojection(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                      const CameraPose& from, const CameraPose& to, float max_error);

  // Traces the verification rays of the window's stored hits and bids for their pixels.
  void project(const PixelRect& window, ReprojectionStats& stats);
  // Clears the window and fills it with what bade for it. Precondition: project() of everything.
  void carry(const PixelRect& window, ReprojectionStats& stats);

 private:
  struct Batch;
  bool accepts(const Ray& ray, const Hit& hit, const LeftPicture::Pixel& pixel, const StoredHit* directed) const;
  void verify(Batch& batch, ReprojectionStats& stats);

  std::shared_ptr<const RenderScene> scene_;
  Film& film_;
  PixelRect region_;
  Camera camera_;
  CameraProjection projection_;
  V3f viewpoint_, view_direction_;  // of the picture that was left; towards it where that is infinitely far
  bool same_viewpoint_, far_away_;
  float max_error_;
};

}  // namespace helio
