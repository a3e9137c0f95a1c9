// What the rays through the centres of pixels meet: a picture's surfaces without noise, for reprojection.
#pragma once

#include <memory>

#include "renderer/film/core/film.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/gbuffer/view_reweighting.h"
#include "renderer/trace/gbuffer/weighed_directions.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {

class BsdfViews;

// Rays that meet surfaces with chance let the same ones through for all centres.
inline constexpr std::uint32_t kCentreAlphaKey = 0x9e3779b9u;

// The instance and normal of what a ray has met; of nothing: those of a CentreHit by default.
CentreHit surface_at(const SceneData& scene, const Ray& ray, const Hit& hit);

// Of one block of the film at a time. Not thread safe.
class PrimaryHits {
 public:
  // axis: the camera's, unit.
  PrimaryHits(const RenderScene& scene, const Camera& camera, const V3d& axis);
  ~PrimaryHits();
  PrimaryHits(const PrimaryHits&) = delete;
  PrimaryHits& operator=(const PrimaryHits&) = delete;

  // Traces the pixels of `window`, as one packet after the other. It is at most as large as a block of the film, and
  // lies in one where evidence_from() is asked; outside the film there are pixels, too.
  void trace(const PixelRect& window);

  // Of the pixel, which lies in the window that was traced last. The pixel in hand from now on.
  CentreHit at(int x, int y);

  // Of the pixel in hand, as a path's first hit there would have them.
  const PixelFeatures& features() const;

  // Whether the surface of the pixel in hand may look different from elsewhere.
  bool depends_on_view() const;

  // Whether textures make the surface of the pixel in hand scatter otherwise than next to it.
  bool textured() const;

  // How the light that the surface of the pixel in hand sends to this camera compares to what it sends to `viewpoint`
  // (rebased), given directions wi that light which arrived there came from, picked in proportion to what they counted
  // there (light_reweighting.h). Afterwards they are distinct, and each weighs what it counts for this camera; where
  // nobody can tell, what it counted. `unseen` is the change of a few directions of the BSDF's own sampling, for there
  // may be light that none of these has met (eq. 15 of Schalk 2018 without the irradiance, for any BSDF; of the like
  // surface of one of 4x4 pixels, the first that asked). Light of delta lobes may change altogether. Precondition:
  // depends_on_view().
  ViewEvidence evidence_from(const V3f& viewpoint, WeighedDirections& directions) const;

  // The material of what that pixel's centre meets; -1: nothing.
  int material(int x, int y) const;

 private:
  struct Block;
  // lobe_change(), of the pixel in hand or one next to it.
  void ask_lobes(const V3f& viewpoint, const BsdfViews& views, const V3f& from, ViewEvidence& told) const;
  // Of the surface in hand, new over old. from: local, where the old viewpoint is, as the second of `views` has it.
  Rgb albedo_change(const BsdfViews& views, const V3f& from) const;

  const SceneData& scene_;
  const Camera& camera_;
  const V3f axis_;
  const bool only_lambert_;
  std::unique_ptr<Block> block_;
};

}  // namespace helio
