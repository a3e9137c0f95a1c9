// Visibility: what the ray through each pixel's centre meets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "renderer/preview/preview_history.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class SurfacePass {
 public:
  // colors: that light is divided by; null: by none. All outlive this.
  SurfacePass(const RenderScene& scene, const Camera& camera, const SurfaceColors* colors, PreviewHistory& history)
      : scene_(scene.impl()), camera_(camera), colors_(colors), history_(history) {}

  // Pixels of a block of at most kPathGroupSize a side: `current` and colours. What shines has its own light and
  // kExactSamples, all else no light and no samples. Thread safe for different blocks. Returns the rays traced.
  std::uint64_t run(const PixelRect& block) const;

  // The same of any pixels of the film, at most kMostAtOnce, to pixels[i] and colors[i].
  static constexpr std::size_t kMostAtOnce = 256;
  void trace(std::span<const PixelPosition> at, PreviewPixel* pixels, std::uint32_t* colors) const;
  // Of a pixel whose ray meets nothing.
  void note_miss(const PixelPosition& at, PreviewPixel& pixel, std::uint32_t& color) const;

 private:
  Ray centre_ray(const PixelPosition& at) const;
  void note(const Ray& ray, const Hit& hit, SurfaceColors::Recent& recent, PreviewPixel& pixel,
            std::uint32_t& color) const;

  const SceneData& scene_;
  const Camera& camera_;
  const SurfaceColors* const colors_;
  PreviewHistory& history_;
};

}  // namespace helio
