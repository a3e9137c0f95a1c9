// Seconds since 1970, for what people and other machines are told: it may be set back (now_s() of clock.h is not).
#pragma once

#include <chrono>

namespace helio {

inline double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace helio
