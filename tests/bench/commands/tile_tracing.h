// trace_window over a whole picture by a fixed number of threads: the path tracer without the render loop around it.
#pragma once

#include <functional>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/trace/paths/path_kernel.h"

namespace helio::bench {

// Strips of 128 x 8 pixels, the shape of the render loop's pieces, row by row.
std::vector<PixelRect> cut_into_strips(const PixelRect& picture);

// Runs work(i) for every i < count on `threads` threads, which take the numbers in turn. Seconds of wall time.
double run_on_threads(int threads, std::size_t count, const std::function<void(std::size_t)>& work);

struct TracedPicture {
  double seconds = 0;
  TraceStats stats;
};

// `samples` per pixel, the halves taking turns. With `logs`, one log per strip is appended to it.
TracedPicture trace_picture(const RenderScene& scene, const Camera& camera, const PathSettings& settings, int samples,
                            const PixelRect& window, int threads, Film& film, std::vector<RayLog>* logs = nullptr);

}  // namespace helio::bench
