// What happens in the daemon, since it began. What can be read when somebody asks (sessions, jobs, memory) is not here.
#pragma once

#include "server/metrics/counters.h"

namespace helio {

// Of streams of frames: StreamFrames, WatchFrames and RunJob.
struct StreamCounters {
  Counter bytes;             // of messages that gRPC took
  Counter tiles;             // among them
  Counter superseded_tiles;  // that a newer state of their place, a newer frame or a newer view replaced before
  // Seconds, of sessions alone. Age: from the change of the view to the sending of the first tile of each place.
  Histogram first_preview{0.005, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.5, 1, 2, 5};
  Histogram first_tile{0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60};
  Histogram preview_age{0.005, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.5, 1, 2, 5};
  Histogram picture_age{0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60};
};

// Of jobs that are kept.
struct CheckpointCounters {
  Histogram pause{0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5};  // seconds without samples
  Histogram write{0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60};            // seconds, to the disk
  Counter failures;                                                                        // of these
};

struct DaemonCounters {
  StreamCounters streams;
  CheckpointCounters checkpoints;
  Counter jobs_succeeded, jobs_failed, jobs_canceled;  // kept ones that came to their end
};

}  // namespace helio
