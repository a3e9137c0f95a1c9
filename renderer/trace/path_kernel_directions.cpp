// The general kernel once more, keeping in the film's history where light came from. The samples are the same.
#include "renderer/trace/direction_watch.h"
#include "renderer/trace/path_kernel_general.h"

namespace helio {

bool run_direction_kernel(const WindowTask& task, TraceStats& stats) {
  return GeneralKernel<DirectionWatch>(task).run(stats);
}

}  // namespace helio
