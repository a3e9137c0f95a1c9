#include "renderer/frame/frame_sink.h"

namespace helio {

const char* to_string(FrameEndReason reason) {
  switch (reason) {
    case FrameEndReason::samples:
      return "samples";
    case FrameEndReason::time:
      return "time";
    case FrameEndReason::error:
      return "error";
    case FrameEndReason::superseded:
      return "superseded";
    case FrameEndReason::cancelled:
      return "cancelled";
    case FrameEndReason::failed:
      return "failed";
    case FrameEndReason::preview:
      return "preview";
  }
  return "unknown";
}

}  // namespace helio
