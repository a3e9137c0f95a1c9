#include "renderer/frame/preview_clock.h"

namespace helio {

PreviewClock::Decision PreviewClock::decide() const {
  if (!on()) return {};
  const double rests_s = changed_s_ + kRestWait;
  if (due_ && begun_s_ + 1 / rate_ <= rests_s) return {Next::preview, begun_s_ + 1 / rate_};
  return {Next::film, rests_s};
}

}  // namespace helio
