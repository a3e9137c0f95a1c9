// Splats on their way to a film's buffer: handed over many at a time, for a wide filter spreads each light path over
// thousands of pixels.
#pragma once

#include <vector>

#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class SplatBatch {
 public:
  // Those that the buffer does not take are noted in `stats`.
  SplatBatch(SplatBuffer& buffer, int half, TraceStats& stats) : buffer_(buffer), half_(half), stats_(stats) {}

  // `sample`: that the splat's light path goes with.
  void add(const Splat& splat, const InvalidSample& sample) {
    if (!buffer_.takes(splat)) stats_.note_invalid_splat(is_finite(splat.radiance), sample);
    splats_.push_back(splat);
    if (splats_.size() >= kMost) hand_over(0);
  }
  // light_paths: as of SplatBuffer::add(), of all that was added since the last call.
  void finish(std::uint64_t light_paths) { hand_over(light_paths); }

 private:
  static constexpr std::size_t kMost = 1u << 16;

  void hand_over(std::uint64_t light_paths) {
    buffer_.add(half_, splats_, light_paths);
    splats_.clear();
  }

  SplatBuffer& buffer_;
  int half_;
  TraceStats& stats_;
  std::vector<Splat> splats_;
};

}  // namespace helio
