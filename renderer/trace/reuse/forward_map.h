// Forward mapping: where the pixels of an earlier picture have gone in a new one.
//
// Each pixel's surface point is projected into the new picture, as Schalk (2018, 3.2) does with first hits, and lands
// in one pixel there: no two pixels of the new picture draw on the same one of the old, and where the new picture shows
// things larger some find nothing. Of the pixels that land in one the nearest surface counts, and of that surface the
// pixel whose point lies next to the new pixel's centre. Whether that shows what the new pixel shows is for who looks
// it up to find out (history_view.h); if it does not, nothing is found, though another pixel may have landed there.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/math.h"
#include "renderer/film/history/history_source.h"
#include "renderer/trace/camera/camera.h"

namespace helio {

class ForwardMap {
 public:
  struct Pixel {
    int x, y;
  };

  // `source`: of the camera `from`; pixels outside the region are of pictures that are no longer true. The new picture
  // is of the same size. Takes one thread, and 20 bytes a pixel while it is made, four of which it keeps. `cancel`,
  // which may be null, is polled at every row; once it is raised the rest is left out.
  ForwardMap(const HistorySource& source, const CameraPose& from, const CameraPose& to, const PixelRect& region,
             const V3d& scene_origin, const CancelToken* cancel = nullptr);

  // What has landed in a pixel of the new picture.
  std::optional<Pixel> at(int x, int y) const {
    const std::int32_t found = landed_[std::size_t(y) * std::size_t(width_) + std::size_t(x)];
    if (found < 0) return std::nullopt;
    return Pixel{found % width_, found / width_};
  }

 private:
  int width_;
  std::vector<std::int32_t> landed_;  // by pixel: the place of one of the source's; -1: none
};

}  // namespace helio
