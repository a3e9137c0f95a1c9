// Radiance from a hash instead of rays: deterministic, of a chosen cost, and able to misbehave.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/film/core/sample_targets.h"
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
  float rare_share = 0, rare = 0;     // a share of the samples has `rare` added
  float noisy_from = 2;               // share of the width from which on the noise is ten times as large

  struct Counters {
    std::atomic<std::uint64_t> samples{0}, out_of_order{0}, cancelled{0};
    std::mutex mutex;
    std::vector<double> calls_s;  // when each piece began
  };
  std::shared_ptr<Counters> counters = std::make_shared<Counters>();

  IntegrateFunction function() const {
    return [self = *this](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
      return self.run(job, cancel, film, stats);
    };
  }

  bool run(const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) const {
    {
      const std::lock_guard lock(counters->mutex);
      counters->calls_s.push_back(now_s());
    }
    const PixelRect& w = job.window;
    const SampleRange& range = job.range;
    const std::uint64_t samples = job.targets ? job.targets->samples_in(film, range.half, w, range.first, range.count)
                                              : std::uint64_t(w.area()) * range.count;
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
        if (!job.targets && film.attempted(range.half, x, y) != range.first) counters->out_of_order++;
        const float own_noise = float(x) < noisy_from * float(job.settings.width) ? noise : 10 * noise;
        std::uint32_t added = 0;
        for (std::uint32_t i = 0; i < job.range.count; ++i) {
          const std::uint32_t index = job.range.first + i;
          if (job.targets && !job.targets->wants(film, range.half, x, y, index)) continue;
          if (film.attempted(range.half, x, y) != index) counters->out_of_order++;
          ++added;
          const float u = hash_sample(job.settings.seed, x, y, job.range.half, index);
          if (hash_sample(~job.settings.seed, x, y, job.range.half, index) < invalid_share || lost == std::pair(x, y)) {
            film.add_invalid(job.range.half, x, y);
            stats.note_invalid({x, y, job.range.half, index});
          } else {
            const bool bright = hash_sample(job.settings.seed + 77, x, y, job.range.half, index) < rare_share;
            pixel.add(Rgb(mean + own_noise * (2 * u - 1) + (bright ? rare : 0)));
          }
        }
        PixelFeatures& f = film.features(x, y);
        f.count += added;
        if (!misses) f.hits += added;
        for (float& albedo : f.albedo) albedo = misses ? 0.0f : 0.5f;
      }
    }
    film.add_work(range.half, w.x0, w.y0, samples, samples);
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
