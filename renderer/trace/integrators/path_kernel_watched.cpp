// The general kernel once more, writing down what it does for one sample: see sample_trace.h. The plain kernel would
// give the same bits.
#include "renderer/trace/integrators/path_kernel_general.h"

namespace helio {

bool run_watched_kernel(const WindowTask& task) {
  TraceStats stats;
  return GeneralKernel<SampleWatch>(task).run(stats);
}

}  // namespace helio
