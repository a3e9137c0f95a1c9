// The display layer: the film for the eye. Two levels of an edge-avoiding filter (cross_filter.h) average light over
// neighbours of the same surface; each pixel is then blended with what the film has there, by the errors that the
// halves tell of both (blend_errors.h). It is biased, and becomes the film as samples arrive.
//
// Of a pixel whose (F - m)^2 is above 4 R and above the product of its own residuals, which both halves would make
// large if it were true, the film's share 1 - s falls with the root of that.
//
// Open Image Denoise may make the picture instead (oidn_images.h), without the film's share and without an error.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/film/core/film.h"
#include "renderer/film/estimate/channels.h"

namespace helio {

class OidnImages;
class OidnLibrary;

class DisplayLayer {
 public:
  // Takes bytes_per_pixel() of memory for each pixel. Throws std::bad_alloc.
  DisplayLayer(int width, int height);
  // By Open Image Denoise. Takes bytes_by_oidn() of memory, some of it only while it is made. Throws std::bad_alloc.
  DisplayLayer(int width, int height, std::shared_ptr<const OidnLibrary> oidn);
  ~DisplayLayer();
  DisplayLayer(DisplayLayer&&) noexcept;
  DisplayLayer& operator=(DisplayLayer&&) = delete;

  static constexpr std::size_t bytes_per_pixel() { return kLevels * sizeof(HalvesPixel) + sizeof(Blend); }
  static std::size_t bytes_by_oidn(std::size_t pixels);
  std::size_t bytes() const;
  bool by_oidn() const { return oidn_ != nullptr; }
  int width() const { return width_; }
  int height() const { return height_; }

  // Made of the film's region anew: begin(), then all parts of each sweep in any order and on any thread, and
  // finish_sweep(). The film is only read. Given up in between it stays known if it was, of the same picture with fewer
  // samples; forget() it for another picture. Its pixels need samples in both halves for a filter to have something to
  // go by; others are filled from their neighbours. Precondition: the film is of the layer's size.
  void begin(const PixelRect& region);
  static constexpr int kLevels = 2;                      // of the filter
  static constexpr int kSweeps = kLevels + 2;            // brightness before, blend after
  static constexpr int kOidnSweeps = 2;                  // copy, denoise
  int sweeps() const { return oidn_ ? kOidnSweeps : kSweeps; }
  std::size_t parts() const { return oidn_ && next_sweep_ == 1 ? 1 : windows_.size(); }  // of the sweep that comes next
  // Raising `cancel` (null: never) ends a part of Open Image Denoise's early, which takes seconds for millions of
  // pixels; the layer is unknown then.
  void run(const Film& film, int sweep, std::size_t part, const CancelToken* cancel = nullptr);
  void finish_sweep(int sweep);

  bool known() const { return known_; }
  bool covers(const PixelRect& window) const { return known_ && intersect(window, region_) == window; }
  void forget() {
    known_ = false;
    failure_.clear();
  }
  // Why Open Image Denoise could not make the layer of this picture: it is unknown, and making it again would not help.
  // Empty: it did not fail.
  const std::string& failure() const { return failure_; }

  // The radiance that is shown in place of the film's mean there. Precondition: covers() the pixel.
  Rgb shown(const Film& film, int x, int y, const Rgb& radiance) const;

  // Fills tile.display and tile.display_error from tile.radiance, where `layer` is known and covers the window; else
  // (null, or no such picture yet) they are the radiance and the root of its variance, which is +infinity where the
  // tile has none. Error: +infinity where no sample tells of it; estimated root mean square of a pixel's error over its
  // channels, of neighbourhoods of 11x11, with what reuse may have added; by Open Image Denoise, +infinity. Thread
  // safe.
  static void resolve(const DisplayLayer* layer, const Film& film, ResolvedTile& tile);

 private:
  // Between levels, packed as halves, in units of the picture's mean.
  struct HalvesPixel {
    std::uint16_t light[kHalves][3] = {};
    std::uint16_t deviation = 0;  // root of the light's variance, of the last level: of the film's
  };
  // Light is more than halves hold.
  static bool saturated(const HalvesPixel& pixel);
  struct Blend {
    std::uint16_t share = 0, error = 0;  // s | of the blend
  };

  void add_brightness(const Film& film, std::size_t part);
  void filter(const Film& film, int level, const PixelRect& window);
  void find_borders(const Film& film, const PixelRect& rect, std::vector<std::uint8_t>& border) const;
  void blend(const Film& film, const PixelRect& window);
  std::uint16_t& deviation_of_mean(int x, int y) { return filtered_[kLevels - 1][index(x, y)].deviation; }
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_, height_;
  PixelRect region_;
  std::vector<PixelRect> windows_;
  std::vector<double> brightness_;  // by window
  float scale_ = 1;                 // radiance to units of about the picture's mean
  std::vector<HalvesPixel> filtered_[kLevels];  // what a level left
  std::vector<Blend> blends_;
  bool known_ = false;
  int next_sweep_ = 0;
  std::unique_ptr<OidnImages> oidn_;  // null: by our own filter, of which the vectors above are
  bool denoised_ = false;             // by the newest run of it
  std::string failure_;
};

}  // namespace helio
