// What a kernel notes for a film that keeps first hits (first_hits.h): where each camera ray arrived,
// which direction was sampled there, and what came back along it.
//
// A sample's irradiance Ir is worked out from its radiance R: with R_1 what it had after the first vertex (its emission
// and what lights sent it directly) and f cos / pdf the weight of the direction sampled there, light L_i came along
// that direction, R - R_1 = (f cos / pdf) L_i, and Ir = L_i cos / pdf = (R - R_1) / f.
#pragma once

#include <cmath>
#include <vector>

#include "renderer/frame/paper/paper_film.h"
#include "renderer/trace/integrators/path_recorder.h"

namespace helio {

class HitRecorder : public NoRecorder {
 public:
  static constexpr bool kRecordsForReuse = true;

  explicit HitRecorder(const WindowTask& task)
      : NoRecorder(task), first_hits_(*paper_film(task.film).first_hits()), cone_(task.camera.cone()) {}

  void make_room(std::size_t samples) { samples_.resize(samples); }

  // The camera rays of the group have been traced.
  void arrived(const PathGroup& group) {
    for (int i = 0; i < group.count; ++i) {
      Path& path = paths_[i];
      path = {};
      const Hit& hit = group.hits[i];
      if (!hit.valid()) continue;
      path.sample.met = true;
      RayCone cone = cone_;
      cone.advance(hit.t);
      path.sample.footprint = cone.footprint(1);
      path.sample.position = group.rays[i].origin + group.rays[i].direction * hit.t;
    }
  }

  // Of the general kernel alone: what Lambert surfaces reflect does not depend on the view, so the plain one has none
  // of this to tell.
  void segment(int vertex, std::uint32_t i, const PathGroup& group) {
    vertex_ = vertex;
    if (vertex != 2) return;
    paths_[i].went_on = true;
    paths_[i].before = group.paths[i].radiance;
  }
  void scatter(std::uint32_t i, const BsdfSample& sample, const Frame& frame) {
    if (vertex_ != 1 || !sample.valid() || sample.delta) return;
    Path& path = paths_[i];
    path.sample.directed = true;
    path.sample.direction = frame.to_world(sample.wi);
    path.f = sample.weight * (sample.pdf_w / std::fabs(sample.wi.z));
  }

  void store(std::size_t slot, std::uint32_t i, const Rgb& radiance) {
    Path& path = paths_[i];
    for (int c = 0; path.went_on && path.sample.directed && c < 3; ++c) {
      const float irradiance = (radiance[c] - path.before[c]) / path.f[c];
      path.sample.irradiance[c] = std::isfinite(irradiance) ? irradiance : 0;  // f = 0: nothing came of it
    }
    samples_[slot] = path.sample;
  }

  // A valid sample, the count-th of its half.
  void commit(std::size_t slot, int half, std::uint32_t index, std::uint32_t count, int x, int y) {
    first_hits_.add(half, index, count, x, y, samples_[slot]);
  }

 private:
  struct Path {
    FirstHitSample sample;
    bool went_on = false;  // reached a second vertex, or left the scene there
    Rgb before{0, 0, 0};   // radiance up to and with the first vertex
    Rgb f{0, 0, 0};        // of the sampled direction
  };

  FirstHits& first_hits_;
  const RayCone cone_;  // of a pixel
  int vertex_ = 0;
  Path paths_[kGroupPaths];
  std::vector<FirstHitSample> samples_;
};

}  // namespace helio
