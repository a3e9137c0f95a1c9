// State of the picture in hand, as the render loop keeps it. Replaced whole when another picture begins.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/frame/frame_scheduler.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class PictureCheckpoint;
class TemporalReprojection;

struct PictureState {
  FrameState state;  // as the scheduler has it
  std::shared_ptr<const PictureCheckpoint> resume;  // that it begins with; null: none, or it has begun
  std::shared_ptr<TemporalReprojection> transfer;  // the newest; null: none of this picture
  double taken_back = 0;                           // carried samples that stage `review` removed
  TraceStats trace;
  std::uint64_t samples = 0;       // pixel samples in the film
  std::uint64_t left_samples = 0;  // those of the picture before
};

}  // namespace helio
