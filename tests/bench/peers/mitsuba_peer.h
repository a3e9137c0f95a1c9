// Mitsuba 3 in a process of its own (mitsuba_bench.py), asked in turns with our runs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/bench/peers/peer_process.h"
#include "tests/bench/reports/error_curve.h"
#include "tests/bench/scenes/loop_rendering.h"

namespace helio::bench {

// Means a path.
struct PeerRayCount {
  double segments = 0, shadow_rays = 0;
  double useful_shadow_rays = 0;  // of these, those that would bring light if nothing were in their way

  double rays() const { return segments + shadow_rays; }
};

class MitsubaPeer {
 public:
  // failed_precondition: no Python given, or one without Mitsuba.
  static Result<std::unique_ptr<MitsubaPeer>> start(const std::string& python, int threads);

  Status load(const std::string& scene, const std::string& xml);  // takes note of the version
  const std::string& version() const { return version_; }         // "3.9.1 llvm_ad_rgb"

  // Seconds for one picture of so many samples a pixel.
  Result<double> render_seconds(const std::string& scene, int samples, int seed);
  // The film of the scene's sensor, in pixels; none of it cropped.
  Status resize(const std::string& scene, int width, int height);
  // The picture, by way of `file`, with the seconds that it took without writing it.
  Result<LoopPicture> render_picture(const std::string& scene, int samples, int seed, const std::string& file);
  Result<std::vector<CurvePoint>> error_curve(const std::string& scene, int step, int seed, double target, int limit,
                                              const std::string& reference);
  // Of `samples` paths a pixel. internal: the integrator that counts makes another picture than the scene's own, which
  // has other depths.
  Result<PeerRayCount> count_rays(const std::string& scene, int samples, int seed, int max_depth, int roulette_depth);

 private:
  explicit MitsubaPeer(PeerProcess process) : process_(std::move(process)) {}

  PeerProcess process_;
  std::string version_;
};

}  // namespace helio::bench
