#include "renderer/trace/path_kernel_impl.h"

namespace helio {

bool run_plain_kernel(const WindowTask& task, TraceStats& stats) {
  return PathKernel<false>(task).run(stats);
}

}  // namespace helio
