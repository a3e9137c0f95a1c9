// A pass of light paths, made in one go.
#pragma once

#include <memory>

#include "renderer/trace/paths/light_vertex_cache.h"

namespace helio::test {

// `camera`: whose film gets what they bring; null: nobody's.
inline std::shared_ptr<LightVertexCache> make_light_cache(const std::shared_ptr<const RenderScene>& scene,
                                                          const PathSettings& settings, int half, std::uint32_t sample,
                                                          std::uint64_t paths, const Camera* camera, Film& film,
                                                          TraceStats& stats) {
  const double per_path = mean_light_vertices(*scene, settings);
  auto cache = std::make_shared<LightVertexCache>(scene, settings, half, sample, paths, per_path);
  const CancelToken never;
  for (std::size_t b = 0; b < cache->batches(); ++b) cache->trace(b, camera, never, film, stats);
  cache->index();
  for (std::size_t b = 0; b < cache->batches(); ++b) cache->gather(b);
  cache->finish();
  return cache;
}

}  // namespace helio::test
