// Stage: traces the light paths that the next sample of every pixel draws on (trace/paths/light_vertex_cache.h), one pass over
// the picture at a time. Integrators for which caches_light_vertices().
//
// The first pass of each half is kept when the camera moves: light paths know nothing of it, so that the first samples
// of the new picture only join them to the new camera.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/film/core/film.h"
#include "renderer/frame/stage.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/light_vertex_cache.h"

namespace helio {

// What a film gets from one pass of light paths. Resumes where it was interrupted.
class LightVertexWork final : public FrameStage {
 public:
  // `cache`: null, or what the pass made for another camera. vertices_per_path: mean_light_vertices(), or absent.
  LightVertexWork(std::shared_ptr<const RenderScene> scene, const PathSettings& settings, int half,
                  std::uint32_t sample, std::shared_ptr<LightVertexCache> cache,
                  std::optional<double> vertices_per_path);

  // Before its sweeps begin, or begin again. The film outlives them.
  void aim(const Camera& camera, std::shared_ptr<const CancelToken> cancel, Film& film);

  std::size_t parts() const override;
  int sweeps() const override { return kGather + 1; }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;

  // After the sweeps: all of it is done; else they were cancelled. Thread safe.
  bool complete() const { return complete_; }
  const std::shared_ptr<LightVertexCache>& cache() const { return cache_; }
  int half() const { return half_; }
  std::uint32_t sample() const { return sample_; }
  std::optional<double> vertices_per_path() const { return vertices_per_path_; }
  // Frees it where the first of the sweeps runs: that takes long.
  void free_on_the_way(std::shared_ptr<LightVertexWork> spent) { spent_ = std::move(spent); }

 private:
  enum Sweep { kPrepare, kTrace, kIndex, kGather = kIndex + LightVertexCache::kIndexSweeps };
  bool gathers() const { return traced_ && !made_; }
  static constexpr std::size_t kBatches = 2;  // of a part: about 5 ms

  std::shared_ptr<const RenderScene> scene_;
  PathSettings settings_;
  int half_;
  std::uint32_t sample_;
  std::shared_ptr<LightVertexCache> cache_;
  std::optional<double> vertices_per_path_;
  std::optional<Camera> camera_;
  std::shared_ptr<const CancelToken> cancel_;
  Film* film_ = nullptr;
  std::shared_ptr<LightVertexWork> spent_;
  std::vector<std::uint8_t> done_, gathered_;  // by batch
  bool made_ = false;                          // by an earlier work
  bool traced_ = false, indexed_ = false;
  std::atomic<bool> complete_ = false;
};

// The passes of a picture, in the order of their samples. Not thread safe: the owner's lock guards it.
class LightVertexSource {
 public:
  // keep: the first pass of each half serves later cameras.
  LightVertexSource(std::shared_ptr<const RenderScene> scene, const PathSettings& settings, bool keep = true)
      : scene_(std::move(scene)), settings_(settings), keep_(keep) {}

  bool suits(const std::shared_ptr<const RenderScene>& scene, const PathSettings& settings) const {
    return scene == scene_ && settings == settings_;
  }
  // The film begins anew, for whatever camera. Returns what is to be freed.
  std::shared_ptr<LightVertexWork> set_aside();
  // Of the plan in hand.
  void aim(const Camera& camera, std::shared_ptr<const CancelToken> cancel, Film& film);
  // The pass of this sample.
  std::shared_ptr<LightVertexWork> begin(int half, std::uint32_t sample);
  // Of what begin() returned last: null where it is not complete.
  const LightVertexCache* cache() const;

  // Whether the splats in the film are those of whole samples, of which every pixel has so many per half.
  bool settled(const std::uint32_t done[kHalves]) const {
    return !current_ || (current_->complete() && done[current_->half()] > current_->sample());
  }

  std::size_t bytes() const;  // of the passes that are complete
  // What all passes together take at most, those in the making included.
  static std::uint64_t most_bytes(const PathSettings& settings);

 private:
  std::shared_ptr<const RenderScene> scene_;
  PathSettings settings_;
  bool keep_;
  std::optional<Camera> camera_;
  std::shared_ptr<const CancelToken> cancel_;
  Film* film_ = nullptr;
  std::optional<double> vertices_per_path_;
  std::shared_ptr<LightVertexWork> current_;
  std::shared_ptr<LightVertexCache> first_[kHalves];  // sample 0
};

}  // namespace helio
