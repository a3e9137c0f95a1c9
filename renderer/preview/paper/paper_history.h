// What published previews remember from one to the next (paper_preview.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/published_foveation.h"
#include "renderer/preview/paper/kernel_log_polar.h"
#include "renderer/preview/paper/retention.h"
#include "renderer/preview/preview_pixel.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

// A pixel of the kernel log-polar buffer, or of the disk.
struct PaperSample {
  Rgb light{0, 0, 0};
  float x = 0, y = 0;  // where its ray goes through the film, pixels
  PreviewPixel surface;  // depth, surface and normal
  bool traced = false;
};

// Sums of a blur along one axis: light and the weights of the samples that there are.
struct BlurSum {
  Rgb light{0, 0, 0};
  float weight = 0;
};

class PaperHistory {
 public:
  // Takes bytes() of memory. Throws std::bad_alloc.
  PaperHistory(int width, int height) {
    const std::size_t pixels = std::size_t(width) * std::size_t(height);
    const KernelLogPolar map(width, height, 0, 0);
    const std::size_t buffer = std::size_t(map.columns()) * std::size_t(map.rows());
    for (Side* side : {&now, &before}) {
      side->samples.resize(buffer + pixels);
      side->surfaces.resize(pixels);
      side->shown.resize(pixels);
      side->upscaled.resize(pixels);
    }
    sums.resize(buffer);
    places.resize(pixels);
    motion.resize(pixels);
    colors.resize(pixels);
    looked_up.resize(pixels);
  }

  // All samples in the worst case: a disk over all of the picture, and the buffer.
  static std::size_t bytes(int width, int height) {
    const KernelLogPolar map(width, height, 0, 0);
    const std::size_t pixels = std::size_t(width) * std::size_t(height);
    const std::size_t buffer = std::size_t(map.columns()) * std::size_t(map.rows());
    constexpr std::size_t of_side = sizeof(PreviewPixel) + 2 * sizeof(Rgb);
    constexpr std::size_t alone = sizeof(std::uint32_t) + sizeof(V2f) + 2 * sizeof(Rgb);
    return 2 * (buffer + pixels) * sizeof(PaperSample) + buffer * sizeof(BlurSum) + pixels * (2 * of_side + alone);
  }

  // One preview.
  struct Side {
    bool known = false;  // the preview is whole; false: its pixels mean nothing
    std::weak_ptr<const RenderScene> scene;
    CameraPose camera;
    PixelRect region, film_region;  // of the picture that is rendered, whose rows the pixels below are of | of the film
    int width = 0, height = 0;
    double gaze_x = 0, gaze_y = 0;
    PixelRect disk;  // window of the samples behind those of the buffer, row-major
    double radius = 0;
    std::vector<PaperSample> samples;
    std::vector<PreviewPixel> surfaces;  // of the nearest sample
    std::vector<Rgb> shown;              // after temporal anti-aliasing
    std::vector<Rgb> upscaled;           // film's size
  };
  Side now, before;
  std::vector<BlurSum> sums;  // of the buffer, along its columns
  // Of each pixel its column and row in the buffer, in 65,536ths of all.
  std::vector<std::uint32_t> places;
  struct PlacesOf {
    int width = 0, height = 0;
    double gaze_x = 0, gaze_y = 0;
    PixelRect region;
    bool operator==(const PlacesOf&) const = default;
  };
  std::optional<PlacesOf> places_of;  // none: of no picture
  std::vector<V2f> motion;            // eq. 4.6: to where the pixel was, pixels
  std::vector<Rgb> colors, looked_up;  // new | of the history there; not a number: none
  PictureRate rate;
  std::uint32_t picture = 0;  // counts previews

  void forget() {
    for (Side* side : {&now, &before}) {
      side->known = false;
      side->scene.reset();
    }
  }
};

}  // namespace helio
