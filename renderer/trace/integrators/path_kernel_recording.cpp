// The general kernel once more, for films that later pictures draw on: direction_recorder.h. Radiance and features have
// the same bits.
#include "renderer/trace/integrators/direction_recorder.h"
#include "renderer/trace/integrators/path_kernel_general.h"

namespace helio {

bool run_direction_recording_kernel(const WindowTask& task, TraceStats& stats) {
  return GeneralKernel<DirectionRecorder>(task).run(stats);
}

}  // namespace helio
