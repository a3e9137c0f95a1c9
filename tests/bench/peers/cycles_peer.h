// Blender's Cycles in a process of its own (cycles_bench.py), asked in turns with our runs.
#pragma once

#include <memory>
#include <string>

#include "tests/bench/peers/peer_process.h"

namespace helio::bench {

class CyclesPeer {
 public:
  // failed_precondition: `blender` is no program that can be run.
  static Result<std::unique_ptr<CyclesPeer>> start(const std::string& blender, int threads);
  // From the module bpy. failed_precondition: no Python given, or one without it.
  static Result<std::unique_ptr<CyclesPeer>> start_module(const std::string& python, int threads);

  // Both take note of the version. Lambert materials, 512x512 pixels:
  Status load(const std::string& gltf);
  // A glTF binary with what Blender's importer makes of its materials. Size in pixels.
  Status import_glb(const std::string& glb, int width, int height);
  const std::string& version() const { return version_; }  // "3.4.1"

  // Seconds for one picture of so many samples a pixel, with what every render costs beside its samples. `output`: an
  // EXR file that is written after the clock has stopped; empty: none.
  Result<double> render_seconds(int samples, int seed, const std::string& output = {});

 private:
  explicit CyclesPeer(PeerProcess process) : process_(std::move(process)) {}

  PeerProcess process_;
  std::string version_;
};

}  // namespace helio::bench
