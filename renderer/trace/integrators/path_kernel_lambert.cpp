#include "renderer/trace/integrators/path_kernel_lambert.h"

namespace helio {

bool run_lambert_kernel(const WindowTask& task, TraceStats& stats) {
  return LambertKernel<NoRecorder>(task).run(stats);
}

}  // namespace helio
