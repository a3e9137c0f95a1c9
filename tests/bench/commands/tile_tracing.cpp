#include "tests/bench/commands/tile_tracing.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include "renderer/base/clock.h"

namespace helio::bench {

std::vector<PixelRect> cut_into_strips(const PixelRect& picture) {
  constexpr int kWidth = 128, kHeight = kPathGroupSize;
  std::vector<PixelRect> strips;
  for (int y = picture.y0; y < picture.y1; y += kHeight) {
    for (int x = picture.x0; x < picture.x1; x += kWidth) {
      strips.push_back({x, y, std::min(x + kWidth, picture.x1), std::min(y + kHeight, picture.y1)});
    }
  }
  return strips;
}

double run_on_threads(int threads, std::size_t count, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  const double started = now_s();
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(run);
  run();
  for (std::thread& thread : others) thread.join();
  return now_s() - started;
}

TracedPicture trace_picture(const RenderScene& scene, const Camera& camera, const PathSettings& settings, int samples,
                            const PixelRect& window, int threads, Film& film, std::vector<RayLog>* logs) {
  const std::vector<PixelRect> strips = cut_into_strips(window);
  if (logs) logs->resize(strips.size());
  std::vector<TraceStats> stats(strips.size());
  const CancelToken never;
  TracedPicture result;
  result.seconds = run_on_threads(threads, strips.size(), [&](std::size_t i) {
    for (int half = 0; half < kHalves; ++half) {
      const SampleRange range{half, 0, std::uint32_t((samples + 1 - half) / kHalves)};
      trace_window_logged(scene, camera, settings, range, strips[i], never, film, stats[i],
                          logs ? &(*logs)[i] : nullptr);
    }
  });
  for (const TraceStats& s : stats) result.stats.add(s);
  return result;
}

}  // namespace helio::bench
