#include "renderer/trace/integrators/path_kernel_general.h"

namespace helio {

bool run_general_kernel(const WindowTask& task, TraceStats& stats) {
  return GeneralKernel<NoRecorder>(task).run(stats);
}

}  // namespace helio
