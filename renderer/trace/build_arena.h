// The arena that a scene is prepared in.
#pragma once

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace helio {

// threads: 0 or less: as many as the machine runs at once. Never more, or TBB would complain on stderr.
inline int build_concurrency(int threads) {
  const int most = tbb::info::default_concurrency();
  return threads > 0 ? std::min(threads, most) : most;
}

}  // namespace helio
