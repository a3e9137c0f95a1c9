#include "renderer/trace/reuse/history_sample.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

// Of pixels that are looked up together: how much quieter than their mean variance one is taken to be, at most.
constexpr float kQuietest = 0x1p-20f;

// A half whose view has changed, and that may be off by more than this share of what the pixel shows, tells nothing.
// What is wrong with it scatters its samples, too, and so would excuse itself: an orbit around curved metal made it
// grow from step to step.
constexpr float kMostOff = 0.5f;

// Of light that is taken to have come into view: its standard error, over it.
constexpr float kArrivalDoubt = 0.5f;

// Geometric mean of what pixels scatter, none taken for quieter than kQuietest of `mean`; `mean` if nothing is known.
float quiet_spread(const LookupSums& sums, int h, float mean) {
  float logs = 0, weight = 0;
  for (int i = 0; i < sums.known[h]; ++i) {
    const LookupSums::Spread& spread = sums.known_spreads[h][i];
    logs += spread.weight * std::log2(std::max(spread.value, kQuietest * mean));
    weight += spread.weight;
  }
  return weight > 0 ? std::exp2(logs / weight) : mean;
}

}  // namespace

float resampling_error2(float between, float zoom) {
  const float off = between * (1 - between);
  const float shrink = zoom >= 1 ? 1 - 1 / zoom : (1 / zoom - 1) * std::sqrt(zoom);
  return 2.0f / 3 * off * off + shrink * shrink / 12 + (zoom > 1 ? 0.25f * shrink * off : 0);
}

HistorySample LookupSums::weigh(float resampled, float view_reweighting, const Rgb& arrival) const {
  HistorySample result;
  float variance[kHalves] = {0, 0};
  for (int h = 0; h < kHalves; ++h) {
    if (weight(h) < kLeastLookupWeight) continue;
    const float scale = 1 / weight(h);
    for (int c = 0; c < 3; ++c) {
      result.mean[h][c] = mean(h, c) * scale + arrival[c];
      result.spread[h][c] = spread(h, c) * scale;
      variance[h] += result.spread[h][c] / 3;
      if (!std::isfinite(result.mean[h][c])) return {};
    }
  }
  // Squared mean, of what the halves share and of each.
  const int a = weight(0) >= kLeastLookupWeight ? 0 : 1, b = weight(1) >= kLeastLookupWeight ? 1 : 0;
  float shared = 0, square[kHalves] = {0, 0};
  for (int c = 0; c < 3; ++c) {
    shared += std::max(0.0f, result.mean[a][c] * result.mean[b][c]) / 3;
    for (int h = 0; h < kHalves; ++h) square[h] += sqr(result.mean[h][c]) / 3;
  }
  const float before = std::sqrt(bias2), change2 = view_reweighting * view_reweighting;
  const float fixed = resampled + sqr(kArrivalDoubt) * (sqr(arrival.x) + sqr(arrival.y) + sqr(arrival.z)) / 3;
  const auto bias2_of = [&](float squared) { return sqr(before + std::sqrt(fixed + change2 * squared)); };
  result.bias2 = bias2_of(shared);
  result.age = age();
  if (!(result.bias2 <= FLT_MAX)) return {};
  for (int h = 0; h < kHalves; ++h) {
    if (weight(h) < kLeastLookupWeight) continue;
    // The weight of a half must not follow its own samples: a bright one would raise the variance, and so the weight
    // that it gets itself. Of a single sample nothing is known about its variance: taken as its square.
    const int other = a == b ? h : 1 - h;
    const float v = variance[other] > 0 ? variance[other] : square[other];
    const float added2 = change2 > 0 ? bias2_of(square[other]) : result.bias2;
    if (change2 > 0 && added2 > sqr(kMostOff) * square[other]) continue;
    float inverse = added2 > 0 ? (v > 0 ? added2 / v : FLT_MAX) : 0;
    // What lies between a quiet pixel and a far noisier one, as the mirror image of a lamp, may be either: what
    // looking up between the two may have brought is held against the geometric mean of their variances.
    if (resampled > 0 && variance[other] > 0)
      inverse += std::max(0.0f, resampled / quiet_spread(*this, other, v) - resampled / v);
    const float all = inverse_count(h) / weight(h) + inverse;
    result.count[h] = std::min(1 / all, float(CarriedPixel::kMostCount));
  }
  return result;
}

}  // namespace helio
