#include "renderer/frame/paper/first_hits.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cfloat>
#include <cmath>

#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/paper/paper_film.h"

namespace helio {
namespace {

std::size_t area(int width, int height) {
  return std::size_t(width) * std::size_t(height);
}

}  // namespace

FirstHits::FirstHits(int width, int height, int per_pixel)
    : width_(width),
      per_pixel_(per_pixel),
      pixels_(area(width, height)),
      hits_(pixels_.size() * std::size_t(per_pixel)),
      left_(std::make_unique<LeftPicture>(width, height, per_pixel)) {}

FirstHits::~FirstHits() = default;

void FirstHits::add(int half, std::uint32_t sample_index, std::uint32_t count, int x, int y,
                    const FirstHitSample& sample) {
  PixelHits& pixel = this->pixel(x, y);
  for (int c = 0; c < 3; ++c) {
    float& mean = pixel.irradiance[half][c];
    mean = round_stochastically(mean + (double(sample.irradiance[c]) - double(mean)) / count, count);
  }
  const std::span<StoredHit> stored = hits(x, y);
  const std::uint32_t slot = kHalves * sample_index + std::uint32_t(half);
  if (!pixel.settled && sample_index < kMostStoredHits && slot < std::uint32_t(per_pixel_) && sample.met) {
    stored[slot] = {sample.position, sample.directed ? pack_direction(sample.direction) : 0};
    pixel.met = std::uint8_t(pixel.met | 1u << slot);
    if (sample.directed) pixel.directed = std::uint8_t(pixel.directed | 1u << slot);
  }
  // The first stored hit is that of the pixel's first sample; one that met nothing is far from all that did. Where that
  // sample was invalid there is nothing to compare with.
  if (slot == 0) pixel.begun = true;
  const bool first_met = pixel.met & 1;
  if (!pixel.begun && !pixel.settled) return;
  if (sample.met != first_met ||
      (sample.met && !(length(sample.position - stored[0].position) <= kMostHitDistance * sample.footprint)))
    pixel.edge = true;
}

void FirstHits::clear(const PixelRect& window) {
  for (int y = window.y0; y < window.y1; ++y)
    std::fill_n(pixels_.begin() + std::ptrdiff_t(index(window.x0, y)), window.width(), PixelHits{});
}

std::size_t FirstHits::bytes() const {
  return pixels_.capacity() * sizeof(PixelHits) + hits_.capacity() * sizeof(StoredHit) + left_->bytes();
}

LeftPicture::LeftPicture(int width, int height, int per_pixel)
    : width_(width),
      per_pixel_(per_pixel),
      pixels_(area(width, height)),
      hits_(pixels_.size() * std::size_t(per_pixel)),
      bids_(pixels_.size(), kNoBid) {}

void LeftPicture::gather(const Film& film, const PixelRect& window) {
  const PaperFilm& kept = paper_film(film);
  const FirstHits& first_hits = *kept.first_hits();
  const FilmHistory& history = *film.history();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      Pixel& to = pixels_[index(x, y)];
      for (int h = 0; h < kHalves; ++h) to.half[h] = film.half(h, x, y);
      to.features = film.features(x, y);
      to.hits = first_hits.pixel(x, y);
      to.probability = kept.has_probabilities() ? kept.probability(x, y) : 0.0f;
      to.age = float(history.weight(x, y, to.half[0].count, to.half[1].count)) * history.carried(x, y).age;
      const std::span<const StoredHit> hits = first_hits.hits(x, y);
      std::copy(hits.begin(), hits.end(), hits_.begin() + std::ptrdiff_t(index(x, y) * std::size_t(per_pixel_)));
    }
  }
  withdraw_bids(window);
}

void LeftPicture::withdraw_bids(const PixelRect& window) {
  for (int y = window.y0; y < window.y1; ++y)
    std::fill_n(bids_.begin() + std::ptrdiff_t(index(window.x0, y)), window.width(), kNoBid);
}

void LeftPicture::bid(int x, int y, float distance, int from_x, int from_y) {
  // Of positive floats the bits are in the order of the values.
  const std::uint64_t mine =
      std::uint64_t(std::bit_cast<std::uint32_t>(distance)) << 32 | std::uint32_t(index(from_x, from_y));
  std::atomic_ref<std::uint64_t> best(bids_[index(x, y)]);
  std::uint64_t seen = best.load(std::memory_order_relaxed);
  while (mine < seen && !best.compare_exchange_weak(seen, mine, std::memory_order_relaxed)) {
  }
}

std::uint64_t LeftPicture::place(Film& film, int x, int y) const {
  const std::uint64_t bid = bids_[index(x, y)];
  if (bid == kNoBid) return 0;
  const std::size_t from = std::size_t(bid & 0xffffffffu);
  const Pixel& pixel = pixels_[from];
  CarriedPixel& carried = film.history()->carried(x, y);
  PaperFilm& kept = paper_film(film);
  PixelHits& hits = kept.first_hits()->pixel(x, y);
  hits = pixel.hits;
  hits.settled = true;
  std::uint64_t samples = 0;
  Rgb means[kHalves];
  for (int h = 0; h < kHalves; ++h) {
    HalfPixel& half = film.half(h, x, y) = pixel.half[1 - h];
    if (half.count > CarriedPixel::kMostCount) {
      const double kept = double(CarriedPixel::kMostCount) / half.count;
      for (int c = 0; c < 3; ++c) {
        half.sum[c] *= kept;
        half.deviations[c] *= float(kept);
      }
      half.count = CarriedPixel::kMostCount;
    }
    carried.count[h] = half.count;
    samples += half.count;
    for (int c = 0; c < 3; ++c) {
      hits.irradiance[h][c] = pixel.hits.irradiance[1 - h][c];
      const double mean = half.count > 0 ? half.sum[c] / half.count : 0;
      means[h][c] = float(std::clamp(mean, -double(FLT_MAX), double(FLT_MAX)));
    }
  }
  for (int h = 0; h < kHalves; ++h) {
    if (carried.count[h] == 0) means[h] = means[1 - h];
  }
  carried.means = PackedMeans(means[0], means[1]);
  carried.bias2 = 0;  // as published: nothing is known of it
  carried.age = pixel.age + 1;
  film.features(x, y) = pixel.features;
  film.features(x, y).depth = std::bit_cast<float>(std::uint32_t(bid >> 32));
  if (kept.has_probabilities()) kept.probability(x, y) = pixel.probability;
  const auto first = hits_.begin() + std::ptrdiff_t(from * std::size_t(per_pixel_));
  std::copy_n(first, per_pixel_, kept.first_hits()->hits(x, y).begin());
  return samples;
}

std::size_t LeftPicture::bytes() const {
  return pixels_.capacity() * sizeof(Pixel) + hits_.capacity() * sizeof(StoredHit) +
         bids_.capacity() * sizeof(std::uint64_t);
}

}  // namespace helio
