// The kernels once more, for films that later pictures draw on: hit_recorder.h, direction_recorder.h. Radiance and
// features have the same bits.
#include "renderer/trace/integrators/direction_recorder.h"
#include "renderer/frame/paper/hit_recorder.h"
#include "renderer/trace/integrators/path_kernel_general.h"
#include "renderer/trace/integrators/path_kernel_lambert.h"

namespace helio {

bool run_hit_recording_kernel(const WindowTask& task, bool plain, TraceStats& stats) {
  return plain ? LambertKernel<HitRecorder>(task).run(stats) : GeneralKernel<HitRecorder>(task).run(stats);
}

bool run_direction_recording_kernel(const WindowTask& task, TraceStats& stats) {
  return GeneralKernel<DirectionRecorder>(task).run(stats);
}

}  // namespace helio
