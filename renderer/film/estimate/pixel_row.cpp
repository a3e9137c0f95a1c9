#include "renderer/film/estimate/pixel_row.h"

#include <algorithm>
#include <cfloat>
#include <cstddef>

#include "renderer/film/core/lanes.h"
#include "renderer/film/estimate/variance_term.h"

namespace helio {
namespace {

static_assert(offsetof(HalfPixel, sum) == 0 && offsetof(HalfPixel, deviations) == 3 * sizeof(double) &&
              offsetof(HalfPixel, count) == 3 * sizeof(double) + 3 * sizeof(float) && sizeof(HalfPixel) == 40);

// Three channels and 0. What the fourth lane held may be subnormal, and so slow to calculate with.
void load_sum(const HalfPixel& half, Double4& sum) {
  load(&half, sum);
  sum = (Double4)((Long4)sum & Long4{-1, -1, -1, 0});
}
void load_deviations(const HalfPixel& half, Double4& deviations) {
  Float4 narrow;
  load(&half.deviations, narrow);
  narrow[3] = 0;
  deviations = __builtin_convertvector(narrow, Double4);
}

void store_mean(const Double4& mean, float* out) {
  store(__builtin_convertvector(mean, Float4), out);
}

// Sums of doubles may be beyond the range of floats.
template <class V>
void clamp(V& means, float largest) {
  const V high = V{} + largest;
  means = means > high ? high : means;
  means = means < -FLT_MAX ? V{} - FLT_MAX : means;
}

}  // namespace

void PixelRow::Weights::update(const std::uint32_t (&counts)[kHalves], bool counts_differ) {
  if (counts[0] == count[0] && counts[1] == count[1]) return;
  const bool paired = counts[0] > 0 && counts[1] > 0;
  const bool both_spread = counts[0] > 1 && counts[1] > 1;
  for (int h = 0; h < kHalves; ++h) {
    count[h] = counts[h];
    const double inverse = count[h] > 0 ? 1.0 / count[h] : 0;
    mean[h] = paired ? 0.5 * inverse : inverse;
    half[h] = count[h] == 0 ? 0 : paired ? 0.5 : 1;
    spread[h] = both_spread ? 0.25 * inverse / (count[h] - 1.0) : 0;
  }
  scale = counts_differ && paired ? 4 / (1.0 / count[0] + 1.0 / count[1]) : 1;
  for (double& weight : spread) weight *= scale;
}

void PixelRow::find_runs(const HalfPixel* a, const HalfPixel* b) {
  runs_.clear();
  any_paired_ = any_spread_ = any_unpaired_ = false;
  const int width = x1_ - x0_;
  for (int x = 0; x < width;) {
    Run run;
    run.begin = x;
    run.count[0] = a[x].count;
    run.count[1] = b[x].count;
    do {
      ++x;
    } while (x < width && a[x].count == run.count[0] && b[x].count == run.count[1]);
    run.end = x;
    any_paired_ |= run.paired();
    any_spread_ |= run.spread();
    any_unpaired_ |= !run.paired();
    runs_.push_back(run);
  }
}

void PixelRow::look_at_splats(const Film& film, int y, bool spreads) {
  for (int h = 0; h < kHalves; ++h) splats_[h].look(film, h, y, x0_, x1_, spreads);
  if (!spreads) return;
  splat_spreads_.assign(std::size_t(x1_ - x0_) * kLanes, 0.0);
  for (int h = 0; h < kHalves; ++h) {
    for (int x = x0_; x < x1_; ++x) {
      double* spread = splat_spreads_.data() + std::size_t(x - x0_) * kLanes;
      for (int c = 0; c < 3; ++c) spread[c] += 0.25 * splats_[h].variance(x, c);
      const double n = film.half(h, x, y).count;
      if (!film.history() || n < 2) continue;
      for (int c = 0; c < 3; ++c) spread[c] += 0.25 / (n * (n - 1)) * splats_[h].deviation(x, c);
    }
  }
}

template <class V>
void PixelRow::add_splats(int x, V& part_a, V& part_b) const {
  V splat_a, splat_b;
  load(splats_[0].means(x0_ + x), splat_a);
  load(splats_[1].means(x0_ + x), splat_b);
  part_a += splat_a * (V{} + weights_.half[0]);
  part_b += splat_b * (V{} + weights_.half[1]);
}

template <bool kSplats>
void PixelRow::write_means(const Run& run, const HalfPixel* a, const HalfPixel* b) {
  const Double4 weight_a = Double4{} + weights_.mean[0], weight_b = Double4{} + weights_.mean[1];
  for (int x = run.begin; x < run.end; ++x) {
    __builtin_prefetch(a + x + next_row_);
    __builtin_prefetch(b + x + next_row_);
    Double4 sum_a, sum_b;
    load_sum(a[x], sum_a);
    load_sum(b[x], sum_b);
    Double4 part_a = sum_a * weight_a, part_b = sum_b * weight_b;
    if (kSplats) add_splats(x, part_a, part_b);
    store_mean(part_a + part_b, means_.data() + x * kLanes);
  }
}

template <bool kSplats, bool kSpread>
void PixelRow::write_terms(const Run& run, const HalfPixel* a, const HalfPixel* b, float* differences, float* spreads) {
  const Double4 weight_a = Double4{} + weights_.mean[0], weight_b = Double4{} + weights_.mean[1];
  const Double4 scale = Double4{} + weights_.scale;
  const Double4 scale_a = Double4{} + weights_.spread[0], scale_b = Double4{} + weights_.spread[1];
  for (int x = run.begin; x < run.end; ++x) {
    __builtin_prefetch(a + x + next_row_);
    __builtin_prefetch(b + x + next_row_);
    Double4 sum_a, sum_b;
    load_sum(a[x], sum_a);
    load_sum(b[x], sum_b);
    Double4 half_a = sum_a * weight_a, half_b = sum_b * weight_b;  // half the mean of each half
    if (kSplats) add_splats(x, half_a, half_b);
    store_mean(half_a + half_b, means_.data() + x * kLanes);
    const Double4 half_difference = half_a - half_b;
    store_term(half_difference * half_difference * scale, 1.0f, differences + x * kLanes);
    if (!kSpread) continue;
    Double4 spread_a, spread_b;
    load_deviations(a[x], spread_a);
    load_deviations(b[x], spread_b);
    Double4 spread = spread_a * scale_a + spread_b * scale_b;
    if (kSplats) {
      Double4 splat_spread;
      load(splat_spreads_.data() + x * kLanes, splat_spread);
      spread += splat_spread * scale;
    }
    store_term(spread, 1.0f, spreads + x * kLanes);
  }
}

void PixelRow::look(const Film& film, int y, int x0, int x1, float* differences, float* spreads) {
  x0_ = x0;
  x1_ = x1;
  if (counts_differ_ != film.state().counts_differ()) weights_ = {};
  counts_differ_ = film.state().counts_differ();
  next_row_ = y + 1 < film.height() ? film.width() : 0;
  means_.resize(std::size_t(round_up_to_vectors(x1 - x0) + kPixelsAtOnce) * kLanes);
  const HalfPixel* a = &film.half(0, x0, y);
  const HalfPixel* b = &film.half(1, x0, y);
  find_runs(a, b);
  if (film.splats()) {
    look_at_splats(film, y, spreads != nullptr);
    write<true>(a, b, differences, spreads);
  } else {
    write<false>(a, b, differences, spreads);
  }
}

template <bool kSplats>
void PixelRow::write(const HalfPixel* a, const HalfPixel* b, float* differences, float* spreads) {
  for (const Run& run : runs_) {
    weights_.update(run.count, counts_differ_);
    const auto clear = [&run](float* terms) { std::fill(terms + run.begin * kLanes, terms + run.end * kLanes, 0.0f); };
    if (!differences || !run.paired()) {
      write_means<kSplats>(run, a, b);
      if (differences && any_paired_) clear(differences);
    } else if (run.spread()) {
      write_terms<kSplats, true>(run, a, b, differences, spreads);
    } else {
      write_terms<kSplats, false>(run, a, b, differences, spreads);
    }
    if (spreads && any_spread_ && !run.spread()) clear(spreads);
  }
}

void PixelRow::copy_counts(int from, int to, float* out) const {
  for (const Run& run : runs_) {
    const int begin = std::max(run.begin + x0_, from), end = std::min(run.end + x0_, to);
    const float n = run.paired() ? float(4 / (1.0 / run.count[0] + 1.0 / run.count[1])) : 0.0f;
    if (begin < end) std::fill(out + (begin - from), out + (end - from), n);
  }
}

double PixelRow::sum_of_means() const {
  double sum = 0;
  for (int x = 0; x < x1_ - x0_; ++x) {
    Float4 mean;
    load(means_.data() + x * kLanes, mean);
    clamp(mean, FLT_MAX);
    sum += double(mean[0]) + mean[1] + mean[2];
  }
  return sum;
}

void PixelRow::copy_means(float largest, float* out) const {
  for (int x = 0; x < x1_ - x0_; ++x) {
    Float4 mean;
    load(means_.data() + x * kLanes, mean);
    clamp(mean, largest);
    mean[3] = 1;
    store(mean, out + x * kLanes);
  }
}

void PixelRow::append_means(int from, int to, std::vector<float> (&channels)[3]) const {
  constexpr int kAtOnce = 64;
  for (int x = from - x0_; x < to - x0_; x += kAtOnce) {
    const int n = std::min(kAtOnce, to - x0_ - x);
    float planar[3][kAtOnce];
    for (int i = 0; i < n; i += kPixelsAtOnce) {
      Float16 means;
      load(means_.data() + (x + i) * kLanes, means);
      clamp(means, FLT_MAX);
      store_planar(means, planar[0] + i, planar[1] + i, planar[2] + i);
    }
    for (int c = 0; c < 3; ++c) channels[c].insert(channels[c].end(), planar[c], planar[c] + n);
  }
}

void PixelRow::append_samples(int from, int to, std::vector<float>& samples) const {
  for (const Run& run : runs_) {
    const int begin = std::max(run.begin + x0_, from), end = std::min(run.end + x0_, to);
    if (begin < end) samples.insert(samples.end(), std::size_t(end - begin), float(run.count[0]) + float(run.count[1]));
  }
}

}  // namespace helio
