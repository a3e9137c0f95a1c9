// Light paths: traced a batch at a time, one vertex a round as camera paths are, and kept as the vertices at which they
// can be joined to something.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/trace/paths/bidirectional_mis.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/paths/path_vertex.h"
#include "renderer/trace/paths/point_store.h"

namespace helio {

inline constexpr std::uint32_t kNoVertex = ~std::uint32_t(0);

// At most so many paths in a batch.
inline constexpr int kLightBatch = kPathGroupSize * kPathGroupSize;

struct LightVertex : PathVertex {
  V3f origin;      // of the ray that arrived
  Rgb throughput;  // of the light that arrives, the light's own included: what f_cos is multiplied by
  MisState mis;
  MediumStack media;       // on the side that the light arrives on
  int depth;               // segments from the light
  std::uint32_t previous;  // nearer to the light on the same path, of those that are kept; or kNoVertex
};

// Which paths: path i of the batch has the random numbers of `keys[i]` and sample `index[i]`.
struct LightBatch {
  int count = 0;
  std::uint32_t keys[kLightBatch];
  std::uint32_t reversed_index[kLightBatch];  // reverse_bits() of the sample's index
};

class LightPaths {
 public:
  // Traces the batch to the end of its paths, in place of what was there. A path has up to max_segments - 1 segments.
  // The bits depend on the batch as a whole. Adds to `stats` rays and media_overflows. Ends early, with paths that are
  // of no use, once `cancel` is raised.
  void trace(const SceneData& scene, const PathSettings& settings, const LightBatch& batch,
             const TechniqueCounts& counts, const CancelToken& cancel, TraceStats& stats);

  // By rounds: those of one path in the order of their depth. Surfaces that only mirror are left out.
  const std::vector<LightVertex>& vertices() const { return vertices_; }
  // The last vertex of a path, from which `previous` leads to the others; kNoVertex: none.
  std::uint32_t last(int path) const { return last_[path]; }
  // The vertex as its light sees it, for PathVertex::scatter(); null: it was not kept.
  const ShadingPoint* point(std::uint32_t vertex) const { return points_.at(vertex); }
  // The path that a vertex belongs to.
  std::uint32_t path_of(std::uint32_t vertex) const { return path_of_[vertex]; }

 private:
  struct State {
    EmissionSample emission;
    Rgb throughput;         // the light's included
    Rgb relative{1, 1, 1};  // since the light, for roulette
    MisState mis;
    MediumStack media;
    bool from_light = true;  // no vertex yet
  };

  void start(const SceneData& scene, const LightBatch& batch);
  void enter_media_of_lights(const SceneData& scene, TraceStats& stats);
  bool shade(const SceneData& scene, const PathSettings& settings, const LightBatch& batch,
             const TechniqueCounts& counts, int depth, std::uint32_t i, TraceStats& stats);

  Ray rays_[kLightBatch];
  Hit hits_[kLightBatch];
  State states_[kLightBatch];
  std::uint32_t active_[kLightBatch];
  std::uint32_t last_[kLightBatch];
  int active_count_ = 0;
  std::vector<LightVertex> vertices_;
  PointStore points_;  // of the vertices
  std::vector<std::uint32_t> path_of_;
};

}  // namespace helio
