#include "renderer/trace/gbuffer/view_reweighting.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace helio {
namespace {

// Share of a change by which it is taken to be off beside what its directions' scatter says.
constexpr double kDoubt = 0.5;
// Cosine between the normals of pixels that show one surface.
constexpr float kAlike = 0.9f;

}  // namespace

bool ViewEvidence::like(const ViewEvidence& other) const {
  return pools && other.pools && material == other.material && dot(normal, other.normal) > kAlike;
}

ViewReweighting pooled_change(const ViewEvidence& own, std::span<const ViewEvidence* const> alike, float shared) {
  ViewReweighting change;
  change.ratio = change.albedo = own.albedo;
  double pixels = 0, directions = 0, mean = 0, squares = 0, unknown = 0, unseen = 0;
  double noise = 0, noisy = 0, all = 0;
  V3d channels(0, 0, 0), arrival(0, 0, 0);
  for (const ViewEvidence* e : alike) {
    ++all;
    arrival += V3d(e->arrival) * (1 - double(e->unknown));  // what may change altogether is kept as it was
    if (!e->lit) continue;
    ++pixels;
    directions += e->directions;
    channels += V3d(e->change);
    mean += double(e->off);
    squares += double(e->off) * double(e->off);
    unknown += double(e->unknown);
    unseen += double(e->unseen) * (1 - double(e->unknown));
    if (e->directions < 2) continue;
    noise += double(e->scatter);
    ++noisy;
  }
  change.arrival = Rgb(arrival * (1 / std::max(all, 1.0)));
  if (directions == 0) {
    change.error = own.unseen;
    return change;
  }
  channels *= 1 / pixels;
  mean /= pixels;
  unknown /= pixels;
  const double apart = pixels > 1 ? std::max(0.0, squares - pixels * mean * mean) / (pixels - 1) : 0;
  noise = noisy > 0 ? noise / noisy : apart;
  const double others = std::clamp(double(shared), 1.0, pixels);
  const double of_mean = noise * others / pixels;
  const double keep = mean * mean / std::max(mean * mean + of_mean, DBL_MIN);
  // Of the pixel's own difference from the mean. Variances of nine that have long tails are twice what they are to be
  // by chance.
  const double spread = std::max(0.0, apart - 2 * noise);
  const double believe = own.lit && pixels > 1 ? spread / std::max(spread + noise, DBL_MIN) : 0;
  for (int c = 0; c < 3; ++c) {
    const double base = keep * channels[c];
    change.ratio[c] *= float(1 + base + believe * (double(own.change[c]) - base));
  }
  // With one direction more that is off by what none has met.
  const double one_more = unseen / pixels * others / directions;
  const double error = std::sqrt(of_mean + believe * noise + one_more * one_more) + unknown;
  // Few directions say little of a large change; a fall as little as the rise that it is the other way round.
  const double off = mean + believe * (double(own.off) - mean);
  const double fall = std::clamp(1 / std::max(1 + off, DBL_MIN), 1.0, double(kMostRatio));
  const double told = 1 + keep * mean + believe * (double(own.off) - keep * mean);
  const double whole = std::hypot(error, kDoubt * off * fall) / std::max(told, DBL_MIN);
  change.error = float(std::min(whole, double(kMostRatio)));
  return change;
}

}  // namespace helio
