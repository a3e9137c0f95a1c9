// When a caller that was refused for want of a place or of memory may try again.
#pragma once

namespace helio {

// Long enough that callers who do as they are told cost nothing, short beside a session's grace time.
inline constexpr double kRetrySeconds = 2;

}  // namespace helio
