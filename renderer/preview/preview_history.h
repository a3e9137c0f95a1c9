// What a session's previews remember from one to the next: the light of the picture at which the camera rested last,
// that of the newest preview, and how long their parts take.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/base/gaze_density.h"
#include "renderer/base/math.h"
#include "renderer/preview/preview_pixel.h"
#include "renderer/preview/surface_colors.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

// Where pixels are seen from.
struct PreviewView {
  std::shared_ptr<const RenderScene> scene;
  CameraPose camera;  // fitted()
  PixelRect region;
};

// Pixels, and where they were seen from; a scene that nobody else uses any more is let go.
struct PreviewBuffer {
  std::vector<PreviewPixel> pixels;
  bool known = false;  // false: the pixels are of no view
  std::weak_ptr<const RenderScene> scene;
  CameraPose camera;
  PixelRect region;

  void set_view(const PreviewView& view) {
    known = true;
    scene = view.scene;
    camera = view.camera;
    region = view.region;
  }
  void forget() {
    known = false;
    scene.reset();
  }
  // The other's view, which it forgets: its pixels have been taken over.
  void take_view(PreviewBuffer& other) {
    known = other.known;
    scene = std::move(other.scene);
    camera = other.camera;
    region = other.region;
    other.forget();
  }
};

// A pixel between two levels of the filter.
struct FilteredPixel {
  std::uint16_t light[3] = {0, 0, 0};        // pack_half()
  std::uint8_t weight = 0, next_weight = 0;  // samples that the light stands for, before the level and after it
};

// Wall time, running means; 0: not known yet.
struct PreviewCosts {
  double sample = 0;  // a path
  double filter = 0;  // a pixel of a level, of those that are filtered
};

class PaperHistory;

class PreviewHistory {
 public:
  // published: of previews as published, which have a history of their own, and none of the buffers below. Takes
  // bytes_of() of memory. Throws std::bad_alloc.
  PreviewHistory(int width, int height, bool published = false);
  PreviewHistory(PreviewHistory&&) noexcept;
  ~PreviewHistory();

  static std::size_t bytes_of(int width, int height, bool published);
  static constexpr std::size_t bytes_per_pixel() {  // not published
    return 3 * sizeof(PreviewPixel) + 2 * sizeof(std::uint32_t) + sizeof(FilteredPixel);
  }
  std::size_t bytes() const { return bytes_of(width_, height_, bool(published)); }
  int width() const { return width_; }
  int height() const { return height_; }

  // The newest complete preview is of this view.
  bool shows(const RenderScene* scene, const CameraPose& camera, const PixelRect& region) const {
    return last.known && colors_of_last && scene && last.scene.lock().get() == scene && last.camera == camera &&
           last.region == region;
  }
  // Holds no scene and nothing to look up from now on.
  void forget();

  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  PreviewBuffer rest, last, current;  // `current` is of no view until its preview is complete
  std::vector<std::uint32_t> colors;  // pack_color(), of the newest surfaces
  std::vector<std::uint32_t> colors_before;  // while a preview is made: of the surfaces before
  std::optional<GazeDensity> density_of_last;  // away from whose gaze the newest surfaces are of blocks (coarse_surfaces.h)
  bool colors_of_last = false;        // all of them are; false while a preview is made, and if it was given up
  std::vector<FilteredPixel> filtered;
  PreviewCosts costs;
  std::uint32_t frame = 0;  // counts previews: sample index of their paths
  Rgb mean_light{0, 0, 0};  // of the newest fresh samples
  std::shared_ptr<const SurfaceColors> surface_colors;  // of that scene; null: none
  std::weak_ptr<const RenderScene> colored_scene;
  std::unique_ptr<PaperHistory> published;  // null: ours

 private:
  int width_, height_;
};

}  // namespace helio
