// The general kernel once more, writing down what it does for one sample: see sample_trace.h. The plain kernel would
// give the same bits.
#include "renderer/trace/path_kernel_impl.h"

namespace helio {

bool run_watched_kernel(const WindowTask& task) {
  TraceStats stats;
  return PathKernel<true, true>(task).run(stats);
}

}  // namespace helio
