// Where the light of a pixel comes from at its first hit, and how much of it depends on the view: what a later picture
// that sees the surface from elsewhere weighs the pixel's samples by (trace/gbuffer/primary_hits.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "renderer/film/core/packed_values.h"

namespace helio {

// One contribution to a sample: where it came from at the first hit, and what the view changes of it.
struct ToldLight {
  std::uint32_t direction = 0;  // as of DirectionReservoir
  float share = 1;              // of what it brought, by lobes that depend on the view, [0, 1]; luminance
};

// A share in [0, 1] by its root in a byte: small ones keep digits. Rounded to the nearest, or up or down by chance so
// that the mean stays; u: uniform in [0, 1).
inline std::uint32_t pack_share(float share, float u = 0.5f) {
  const float root = std::sqrt(std::clamp(share, 0.0f, 1.0f)) * 255;
  const auto low = std::min(std::uint32_t(root), 254u);
  const float below = sqr(float(low) / 255), above = sqr(float(low + 1) / 255);
  return low + (share - below >= (above - below) * (1 - u) ? 1u : 0u);
}
inline float unpack_share(std::uint32_t code) {
  return sqr(float(code & 0xffu) / 255);
}

// Each place of a half holds the direction of one of its samples, picked with a probability proportional to what of the
// sample's luminance depends on the view, and a small part of what does not, whatever the number of samples: weighted
// reservoir sampling (Chao 1982) with replacement, a place at a time. What all samples count is told by their share.
// Halves know nothing of one another, for which of them is sampled first is a matter of time. Pictures that draw on
// earlier ones begin with directions of either half and of neighbours there (pick_directions()).
class DirectionReservoir {
 public:
  static constexpr int kPlaces = 2;
  static constexpr int kAxisBits = 10;  // a 25th of a lobe of alpha 0.1, at most
  // Beside pack_direction<kAxisBits>()'s codes, of which these are none that it gives but for rounding.
  static constexpr std::uint32_t kNone = 0;      // nothing is known, or no direction: a delta lobe
  static constexpr std::uint32_t kAny = 0x3ffu;  // what the surface emits: the same from everywhere

  // What light of which the view changes nothing counts among the picks: without any a pixel would know of no light
  // that its lobes will turn to, and four directions of lobes alone have tails that no mean holds.
  static constexpr float kMatte = 0.125f;
  // The luminance by which light counts, over its luminance. share: of it, what depends on the view.
  static constexpr float counting(float share) { return kMatte + (1 - kMatte) * share; }
  // The share of light that counts as that.
  static constexpr float share_of(float counting) { return std::clamp((counting - kMatte) / (1 - kMatte), 0.0f, 1.0f); }

  std::uint32_t direction(int half, int place) const { return field(half, place * kBits, kBits); }
  void set_direction(int half, int place, std::uint32_t code) { set_field(half, place * kBits, kBits, code); }

  // Of the luminance of all samples of the half, what lobes brought that depend on the view: [0, 1], in a byte.
  float share(int half) const { return unpack_share(field(half, kPlaces * kBits, 8)); }
  void set_share(int half, float share, float u = 0.5f) { set_field(half, kPlaces * kBits, 8, pack_share(share, u)); }

  // What chance decides of a sample: uniform in [0, 1), independent of the sample and of each other.
  struct Chances {
    float place[kPlaces], share;
  };
  // A sample of luminance `brought` >= 0, of which `varies` depends on the view. whole: of all samples of the half,
  // this one among them.
  void add(int half, std::uint32_t direction, float brought, float varies, double whole, const Chances& u) {
    if (!(brought > 0)) return;
    const float before = share(half);
    set_share(half, before + float((double(varies) - double(before) * double(brought)) / whole), u.share);
    const double all = double(counting(share(half))) * whole;
    const double own = double(kMatte) * double(brought) + double(1 - kMatte) * double(varies);
    for (int k = 0; k < kPlaces; ++k) {
      if (double(brought) >= whole || double(u.place[k]) * all < own) set_direction(half, k, direction);
    }
  }

  bool operator==(const DirectionReservoir&) const = default;

 private:
  static constexpr int kBits = 2 * kAxisBits, kWords = 3;
  static_assert(kPlaces * kBits + 8 == 16 * kWords);

  std::uint64_t bits(int half) const {
    const std::uint16_t* w = words_[half];
    return std::uint64_t(w[0]) | std::uint64_t(w[1]) << 16 | std::uint64_t(w[2]) << 32;
  }
  std::uint32_t field(int half, int first, int count) const {
    return std::uint32_t(bits(half) >> first) & ((1u << count) - 1);
  }
  void set_field(int half, int first, int count, std::uint32_t value) {
    const std::uint64_t mask = ((std::uint64_t(1) << count) - 1) << first;
    const std::uint64_t all = (bits(half) & ~mask) | (std::uint64_t(value) << first & mask);
    for (int i = 0; i < kWords; ++i) words_[half][i] = std::uint16_t(all >> 16 * i);
  }

  // Of each half two directions, above them the share's byte. What is not known may all change.
  std::uint16_t words_[2][kWords] = {{0, 0, 0xff00u}, {0, 0, 0xff00u}};
};
static_assert(sizeof(DirectionReservoir) == 12);

}  // namespace helio
