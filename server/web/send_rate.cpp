#include "server/web/send_rate.h"

namespace helio {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr Seconds kSpan{0.5};
constexpr Seconds kIdle{0.1};    // without a write: what comes next is looked at anew
constexpr double kHeldUp = 0.8;  // share of the span that writes take where the connection holds them up

constexpr double kTold = 2e6;   // bytes that tell whether the connection is fast
constexpr double kFast = 20e6;  // bytes a second

}  // namespace

void SendRate::write_begun(Time now) {
  begun_ = now;
  if (since_ && now - ended_ <= kIdle) return;
  since_ = now;
  writing_ = Seconds(0);
  bytes_ = 0;
}

std::optional<double> SendRate::write_ended(std::size_t bytes, Time now) {
  ended_ = now;
  writing_ += now - begun_;
  bytes_ += double(bytes);
  recent_writing_ += now - begun_;
  recent_bytes_ += double(bytes);
  if (recent_bytes_ >= kTold) {
    fast_ = recent_bytes_ >= kFast * recent_writing_.count();
    recent_writing_ = Seconds(0);
    recent_bytes_ = 0;
  }
  if (!since_ || now - *since_ < kSpan) return {};
  const bool held_up = writing_ >= kHeldUp * Seconds(now - *since_);
  const double rate = bytes_ / writing_.count();
  since_.reset();
  return held_up ? std::optional(rate) : std::nullopt;
}

}  // namespace helio
