// Shadow rays of a group of camera paths, many of one path: traced a batch at a time, each with what it brings to its
// path's radiance if nothing lies in its way.
#pragma once

#include "renderer/trace/paths/path_group.h"

namespace helio {

class ConnectionRays {
 public:
  static constexpr int kCapacity = 512;

  bool full() const { return count_ == kCapacity; }
  int count() const { return count_; }
  void clear() { count_ = 0; }
  const Ray* rays() const { return rays_; }

  // Precondition: not full. `tag` is the caller's.
  void add(const V3f& origin, const V3f& direction, float t_max, std::uint32_t alpha_key, std::uint32_t tag,
           const Rgb& radiance) {
    rays_[count_] = {origin, t_max, direction, alpha_key};
    radiance_[count_] = radiance;
    tags_[count_++] = tag;
  }

  // Between two points that are off their surfaces. Nothing stops it where they coincide.
  void add_between(const V3f& from, const V3f& to, std::uint32_t alpha_key, std::uint32_t tag, const Rgb& radiance) {
    const V3d between = V3d(to) - V3d(from);
    const double distance = length(between);
    const V3f direction = distance > 0 ? V3f(between / distance) : V3f(0, 0, 1);
    add(from, direction, float(distance * (1 - 0x1p-20)), alpha_key, tag, radiance);
  }

  // Calls arrived(number, tag, radiance) for those that nothing stops, in the order in which they were added, from 0
  // on, and forgets all.
  template <typename Function>
  void trace(const Accel& accel, Function&& arrived) {
    accel.occluded(rays_, std::size_t(count_), occluded_);
    for (int k = 0; k < count_; ++k) {
      if (!occluded_[k]) arrived(k, tags_[k], radiance_[k]);
    }
    count_ = 0;
  }

 private:
  int count_ = 0;
  Ray rays_[kCapacity];
  Rgb radiance_[kCapacity];
  std::uint32_t tags_[kCapacity];
  std::uint8_t occluded_[kCapacity];
};

}  // namespace helio
