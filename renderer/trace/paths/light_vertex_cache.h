// The light paths of one pass over the picture, kept for the camera paths of the same pass (Davidovic et al. 2014,
// "Progressive Light Transport Simulation on the GPU", 4.2): a camera vertex is joined to a few light vertices drawn
// from all of them, or merged with those nearby (vertex_grid.h).
//
// Nothing in it depends on the camera, so it serves every view of the scene. It is made in batches, on several threads:
//   trace() all of them; the sweeps of the index, or index() in one go; gather() all of them, finish(); from then on it
//   is read.
// Bits depend on the scene and the settings alone.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/base/prefetch.h"
#include "renderer/base/raw_array.h"
#include "renderer/trace/paths/light_paths.h"
#include "renderer/trace/paths/vertex_grid.h"

namespace helio {

struct SampleTrace;

// Of a pass; there are fewer where paths leave so many vertices that it would have more than this.
inline constexpr std::uint64_t kMostPassPaths = 1u << 18, kMostPassVertices = 1u << 20;

class LightVertexCache {
 public:
  // Light paths number `sample` x paths to (sample + 1) x paths of the half. settings.region does not matter.
  // vertices_per_path: about how many a path leaves, from elsewhere (mean_light_vertices()): weights must not
  // depend on these very paths.
  LightVertexCache(std::shared_ptr<const RenderScene> scene, const PathSettings& settings, int half,
                   std::uint32_t sample, std::uint64_t paths, double vertices_per_path);

  int half() const { return half_; }
  std::uint32_t sample() const { return sample_; }
  std::uint64_t paths() const { return paths_; }
  const TechniqueCounts& counts() const { return counts_; }
  double radius() const { return radius_; }  // scene units; 0: nothing is merged

  std::size_t batches() const { return batches_.size(); }
  // `camera`: what the paths bring to its film is added to the film's splats at once; null: nothing. False: cancelled,
  // nothing has changed. Adds to `stats`. Thread safe for different batches.
  bool trace(std::size_t batch, const Camera* camera, const CancelToken& cancel, Film& film, TraceStats& stats);
  // What a batch brings to another camera. Precondition: ready().
  bool splat(std::size_t batch, const Camera& camera, const CancelToken& cancel, Film& film, TraceStats& stats);
  // Sorting, in parts: begin_index(); run_index() of every part of a sweep, in any order and by several threads,
  // then finish_index_sweep(), for each of the sweeps. With enough parts a call looks at a small share of the vertices.
  // index(): all of that.
  static constexpr int kIndexSweeps = 3;
  void begin_index(std::size_t parts);
  void run_index(int sweep, std::size_t part);
  void finish_index_sweep(int sweep);
  void index();
  void gather(std::size_t batch);
  void finish() { ready_ = true; }
  bool ready() const { return ready_; }

  // One of its light paths, numbered from 0, is traced again and told vertex by vertex, joined to the camera where the
  // integrator does so. False: cancelled. Needs nothing of what is above.
  bool tell(std::uint64_t path, const Camera& camera, const CancelToken& cancel, SampleTrace& trace) const;

  std::size_t vertices() const { return order_.size(); }
  // The vertex as it was traced, in every bit but MisState::path_tracer. v < vertices().
  LightVertex load(std::size_t v) const;
  // Before load(v), to have it fetched.
  void expect_vertex(std::size_t v) const {
    const char* record = reinterpret_cast<const char*>(&records_[v]);
    prefetch(record);
    prefetch(record + sizeof(Record) - 1);
  }
  // Calls visit(const Record&) for those within radius() of the point.
  template <typename Function>
  void for_each_near(const V3f& point, Function&& visit) const {
    grid_.for_each_near(point, [&](std::uint32_t v) { visit(records_[v]); });
  }

  // Before a search, to have what it looks at fetched (VertexGrid).
  void expect(const V3f& point) const { grid_.expect(point); }
  void expect_points(const V3f& point) const { grid_.expect_points(point); }

  std::size_t bytes() const;

  // What merging needs of a vertex, and all that the rest is made from.
  struct Record {
    Hit hit;
    V3f origin, direction;  // of the ray that arrived there
    Rgb throughput;
    double vcm, vc;
    MediumStack media;
    std::uint16_t depth;
    bool first;

    MisState mis() const { return {vcm, vc, 0, first}; }
    V3f position() const { return origin + direction * hit.t; }
  };

 private:
  struct Batch {
    std::vector<Record> records;
    std::vector<std::uint32_t> paths;  // by record: number in the batch
    std::size_t begin = 0;             // of its records among all
  };
  LightBatch numbers_of(std::size_t batch) const;
  // The light path of a batch, as what was invalid.
  InvalidSample sample_of(std::size_t batch, std::uint32_t path) const;
  LightVertex load(const Record& record) const;
  // batch: numbers_of(b). `traced`: has just traced the vertices; null: their points are made anew.
  void add_splats(std::size_t b, const LightBatch& batch, const std::vector<LightVertex>& vertices,
                  const LightPaths* traced, const std::vector<std::uint32_t>& paths, const Camera& camera, Film& film,
                  TraceStats& stats) const;

  std::shared_ptr<const RenderScene> scene_;
  PathSettings settings_;
  int half_;
  std::uint32_t sample_;
  std::uint64_t paths_;
  double radius_;
  TechniqueCounts counts_;
  std::vector<Batch> batches_;
  RawArray<std::uint32_t> order_;  // where a record goes, by its number as traced
  RawArray<Record> records_;       // ordered by the grid where there is merging
  std::size_t index_parts_ = 0, chunk_batches_ = 1;
  std::optional<VertexGridBuilder> builder_;  // of the index that is being made
  VertexGrid grid_;
  bool ready_ = false;
};

// Light paths of a pass over so many pixels: as many, within the bounds above.
std::uint64_t pass_paths(std::uint64_t pixels, double vertices_per_path);

// Of a pass: the radius within which light vertices are merged, shrinking as Knaus and Zwicker (2011, "Progressive
// Photon Mapping: A Probabilistic Approach", eq. 15) have it, so that bias and variance both vanish.
double merging_radius(const PathSettings& settings, double scene_radius, std::uint32_t sample);

// Vertices that a light path leaves on average, from a few hundred paths that no picture uses.
double mean_light_vertices(const RenderScene& scene, const PathSettings& settings);

}  // namespace helio
