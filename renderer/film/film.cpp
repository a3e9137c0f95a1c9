#include "renderer/film/core/film.h"

#include <algorithm>
#include <atomic>

#include "renderer/base/check.h"
#include "renderer/film/core/film_extension.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/splats/splat_buffer.h"

namespace helio {

Film::Film(int width, int height, const FilmState& state)
    : width_(width),
      height_(height),
      block_columns_((width + kFilmBlock - 1) / kFilmBlock),
      state_(state),
      invalid_(std::size_t(width) * std::size_t(height)) {
  HELIO_DCHECK(width > 0 && height > 0);
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (std::vector<HalfPixel>& half : halves_) half.resize(pixels);
  features_.resize(pixels);
  for (std::vector<BlockWork>& work : work_)
    work.resize(std::size_t(block_columns_) * std::size_t((height + kFilmBlock - 1) / kFilmBlock));
  HELIO_DCHECK(state.targets || !state.exact_counts);
  HELIO_DCHECK(state.history || !state.carried_only);
  const bool sources = state.history && !state.carried_only;
  if (state.targets) targets_ = std::make_unique<SampleTargets>(width, height, state.exact_counts);
  if (state.history) history_ = std::make_unique<FilmHistory>(width, height, sources);
  if (state.splats) splats_ = std::make_unique<SplatBuffer>(width, height, sources);
  if (state.extension) extension_ = state.extension->make(width, height);
}

std::size_t Film::bytes_per_pixel(const FilmState& state) {
  std::size_t bytes = kHalves * sizeof(HalfPixel) + sizeof(PixelFeatures);
  const bool sources = state.history && !state.carried_only;
  if (state.targets) bytes += SampleTargets::bytes_per_pixel(state.exact_counts);
  if (state.history) bytes += FilmHistory::bytes_per_pixel(sources);
  if (state.splats) bytes += SplatBuffer::kBytesPerPixel;
  if (state.splats && sources) bytes += SplatBuffer::kDirectionBytes;
  if (state.extension) bytes += state.extension->bytes_per_pixel;
  return bytes;
}

std::uint32_t Film::carried(int h, int x, int y) const {
  return history_->carried(x, y).count[h];
}

Film::~Film() = default;
Film::Film(Film&&) noexcept = default;
Film& Film::operator=(Film&&) noexcept = default;

std::size_t Film::bytes() const {
  std::size_t total = features_.capacity() * sizeof(PixelFeatures) + (targets_ ? targets_->bytes() : 0) +
                      (history_ ? history_->bytes() : 0) + (splats_ ? splats_->bytes() : 0) +
                      (extension_ ? extension_->bytes() : 0) + invalid_.bytes();
  for (const std::vector<BlockWork>& work : work_) total += work.capacity() * sizeof(BlockWork);
  for (const std::vector<HalfPixel>& half : halves_) total += half.capacity() * sizeof(HalfPixel);
  return total;
}

void Film::add_invalid(int h, int x, int y, std::uint32_t samples) {
  invalid_.add(h, index(x, y), samples);
}

void Film::add_work(int h, int x, int y, std::uint64_t rays, std::uint64_t paths) {
  BlockWork& work = block(h, x, y);
  std::atomic_ref(work.rays).fetch_add(rays, std::memory_order_relaxed);
  std::atomic_ref(work.paths).fetch_add(paths, std::memory_order_relaxed);
}

void Film::add_merging_bias(int h, int x, int y, double bias) {
  std::atomic_ref(block(h, x, y).bias).fetch_add(bias, std::memory_order_relaxed);
}

BlockWork Film::work(int h, int x, int y) const {
  return const_cast<Film*>(this)->block(h, x, y);
}

std::uint64_t Film::invalid_in(const PixelRect& window) const {
  std::uint64_t total = 0;
  if (!invalid_.any()) return total;
  for (int h = 0; h < kHalves; ++h) {
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) total += invalid(h, x, y);
    }
  }
  return total;
}

void Film::clear() {
  clear(bounds());
  if (splats_) splats_->clear();
}

void Film::clear(const PixelRect& window) {
  for (int y = window.y0; y < window.y1; ++y) {
    const std::size_t first = index(window.x0, y);
    for (std::vector<HalfPixel>& half : halves_)
      std::fill_n(half.begin() + std::ptrdiff_t(first), window.width(), HalfPixel{});
    invalid_.clear(first, std::size_t(window.width()));
    std::fill_n(features_.begin() + std::ptrdiff_t(first), window.width(), PixelFeatures{});
  }
  if (history_) history_->clear(window);
  if (extension_) extension_->clear(window);
  for (int y = window.y0; y < window.y1; y = (y / kFilmBlock + 1) * kFilmBlock) {
    for (int x = window.x0; x < window.x1; x = (x / kFilmBlock + 1) * kFilmBlock) {
      for (int h = 0; h < kHalves; ++h) block(h, x, y) = {};
    }
  }
}

}  // namespace helio
