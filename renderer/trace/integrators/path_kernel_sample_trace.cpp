// The general kernel once more, writing down what it does for one sample: see sample_trace.h. The plain kernel would
// give the same bits.
#include "renderer/trace/integrators/path_kernel_general.h"

namespace helio {

bool run_sample_trace_kernel(const WindowTask& task) {
  TraceStats stats;
  return GeneralKernel<SampleRecorder>(task).run(stats);
}

}  // namespace helio
