// Radiance from a hash instead of rays: deterministic, of a chosen cost, and able to misbehave.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/frame/thread_clock.h"

namespace helio {

// Uniform in [0, 1), from the sample's coordinates alone (the finaliser of MurmurHash3).
inline float hash_sample(std::uint64_t seed, int x, int y, int half, std::uint32_t index) {
  std::uint64_t h = seed * 0x9e3779b97f4a7c15ull + (std::uint64_t(x) << 40) + (std::uint64_t(y) << 20) +
                    (std::uint64_t(half) << 63) + index * 0xd6e8feb86659fd93ull;
  h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdull;
  h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ull;
  return float((h ^ (h >> 33)) >> 40) * 0x1p-24f;
}

struct FakeIntegrator {
  double seconds_per_sample = 0;      // of busy work, polling the cancel token
  float mean = 0.5f, noise = 0.5f;    // radiance = mean + noise (2 u - 1)
  std::uint64_t throw_after = ~0ull;  // samples
  double invalid_share = 0;           // of samples that are not finite
  std::pair<int, int> lost = {-1, -1};  // a pixel all of whose samples are not finite
  bool misses = false;                // nothing is met; else grey surfaces

  struct Counters {
    std::atomic<std::uint64_t> samples{0}, out_of_order{0}, cancelled{0};
    std::atomic<double> last_call_s{0};  // when the newest piece began
  };
  std::shared_ptr<Counters> counters = std::make_shared<Counters>();

  IntegrateFunction function() const {
    return [self = *this](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
      return self.run(job, cancel, film, stats);
    };
  }

  bool run(const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) const {
    counters->last_call_s = now_s();
    const PixelRect& w = job.window;
    const std::uint64_t samples = std::uint64_t(w.area()) * job.range.count;
    if (counters->samples + samples > throw_after) throw std::runtime_error("the ray got lost");
    const double end = thread_cpu_s() + seconds_per_sample * double(samples);
    while (seconds_per_sample > 0 && thread_cpu_s() < end) {
      if (!cancel.cancelled()) continue;
      counters->cancelled++;
      return false;
    }
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        HalfPixel& pixel = film.half(job.range.half, x, y);
        if (pixel.count + film.invalid(job.range.half, x, y) != job.range.first) counters->out_of_order++;
        for (std::uint32_t i = 0; i < job.range.count; ++i) {
          const std::uint32_t index = job.range.first + i;
          const float u = hash_sample(job.settings.seed, x, y, job.range.half, index);
          if (hash_sample(~job.settings.seed, x, y, job.range.half, index) < invalid_share || lost == std::pair(x, y)) {
            film.add_invalid(job.range.half, x, y);
            stats.note_invalid({x, y, job.range.half, index});
          } else {
            pixel.add(Rgb(mean + noise * (2 * u - 1)));
          }
        }
        PixelFeatures& f = film.features(x, y);
        f.count += job.range.count;
        if (!misses) f.hits += job.range.count;
        for (float& albedo : f.albedo) albedo = misses ? 0.0f : 0.5f;
      }
    }
    stats.paths += samples;
    stats.rays += samples;
    counters->samples += samples;
    return true;
  }
};

inline CameraPose pose_at(double x) {
  CameraPose pose;
  pose.position = V3d(x, 0, 0);
  return pose;
}

inline View view_at(std::uint64_t id, double x) {
  View view;
  view.id = id;
  view.camera = pose_at(x);
  return view;
}

inline RenderSettings film_of(int width, int height) {
  RenderSettings settings;
  settings.width = width;
  settings.height = height;
  return settings;
}

}  // namespace helio
