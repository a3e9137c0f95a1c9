#include "renderer/frame/preview_clock.h"

namespace helio {

PreviewClock::Decision PreviewClock::decide() const {
  if (!on()) return {};
  if (due_) return {Next::preview, begun_s_ + 1 / rate_};
  return {Next::film, changed_s_ + kRestWait};
}

}  // namespace helio
