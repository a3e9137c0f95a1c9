// What every subcommand is told.
#pragma once

#include <string>
#include <vector>

namespace helio::bench {

struct BenchOptions {
  int threads = 2;             // of ours and of the peers
  int repeat = 5;              // measurements after one warm-up; the figure is their median
  int size = 512;              // side of the pictures in pixels; the goals hold for 512
  int seeds = 5;               // pictures per point of an error curve
  int samples = 64;            // per pixel, of an error curve's last point
  std::vector<std::string> scenes;  // of error curves; empty: those of the manual
  std::vector<std::string> motions;  // of reuse (reuse_motions.h); empty: those with goals; "all" alone: every one
  bool ours_alone = false;           // of reuse: mode combined beside the restart, nothing else, and no costs
  bool own_references = false;       // of error curves: those of other renderers, of one size, are passed by
  std::string cache;           // folder of references that were made here
  std::string output;          // folder for the files of error curves; empty: none are written
  // Of the study: its reprojection part, by steps of so many degrees with so many samples each.
  bool turns = false;
  std::vector<int> step_degrees = {5, 10, 20, 50};
  std::vector<int> step_samples = {32, 64};
  int views = 50;              // camera updates per latency figure
  std::string shared;          // folder with scenes/bench
  std::string mitsuba_python;  // Python with Mitsuba 3.9.1 and numpy; empty: none
  std::string blender;         // Blender, whose Cycles is a peer; by default from PATH
  std::string oidn_library;    // Open Image Denoise 2.x; empty: none
  std::string daemon;          // heliographd
};

}  // namespace helio::bench
