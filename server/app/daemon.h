// heliographd as a function, shared with `heliograph serve`.
#pragma once

#include <string>
#include <vector>

namespace helio {

// Runs until SIGTERM, SIGINT, or the end of the terminal that it was started from, then drains. Prints "heliographd
// listening on ADDRESS:PORT" on stdout once it serves. Call before any other thread exists (it blocks the signals). A
// second signal ends the process at once. SIGHUP reads the files that may be replaced again.
// Returns the exit code: 0 drained, 1 could not serve, 2 bad flags, file or environment.
int run_daemon(const std::string& program, const std::vector<std::string>& arguments);

}  // namespace helio
