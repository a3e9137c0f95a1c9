#include "renderer/trace/path_kernel_impl.h"

namespace helio {

bool run_general_kernel(const WindowTask& task, TraceStats& stats) {
  return PathKernel<true>(task).run(stats);
}

}  // namespace helio
