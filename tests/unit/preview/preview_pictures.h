// Previews and films as pictures, row by row.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/film/estimate/resolve.h"
#include "renderer/preview/preview_maker.h"

namespace helio::test {

using Picture = std::vector<Rgb>;

// All sweeps of a preview, and what it shows of its region.
inline Picture make(PreviewMaker& preview, const PixelRect& region, TraceStats& stats) {
  for (int sweep = 0; sweep < preview.sweeps(); ++sweep) {
    for (std::size_t part = 0; part < preview.parts(); ++part) preview.run(sweep, part, stats);
    preview.finish_sweep(sweep);
  }
  std::vector<float> planes[3];
  preview.resolve(region, planes);
  Picture picture;
  for (std::size_t i = 0; i < planes[0].size(); ++i) picture.push_back({planes[0][i], planes[1][i], planes[2][i]});
  return picture;
}

inline Picture picture_of(const Film& film) {
  Picture picture;
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) picture.push_back(resolve_mean(film, x, y));
  }
  return picture;
}

}  // namespace helio::test
