// What a kernel notes for a film that later pictures draw on: of each sample, a direction that its light came from at
// the first hit (film/direction_reservoir.h). Of the general kernel and the bidirectional one: Lambert surfaces look
// alike from everywhere.
#pragma once

#include <bit>
#include <vector>

#include "renderer/film/direction_reservoir.h"
#include "renderer/film/film_history.h"
#include "renderer/trace/path_watch.h"
#include "renderer/trace/sampler.h"

namespace helio {

class DirectionRecorder : public NoWatch {
 public:
  static constexpr bool kRecords = true;

  explicit DirectionRecorder(const WindowTask& task)
      : NoWatch(task), film_(task.film), seed_(task.settings.seed ^ 0x9e3779b97f4a7c15u) {}

  void make_room(std::size_t samples) { samples_.resize(samples); }
  void arrived(const PathGroup&) {}

  void segment(int vertex, std::uint32_t path, const PathGroup&) {
    first_ = vertex == 1;
    if (!first_) return;
    paths_[path] = {};
    beta_ = Rgb(1, 1, 1);  // throughput() is not called where nothing is met
  }
  void throughput(std::uint32_t, const Rgb& beta) { beta_ = beta; }
  void emission(std::uint32_t path, const Rgb& radiance, float weight) {
    if (first_) paths_[path].emitted = luminance(beta_ * radiance) * weight;
  }
  void light_sample(std::uint32_t path, const LightSample& light) {
    if (first_) paths_[path].to_light = pack_direction<DirectionReservoir::kAxisBits>(light.direction);
  }
  void shadow_ray(std::uint32_t path, float, const Rgb& contribution) {
    if (first_) paths_[path].from_light = luminance(contribution);
  }
  void occluded(std::uint32_t path, bool occluded) {
    if (first_ && occluded) paths_[path].from_light = 0;
  }
  // Of several, one in proportion to what it brings.
  void joined(std::uint32_t path, const V3f& direction, const Rgb& contribution) {
    if (!first_) return;
    Sample& sample = paths_[path];
    const float brought = luminance(contribution);
    sample.from_light += brought;
    const std::uint32_t chance = combine_hash(std::bit_cast<std::uint32_t>(direction.x) + std::uint32_t(seed_),
                                              std::bit_cast<std::uint32_t>(direction.y));
    if (unit_float(chance) * sample.from_light < brought)
      sample.to_light = pack_direction<DirectionReservoir::kAxisBits>(direction);
  }
  void scatter(std::uint32_t path, const BsdfSample& sample, const Frame& frame) {
    if (!first_ || !sample.valid() || sample.delta) return;
    paths_[path].onwards = pack_direction<DirectionReservoir::kAxisBits>(frame.to_world(sample.wi));
  }

  void store(std::size_t slot, std::uint32_t path, const Rgb& radiance) {
    samples_[slot] = paths_[path];
    samples_[slot].whole = luminance(radiance);
  }

  // A valid sample, which the film holds by now.
  void commit(std::size_t slot, int half, std::uint32_t index, std::uint32_t, int x, int y) {
    const Sample& sample = samples_[slot];
    const std::uint32_t key = combine_hash(pixel_key(x, y, half, seed_), index);
    const float u[DirectionReservoir::kPlaces] = {unit_float(mix_bits(key)), unit_float(mix_bits(~key))};
    const HalfPixel& pixel = film_.half(half, x, y);
    const Rgb sum(V3d(pixel.sum[0], pixel.sum[1], pixel.sum[2]));
    film_.history()->directions(x, y).add(half, sample.pick(unit_float(key)), sample.whole, double(luminance(sum)), u);
  }

 private:
  // Luminances, and directions as they are kept.
  struct Sample {
    float emitted = 0, from_light = 0, whole = 0;
    std::uint32_t to_light = DirectionReservoir::kNone, onwards = DirectionReservoir::kNone;

    // The direction of one contribution, in proportion to what it brought.
    std::uint32_t pick(float u) const {
      const float at = u * whole;
      if (at < emitted) return DirectionReservoir::kAny;
      return at < emitted + from_light ? to_light : onwards;
    }
  };

  Film& film_;
  const std::uint64_t seed_;
  bool first_ = false;  // the vertex in hand is the first
  Rgb beta_{1, 1, 1};
  Sample paths_[kGroupPaths];
  std::vector<Sample> samples_;
};

}  // namespace helio
