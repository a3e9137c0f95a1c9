// What every subcommand is told.
#pragma once

#include <string>
#include <vector>

namespace helio::bench {

struct BenchOptions {
  int threads = 2;             // of ours and of the peers
  int repeat = 5;              // measurements after one warm-up; the figure is their median
  int size = 512;              // side of the pictures in pixels; the goals hold for 512
  int seeds = 5;               // pictures per point of a comparison
  int samples = 64;            // per pixel, of a comparison's last point
  std::vector<std::string> scenes;  // of errors; empty: those of the manual
  std::vector<std::string> motions;  // of reuse (reuse_motions.h); empty: those with goals; "all" alone: every one
  bool ours_alone = false;           // of reuse: mode combined beside the restart, nothing else, and no costs
  bool real = false;                 // of peers: figures of real scenes instead of comparisons
  bool own_references = false;       // of errors: those of other renderers, of one size, are passed by
  std::string cache;           // folder of references that were made here
  std::string output;          // folder for the files of comparisons; empty: none are written
  std::string command_line;    // of this run
  // Of turns: steps of so many degrees with so many samples each.
  std::vector<int> step_degrees = {5, 10, 20, 50};
  std::vector<int> step_samples = {32, 64};
  int views = 50;              // camera updates per latency figure
  std::string shared;          // folder with scenes/bench
  std::string mitsuba_python;  // Python with Mitsuba 3.9.1 and numpy; empty: none
  std::string blender;         // Blender, whose Cycles is a peer; by default from PATH
  std::string bpy_python;      // Python with bpy, whose Cycles is a peer of real scenes; empty: none
  std::string oidn_library;    // Open Image Denoise 2.x; empty: none
  std::string daemon;          // heliographd
  int vulkan_device = -1;      // DeviceInfo::index; -1: the first that can trace paths
};

}  // namespace helio::bench
