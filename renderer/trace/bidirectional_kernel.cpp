#include "renderer/trace/path_kernel.h"

namespace helio {

bool run_bidirectional_kernel(const WindowTask& task, TraceStats& stats) {
  return run_general_kernel(task, stats);
}

}  // namespace helio
