// Pass: decides how many samples each pixel gets in the round that follows (film/sample_allocation.h).
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "renderer/film/sample_allocation.h"
#include "renderer/frame/render_settings.h"

namespace helio {

// What the settings say of it; absent: every pixel gets the same number of samples.
std::optional<AllocationSettings> allocation_settings(const RenderSettings& settings);
// What a film needs for them.
FilmState film_state(const RenderSettings& settings);

struct AllocatePiece {
  std::shared_ptr<SampleAllocation> allocation;
  int sweep = 0;
  std::size_t part = 0;
};

class AllocatePass {
 public:
  // Not thread safe: the owner's lock guards it.

  void begin(std::shared_ptr<SampleAllocation> allocation) {
    allocation_ = std::move(allocation);
    sweep_ = 0;
    next_ = done_ = 0;
  }
  std::optional<AllocatePiece> next() {
    if (!any_open()) return std::nullopt;
    return AllocatePiece{allocation_, sweep_, next_++};
  }
  bool any_open() const { return allocation_ && next_ < allocation_->parts(); }
  void finish(const AllocatePiece& piece);
  void stop() { allocation_.reset(); }
  // Nothing was begun, or all of it is done.
  bool finished() const { return !allocation_ || sweep_ == allocation_->sweeps(); }

 private:
  std::shared_ptr<SampleAllocation> allocation_;
  int sweep_ = 0;
  std::size_t next_ = 0, done_ = 0;  // parts of the sweep
};

// Thread safe for pieces of one sweep.
inline void run_allocate(const AllocatePiece& piece) {
  piece.allocation->run(piece.sweep, piece.part);
}

}  // namespace helio
