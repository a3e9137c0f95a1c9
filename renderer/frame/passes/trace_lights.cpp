#include "renderer/frame/passes/trace_lights.h"

#include <algorithm>
#include <utility>

namespace helio {

LightVertexWork::LightVertexWork(std::shared_ptr<const RenderScene> scene, const PathSettings& settings, int half,
                                 std::uint32_t sample, std::shared_ptr<LightVertexCache> cache,
                                 std::optional<double> vertices_per_path)
    : scene_(std::move(scene)),
      settings_(settings),
      half_(half),
      sample_(sample),
      paths_(std::min<std::uint64_t>(std::uint64_t(settings.region.area()), kMostLightPaths)),
      cache_(std::move(cache)),
      vertices_per_path_(vertices_per_path),
      made_(cache_ != nullptr) {}

void LightVertexWork::aim(const Camera& camera, std::shared_ptr<const CancelToken> cancel, Film& film) {
  camera_ = camera;
  cancel_ = std::move(cancel);
  film_ = &film;
}

std::size_t LightVertexWork::parts() const {
  return std::size_t((paths_ + kBatches * kLightBatch - 1) / (kBatches * kLightBatch));
}

void LightVertexWork::run(int sweep, std::size_t part) {
  if (sweep == kPrepare) {
    if (part > 0) return;
    if (!vertices_per_path_) vertices_per_path_ = mean_light_vertices(*scene_, settings_);
    if (!cache_) {
      cache_ = std::make_shared<LightVertexCache>(scene_, settings_, half_, sample_, paths_, *vertices_per_path_);
    }
    done_.resize(cache_->batches(), 0);
    gathered_.resize(cache_->batches(), 0);
    return;
  }
  if (sweep == kIndex) {
    if (part > 0 || !traced_ || made_ || indexed_) return;
    cache_->index();
    indexed_ = true;
    return;
  }
  TraceStats stats;
  // Photons alone are joined to no camera.
  const Camera* camera = settings_.integrator == Integrator::photon ? nullptr : &*camera_;
  const std::size_t end = std::min((part + 1) * kBatches, cache_->batches());
  for (std::size_t b = part * kBatches; b < end; ++b) {
    if (sweep == kGather) {
      if (!traced_ || made_ || gathered_[b]) continue;
      cache_->gather(b);
      gathered_[b] = true;
    } else if (!done_[b]) {
      const bool splats = camera && made_;
      done_[b] = made_ ? !splats || cache_->splat(b, *camera, *cancel_, *film_, stats)
                       : cache_->trace(b, camera, *cancel_, *film_, stats);
    }
  }
  const std::lock_guard lock(mutex_);
  stats_.add(stats);
}

void LightVertexWork::finish_sweep(int sweep) {
  if (sweep == kTrace) traced_ = std::all_of(done_.begin(), done_.end(), [](std::uint8_t done) { return done != 0; });
  if (sweep != kGather || !traced_) return;
  complete_ = true;
  cache_->finish();
}

TraceStats LightVertexWork::take_stats() {
  const std::lock_guard lock(mutex_);
  return std::exchange(stats_, {});
}

void LightVertexSource::aim(const Camera& camera, std::shared_ptr<const CancelToken> cancel, Film& film) {
  camera_ = camera;
  cancel_ = std::move(cancel);
  film_ = &film;
}

void LightVertexSource::begin_picture() {
  if (!current_) return;
  if (current_->complete()) {
    vertices_per_path_ = current_->vertices_per_path();
    if (current_->sample() == 0) first_[current_->half()] = current_->cache();
  }
  current_.reset();
}

std::shared_ptr<LightVertexWork> LightVertexSource::begin(int half, std::uint32_t sample) {
  if (!current_ || current_->half() != half || current_->sample() != sample) {
    begin_picture();
    auto kept = sample == 0 ? first_[half] : std::shared_ptr<LightVertexCache>();
    current_ = std::make_shared<LightVertexWork>(scene_, settings_, half, sample, std::move(kept), vertices_per_path_);
  }
  current_->aim(*camera_, cancel_, *film_);
  return current_;
}

const LightVertexCache* LightVertexSource::cache() const {
  return current_ && current_->complete() ? current_->cache().get() : nullptr;
}

std::size_t LightVertexSource::bytes() const {
  std::size_t sum = 0;
  for (const auto& cache : first_) sum += cache ? cache->bytes() : 0;
  if (const LightVertexCache* now = cache(); now && now->sample() > 0) sum += now->bytes();
  return sum;
}

}  // namespace helio
