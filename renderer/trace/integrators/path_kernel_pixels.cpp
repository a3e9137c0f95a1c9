// The path tracer's kernels over a list of pixels, without a film.
#include "renderer/trace/integrators/path_kernel_general.h"
#include "renderer/trace/integrators/path_kernel_lambert.h"

namespace helio {
namespace {

struct ListRecorder : NoRecorder {
  static constexpr bool kListsPixels = true;
  using NoRecorder::NoRecorder;
};

}  // namespace

bool run_pixel_kernel(const WindowTask& task, bool plain, TraceStats& stats) {
  if (plain) return LambertKernel<ListRecorder>(task).run(stats);
  return GeneralKernel<ListRecorder>(task).run(stats);
}

}  // namespace helio
