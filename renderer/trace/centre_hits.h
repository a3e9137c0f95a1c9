// What the rays through the centres of pixels meet: a picture's surfaces without noise, for reprojection.
#pragma once

#include <memory>
#include <span>

#include "renderer/film/film_history.h"
#include "renderer/trace/bsdf.h"
#include "renderer/trace/camera.h"
#include "renderer/trace/path_integrator.h"
#include "renderer/trace/scene_data.h"

namespace helio {

// Of one block of the film at a time. Not thread safe.
class CentreHits {
 public:
  // axis: the camera's, unit.
  CentreHits(const RenderScene& scene, const Camera& camera, const V3d& axis);
  ~CentreHits();
  CentreHits(const CentreHits&) = delete;
  CentreHits& operator=(const CentreHits&) = delete;

  // Traces the pixels of `window`, at most kPathGroupSize on a side, as one packet after the other.
  void trace(const PixelRect& window);

  // Of the pixel, which lies in the window that was traced last.
  //
  // view_changes[i]: how much of what its surface sends to this camera depends on where that is, when it is looked at
  // from viewpoints[i] (rebased) instead: 0 for a diffuse one, up to 1. Four directions wi of the BSDF's own sampling,
  // and of each the change of f(wo, wi), as a share of the whole; delta lobes change altogether. This is eq. 15 of
  // Schalk 2018 without the irradiance, for any BSDF, over several wi.
  CentreHit at(int x, int y, std::span<const V3f> viewpoints, float* view_changes) const;

  // The material of what that pixel's centre meets; -1: nothing.
  int material(int x, int y) const;

 private:
  struct Block;
  const SceneData& scene_;
  const Camera& camera_;
  const V3f axis_;
  const bool only_lambert_;
  std::unique_ptr<Block> block_;
};

}  // namespace helio
