// The order of work that goes over a picture in several sweeps of small windows, tile by tile: a part of one sweep
// begins as soon as the parts of the sweep before are done for its window and those around it, and parts that the
// picture's first tiles wait for come first. So the first tile is ready after the work of its own windows and two rings
// around them, not after sweeps over the whole picture.
//
//   sweep 0   windows of the tile, and two rings around        e.g. what centres see, and what is carried
//   sweep 1   windows of the tile, and one ring around         which pixels border another surface
//   sweep 2   windows of the tile                              what may stay
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

// Not thread safe.
class WindowOrder {
 public:
  static constexpr int kSweeps = 3;
  // Side of a window in pixels, at most: about a millisecond's work.
  static constexpr int kWindow = 32;
  // How far a sweep may look beyond its window into what the sweep before has left, in pixels.
  static constexpr int kReach = 16;

  // tiles: disjoint, what comes first first. Windows are cut along blocks of the film.
  explicit WindowOrder(const std::vector<PixelRect>& tiles);

  struct Part {
    int sweep = 0;
    PixelRect window;
  };
  std::size_t parts() const { return rank_.size(); }
  Part part(std::size_t part) const { return {int(part / windows_.size()), windows_[part % windows_.size()]}; }

  // The part that is to begin next; none: what is left waits for parts in hand.
  std::optional<std::size_t> next();
  bool any_open() const { return !ready_.empty(); }
  // A part that next() has given is done.
  void finish(std::size_t part);
  // Tiles all of whose parts are done, each once; none: no more of them yet.
  std::optional<std::uint32_t> next_finished_tile();

 private:
  void find_neighbours();

  std::vector<PixelRect> windows_;
  std::vector<std::vector<std::uint32_t>> neighbours_;  // by window: those around it, and itself
  std::vector<std::uint32_t> tile_of_;                  // by window
  std::vector<std::uint32_t> left_;     // by tile: windows whose last part is not done
  std::vector<std::uint8_t> waits_;     // by part: parts of the sweep before that are not done
  std::vector<std::uint32_t> rank_;     // by part: which comes how early
  std::vector<std::uint32_t> ranked_;   // the reverse
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready_;  // ranks
  std::queue<std::uint32_t> finished_tiles_;
};

}  // namespace helio
