#include "renderer/trace/integrators/path_kernel_plain.h"

namespace helio {

bool run_plain_kernel(const WindowTask& task, TraceStats& stats) {
  return PlainKernel<NoRecorder>(task).run(stats);
}

}  // namespace helio
