// The kernels once more, writing down what they do for one sample: see sample_trace.h.
#include "renderer/trace/path_kernel_impl.h"

namespace helio {

bool run_watched_kernel(const WindowTask& task, bool plain) {
  TraceStats stats;
  return plain ? PathKernel<false, true>(task).run(stats) : PathKernel<true, true>(task).run(stats);
}

}  // namespace helio
