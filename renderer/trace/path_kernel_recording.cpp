// The kernels once more, for films that keep first hits: see hit_recorder.h. Radiance and features have the same bits.
#include "renderer/trace/hit_recorder.h"
#include "renderer/trace/path_kernel_general.h"
#include "renderer/trace/path_kernel_plain.h"

namespace helio {

bool run_recording_kernel(const WindowTask& task, bool plain, TraceStats& stats) {
  return plain ? PlainKernel<HitRecorder>(task).run(stats) : GeneralKernel<HitRecorder>(task).run(stats);
}

}  // namespace helio
