// What `heliograph` answers to the shell. Documented in every --help; scripts rely on the numbers.
#pragma once

#include "renderer/base/result.h"

namespace helio::cli {

enum ExitCode : int {
  kOk = 0,
  kFailed = 1,         // the work could not be done: a limit, a file that cannot be written, a failure of the server
  kUsage = 2,          // bad flags or values; all problems are named
  kSceneRefused = 3,   // the scene cannot be read or is not supported
  kUnreachable = 4,    // no server, or it went away
  kInterrupted = 130,  // Ctrl-C; 143 after SIGTERM
};

inline constexpr const char* kExitCodesHelp =
    "Exit codes: 0 done; 1 failed (a limit, a file that cannot be written, a failure of the server); 2 bad flag or\n"
    "value, each named with its allowed range; 3 scene refused; 4 server unreachable or lost (what was rendered is\n"
    "kept); 130 interrupted by Ctrl-C, 143 by SIGTERM (what was rendered is kept).";

// The code for an error that is not about the scene.
inline int exit_code_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::invalid_argument:
      return kUsage;
    case ErrorCode::unavailable:
      return kUnreachable;
    default:
      return kFailed;
  }
}

}  // namespace helio::cli
