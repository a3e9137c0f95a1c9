// What a kernel notes for a film that later pictures draw on: of each sample, a direction that its light came from at
// the first hit, and how much of it depends on the view (film/core/direction_reservoir.h). Of the general kernel and
// the bidirectional one: Lambert surfaces look alike from everywhere.
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "renderer/film/core/direction_reservoir.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/integrators/path_recorder.h"
#include "renderer/trace/paths/connection_rays.h"
#include "renderer/trace/sampling/sampler.h"

namespace helio {

class DirectionRecorder : public NoRecorder {
 public:
  static constexpr bool kRecordsForReuse = true;
  static constexpr bool kFollowsVertices = true;

  explicit DirectionRecorder(const WindowTask& task)
      : NoRecorder(task), film_(task.film), seed_(task.settings.seed ^ 0x9e3779b97f4a7c15u) {}

  void make_room(std::size_t samples) { samples_.resize(samples); }
  void arrived(const PathGroup&) {}

  void segment(int vertex, std::uint32_t path, const PathGroup&) {
    first_ = vertex == 1;
    if (!first_) return;
    paths_[path] = {};
    beta_ = Rgb(1, 1, 1);  // hit() is not called where nothing is met
  }
  void hit(std::uint32_t, const Hit&, std::uint32_t, const Rgb& beta) { beta_ = beta; }
  void emission(std::uint32_t path, const Rgb& radiance, float weight) {
    if (first_) paths_[path].emitted = luminance(beta_ * radiance) * weight;
  }
  void surface(std::uint32_t, const Surface&, const SurfaceParams&, const V3f& normal, const V3f&, bool) {
    if (first_) frame_ = Frame(normal);
  }
  void scattering(const Bsdf* bsdf) { bsdf_ = bsdf; }
  void light_sample(std::uint32_t path, const LightSample& light) {
    if (first_) paths_[path].light.direction = pack_direction<DirectionReservoir::kAxisBits>(light.direction);
  }
  void light_value(std::uint32_t path, const LightSample& light, const BsdfValue& value) {
    if (first_) paths_[path].light.share = lobe_share(value.f_cos, frame_.to_local(light.direction));
  }
  void shadow_ray(std::uint32_t path, float, const Rgb& contribution) {
    if (first_) paths_[path].from_light = luminance(contribution);
  }
  void occluded(std::uint32_t path, bool occluded) {
    if (first_ && occluded) paths_[path].from_light = 0;
  }
  // In place of occluded(): if it arrives it is joined().
  void light_ray(std::uint32_t path, int ray, double) {
    if (!first_) return;
    note_ray(ray, paths_[path].light.share);
    paths_[path].from_light = 0;
  }
  void connection_value(const V3f& direction, const BsdfValue& value) {
    if (first_) connected_ = lobe_share(value.f_cos, frame_.to_local(direction));
  }
  void connection(std::uint32_t, int ray, const LightVertex&, double, double, const Rgb&) {
    if (first_) note_ray(ray, connected_);
  }
  // Of several, one in proportion to what it counts.
  void joined(std::uint32_t path, int ray, const V3f& direction, const Rgb& contribution) {
    if (!first_) return;
    Sample& sample = paths_[path];
    const float brought = luminance(contribution), share = ray_shares_[ray];
    const float varied = sample.from_light * sample.light.share + brought * share;
    sample.from_light += brought;
    sample.light.share = sample.from_light > 0 ? std::min(varied / sample.from_light, 1.0f) : 0.0f;
    const std::uint32_t chance = combine_hash(std::bit_cast<std::uint32_t>(direction.x) + std::uint32_t(seed_),
                                              std::bit_cast<std::uint32_t>(direction.y));
    const float all = sample.from_light * DirectionReservoir::counting(sample.light.share);
    if (unit_float(chance) * all < brought * DirectionReservoir::counting(share))
      sample.light.direction = pack_direction<DirectionReservoir::kAxisBits>(direction);
  }
  void scatter(std::uint32_t path, const BsdfSample& sample, const Frame& frame) {
    if (!first_ || !sample.valid() || sample.delta) return;
    paths_[path].onwards = {pack_direction<DirectionReservoir::kAxisBits>(frame.to_world(sample.wi)),
                            lobe_share(sample.weight * sample.pdf_w, sample.wi)};
  }

  void store(std::size_t slot, std::uint32_t path, const Rgb& radiance) {
    samples_[slot] = paths_[path];
    samples_[slot].whole = luminance(radiance);
  }

  // A valid sample, which the film holds by now.
  void commit(std::size_t slot, int half, std::uint32_t index, std::uint32_t, int x, int y) {
    const Sample& sample = samples_[slot];
    const std::uint32_t key = combine_hash(pixel_key(x, y, half, seed_), index);
    DirectionReservoir::Chances u;
    std::uint32_t bits = key;
    for (float& place : u.place) place = unit_float(bits = hash32(bits));
    u.share = unit_float(hash32(bits));
    const HalfPixel& pixel = film_.half(half, x, y);
    const double whole = double(luminance(Rgb(V3d(pixel.sum[0], pixel.sum[1], pixel.sum[2]))));
    film_.history()->directions(x, y).add(half, sample.pick(unit_float(key)), sample.whole, sample.varies(), whole, u);
  }

 private:
  // Luminances, and what is told of the light. Of what came by the sampled direction: the rest.
  struct Sample {
    float emitted = 0, from_light = 0, whole = 0;
    ToldLight light, onwards;

    float rest() const { return std::max(whole - emitted - from_light, 0.0f); }
    float varies() const { return std::min(from_light * light.share + rest() * onwards.share, whole); }

    // The direction of one contribution, in proportion to what it counts.
    std::uint32_t pick(float u) const {
      const float shone = emitted * DirectionReservoir::kMatte;
      const float lit = from_light * DirectionReservoir::counting(light.share);
      const float at = u * (shone + lit + rest() * DirectionReservoir::counting(onwards.share));
      if (at < shone) return DirectionReservoir::kAny;
      return at < shone + lit ? light.direction : onwards.direction;
    }
  };

  // What of light from `wi`, local, of which the surface in hand sends f_cos on, its lobes do.
  float lobe_share(const Rgb& f_cos, const V3f& wi) const {
    return bsdf_ && !is_black(f_cos) ? varying_share(f_cos, bsdf_->matte(wi)) : 0;
  }
  void note_ray(int ray, float share) { ray_shares_[ray] = share; }

  Film& film_;
  const std::uint64_t seed_;
  bool first_ = false;  // the vertex in hand is the first
  Rgb beta_{1, 1, 1};
  const Bsdf* bsdf_ = nullptr;  // of the vertex in hand; null: Lambert
  Frame frame_{V3f(0, 0, 1)};
  float connected_ = 0;  // of the connection in hand
  float ray_shares_[ConnectionRays::kCapacity];
  Sample paths_[kGroupPaths];
  std::vector<Sample> samples_;
};

}  // namespace helio
