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

  Status load(const std::string& gltf);                    // takes note of the version
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
