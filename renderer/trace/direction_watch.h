// What a kernel writes down of a film's samples where later pictures draw on it: for each, the direction that its light
// came from at the first hit.
#pragma once

#include "renderer/film/direction_reservoir.h"
#include "renderer/film/film_history.h"
#include "renderer/trace/path_watch.h"
#include "renderer/trace/sampler.h"

namespace helio {

class DirectionWatch : public NoWatch {
 public:
  static constexpr bool kKeepsDirections = true;

  explicit DirectionWatch(const WindowTask& task) : NoWatch(task) {}

  void segment(int vertex, std::uint32_t path, const PathGroup&) {
    first_ = vertex == 1;
    if (first_) paths_[path] = {};
  }
  void throughput(std::uint32_t, const Rgb& beta) { beta_ = beta; }
  void emission(std::uint32_t path, const Rgb& radiance, float weight) {
    if (first_) paths_[path].emitted = luminance(beta_ * radiance) * weight;
  }
  void light_sample(std::uint32_t path, const LightSample& light) {
    if (first_) paths_[path].to_light = light.direction;
  }
  void shadow_ray(std::uint32_t path, float, const Rgb& contribution) {
    if (first_) paths_[path].from_light = luminance(contribution);
  }
  void occluded(std::uint32_t path, bool occluded) {
    if (first_ && occluded) paths_[path].from_light = 0;
  }
  void scatter(std::uint32_t path, const BsdfSample& sample, const Frame& frame) {
    if (!first_ || !sample.valid() || sample.delta) return;
    paths_[path].onwards = frame.to_world(sample.wi);
    paths_[path].scattered = true;
  }

  // Of a sample that brought `radiance`: the direction of one of its contributions, picked in proportion to these.
  std::uint32_t direction(std::uint32_t path, const Rgb& radiance, float u) const {
    const Path& p = paths_[path];
    u *= luminance(radiance);
    if (u < p.emitted) return DirectionReservoir::kAny;
    if (u < p.emitted + p.from_light) return pack_direction(p.to_light);
    return p.scattered ? pack_direction(p.onwards) : DirectionReservoir::kNone;
  }

 private:
  struct Path {
    float emitted = 0, from_light = 0;  // luminance
    bool scattered = false;             // not by a delta lobe
    V3f to_light{0, 0, 1}, onwards{0, 0, 1};
  };
  bool first_ = false;  // the vertex in hand is the first
  Rgb beta_{1, 1, 1};
  Path paths_[kGroupPaths];
};

}  // namespace helio
