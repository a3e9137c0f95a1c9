#include "renderer/trace/gbuffer/light_reweighting.h"

#include <algorithm>

#include "renderer/base/check.h"

namespace helio {
namespace {

double luminance_of(const V3d& v) {
  return double(luminance(Rgb(v)));
}

}  // namespace

float LightReweighting::add(float weight, const SeenLight& before, const SeenLight& now) {
  const Rgb lobes_before = before.lobes();
  const float whole = luminance(before.all);
  const float counted = luminance(lobes_before) + DirectionReservoir::kMatte * luminance(before.matte);
  if (!(weight > 0)) return -1;
  if (!(whole > 0) || !(counted > 0) || !(light_ > 0) || !is_finite(before.all) || !is_finite(now.all)) {
    add_unknown(weight);
    return -1;
  }
  const float most = kMostRatio * whole, cut = std::min(1.0f, most / std::max(max_component(now.all), most));
  const Rgb lobes_now = now.lobes() * cut, matte_now = now.matte * cut;
  const double part = double(weight) / light_, each = part / double(counted);
  lobes_now_ += V3d(lobes_now) * each;
  lobes_before_ += V3d(lobes_before) * each;
  matte_now_ += V3d(matte_now) * each;
  matte_before_ += V3d(before.matte) * each;
  const double off = double(luminance(lobes_now) - luminance(lobes_before)) / double(counted);
  HELIO_DCHECK(count_ < kMostWeighed);
  each_[count_++] = {part, off};
  known_ += part;
  off_ += part * off;
  return (luminance(lobes_now) + DirectionReservoir::kMatte * luminance(matte_now)) / counted;
}

void LightReweighting::tell(ViewEvidence& evidence) const {
  evidence.lit = known_ + unknown_ > 0;
  if (!evidence.lit) return;
  evidence.unknown = float(std::min(unknown_, 1.0));
  if (!(known_ > 0)) return;
  evidence.directions = int(count_);
  const double share = double(DirectionReservoir::share_of(float(known_ + unknown_)));
  const double base = luminance_of(matte_before_), lobes = luminance_of(lobes_before_);
  const double base_ratio = base > 0 ? luminance_of(matte_now_) / base : 1.0;
  const auto relative = [](double change) { return std::clamp(float(change), -1.0f, kMostRatio - 1); };
  evidence.off = relative((1 - share) * (base_ratio - 1) + off_);
  for (int c = 0; c < 3; ++c) {
    const double matte = (1 - share) * (base > 0 ? matte_before_[c] / base : 1.0);
    const double glossy = share * (lobes > 0 ? lobes_before_[c] / lobes : 1.0);
    const double of_base = matte_before_[c] > 0 ? matte_now_[c] / matte_before_[c] - 1 : 0.0;
    const double change = matte * of_base + lobes_now_[c] - lobes_before_[c];
    if (matte + glossy > 0) evidence.change[c] = relative(change / (matte + glossy));
  }
  const double mean = off_ / known_;
  double scatter = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    const double away = each_[k].part * (each_[k].off - mean);
    scatter += away * away;
  }
  evidence.scatter = float(scatter * double(count_) / double(std::max<std::size_t>(count_ - 1, 1)));
}

}  // namespace helio
