#include "renderer/frame/stages/trace_lights.h"

#include <algorithm>
#include <utility>

namespace helio {

LightVertexWork::LightVertexWork(std::shared_ptr<const RenderScene> scene, const PathSettings& settings, int half,
                                 std::uint32_t sample, std::shared_ptr<LightVertexCache> cache,
                                 std::optional<double> vertices_per_path)
    : FrameStage(StageId::trace_lights),
      scene_(std::move(scene)),
      settings_(settings),
      half_(half),
      sample_(sample),
      cache_(std::move(cache)),
      vertices_per_path_(vertices_per_path),
      made_(cache_ != nullptr) {}

void LightVertexWork::aim(const Camera& camera, std::shared_ptr<const CancelToken> cancel, Film& film) {
  camera_ = camera;
  cancel_ = std::move(cancel);
  film_ = &film;
}

std::size_t LightVertexWork::parts() const {
  if (complete_) return 0;
  const std::uint64_t most = pass_paths(std::uint64_t(settings_.region.area()), 0);
  return std::size_t((most + kBatches * kLightBatch - 1) / (kBatches * kLightBatch));
}

void LightVertexWork::run(int sweep, std::size_t part, TraceStats& stats) {
  if (sweep == kPrepare) {
    if (part > 0) return;
    spent_.reset();
    if (!vertices_per_path_) vertices_per_path_ = mean_light_vertices(*scene_, settings_);
    if (!cache_) {
      const std::uint64_t paths = pass_paths(std::uint64_t(settings_.region.area()), *vertices_per_path_);
      cache_ = std::make_shared<LightVertexCache>(scene_, settings_, half_, sample_, paths, *vertices_per_path_);
    }
    done_.resize(cache_->batches(), 0);
    gathered_.resize(cache_->batches(), 0);
    return;
  }
  if (sweep >= kIndex && sweep < kGather) {
    if (gathers() && !indexed_) cache_->run_index(sweep - kIndex, part);
    return;
  }
  // Photons alone are joined to no camera.
  const Camera* camera = settings_.integrator == Integrator::photon ? nullptr : &*camera_;
  const std::size_t end = std::min((part + 1) * kBatches, cache_->batches());
  for (std::size_t b = part * kBatches; b < end; ++b) {
    if (sweep == kGather) {
      if (!gathers() || gathered_[b]) continue;
      cache_->gather(b);
      gathered_[b] = true;
    } else if (!done_[b]) {
      const bool splats = camera && made_;
      done_[b] = made_ ? !splats || cache_->splat(b, *camera, *cancel_, *film_, stats)
                       : cache_->trace(b, camera, *cancel_, *film_, stats);
    }
  }
}

void LightVertexWork::finish_sweep(int sweep) {
  if (sweep == kTrace) {
    traced_ = std::all_of(done_.begin(), done_.end(), [](std::uint8_t done) { return done != 0; });
    if (gathers() && !indexed_) cache_->begin_index(parts());
  } else if (sweep >= kIndex && sweep < kGather && gathers() && !indexed_) {
    cache_->finish_index_sweep(sweep - kIndex);
    indexed_ = sweep + 1 == kGather;
  }
  if (sweep != kGather || !traced_) return;
  complete_ = true;
  cache_->finish();
}

void LightVertexSource::aim(const Camera& camera, std::shared_ptr<const CancelToken> cancel, Film& film) {
  camera_ = camera;
  cancel_ = std::move(cancel);
  film_ = &film;
}

std::shared_ptr<LightVertexWork> LightVertexSource::set_aside() {
  if (current_ && current_->complete()) {
    vertices_per_path_ = current_->vertices_per_path();
    if (keep_ && current_->sample() == 0) first_[current_->half()] = current_->cache();
  }
  return std::exchange(current_, nullptr);
}

std::shared_ptr<LightVertexWork> LightVertexSource::begin(int half, std::uint32_t sample) {
  if (!current_ || current_->half() != half || current_->sample() != sample) {
    std::shared_ptr<LightVertexWork> spent = set_aside();
    auto kept = sample == 0 ? first_[half] : std::shared_ptr<LightVertexCache>();
    current_ = std::make_shared<LightVertexWork>(scene_, settings_, half, sample, std::move(kept), vertices_per_path_);
    current_->free_on_the_way(std::move(spent));
  }
  current_->aim(*camera_, cancel_, *film_);
  return current_;
}

const LightVertexCache* LightVertexSource::cache() const {
  return current_ && current_->complete() ? current_->cache().get() : nullptr;
}

std::uint64_t LightVertexSource::most_bytes(const PathSettings& settings) {
  // The first pass of either half, the one in hand, and what it is made of.
  constexpr std::uint64_t kPasses = 4, kBytes = 160;
  const auto paths = pass_paths(std::uint64_t(settings.region.area()), 0);
  return kPasses * kBytes * std::min(kMostPassVertices, paths * std::uint64_t(settings.max_segments));
}

std::size_t LightVertexSource::bytes() const {
  std::size_t sum = 0;
  for (const auto& cache : first_) sum += cache ? cache->bytes() : 0;
  const LightVertexCache* now = cache();
  if (now && now != first_[0].get() && now != first_[1].get()) sum += now->bytes();
  return sum;
}

}  // namespace helio
