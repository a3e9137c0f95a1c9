// What every subcommand is told.
#pragma once

#include <string>

namespace helio::bench {

struct BenchOptions {
  int threads = 2;             // of ours and of the peers
  int repeat = 5;              // measurements after one warm-up; the figure is their median
  int size = 512;              // side of the pictures in pixels; the goals hold for 512
  int views = 50;              // camera updates per latency figure
  std::string shared;          // folder with scenes/bench
  std::string mitsuba_python;  // Python with Mitsuba 3.9.1 and numpy; empty: none
  std::string blender;         // Blender, whose Cycles is a peer; by default from PATH
  std::string daemon;          // heliographd
};

}  // namespace helio::bench
