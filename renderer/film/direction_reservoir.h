// Where the light of a pixel comes from at its first hit, and how much of it depends on the view: what a later picture
// that sees the surface from elsewhere weighs the pixel's samples by (trace/centre_hits.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "renderer/film/packed_values.h"

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

// Each place holds the direction of one of the pixel's samples, of whichever half, picked with a probability
// proportional to what of the sample's luminance depends on the view, and a small part of what does not, whatever the
// number of samples: weighted reservoir sampling (Chao 1982) with replacement, a place at a time. What all samples count
// is told by their share. Pictures that draw on earlier ones begin with directions of neighbours there
// (pick_directions()).
class DirectionReservoir {
 public:
  static constexpr int kPlaces = 4;
  static constexpr int kAxisBits = 11;  // a fiftieth of a lobe of alpha 0.1
  // Beside pack_direction<kAxisBits>()'s codes, of which these are none that it gives but for rounding.
  static constexpr std::uint32_t kNone = 0;      // nothing is known, or no direction: a delta lobe
  static constexpr std::uint32_t kAny = 0x7ffu;  // what the surface emits: the same from everywhere

  // What light of which the view changes nothing counts among the picks: without any a pixel would know of no light
  // that its lobes will turn to, and four directions of lobes alone have tails that no mean holds.
  static constexpr float kMatte = 0.125f;
  // The luminance by which light counts, over its luminance. share: of it, what depends on the view.
  static constexpr float counting(float share) { return kMatte + (1 - kMatte) * share; }
  // The share of light that counts as that.
  static constexpr float share_of(float counting) {
    return std::clamp((counting - kMatte) / (1 - kMatte), 0.0f, 1.0f);
  }

  std::uint32_t direction(int place) const {
    if (place < 3) return words_[place] & kCode;
    return words_[0] >> kBits | words_[1] >> kBits << 10 | (words_[2] >> kBits & 3u) << 20;
  }
  void set_direction(int place, std::uint32_t code) {
    if (place < 3) {
      words_[place] = (words_[place] & ~kCode) | (code & kCode);
      return;
    }
    words_[0] = (words_[0] & kCode) | code << kBits;
    words_[1] = (words_[1] & kCode) | code >> 10 << kBits;
    words_[2] = (words_[2] & ~(3u << kBits)) | (code >> 20 & 3u) << kBits;
  }

  // Of the luminance of all samples of the pixel, what lobes brought that depend on the view: [0, 1], in a byte.
  float share() const { return unpack_share(words_[2] >> 24); }
  void set_share(float share, float u = 0.5f) { words_[2] = (words_[2] & 0xffffffu) | pack_share(share, u) << 24; }

  // What chance decides of a sample: uniform in [0, 1), independent of the sample and of each other.
  struct Chances {
    float place[kPlaces], share;
  };
  // A sample of luminance `brought` >= 0, of which `varies` depends on the view. whole: of all samples of the pixel, this
  // one among them.
  void add(std::uint32_t direction, float brought, float varies, double whole, const Chances& u) {
    if (!(brought > 0)) return;
    const float before = share();
    set_share(before + float((double(varies) - double(before) * double(brought)) / whole), u.share);
    const double all = double(counting(share())) * whole;
    const double own = double(kMatte) * double(brought) + double(1 - kMatte) * double(varies);
    for (int k = 0; k < kPlaces; ++k) {
      if (double(brought) >= whole || double(u.place[k]) * all < own) set_direction(k, direction);
    }
  }

  bool operator==(const DirectionReservoir&) const = default;

 private:
  static constexpr int kBits = 2 * kAxisBits;
  static constexpr std::uint32_t kCode = (1u << kBits) - 1;

  // Three directions; above them the fourth, its lower 10 bits first, and the share's byte.
  std::uint32_t words_[3] = {0, 0, 0xffu << 24};
};
static_assert(sizeof(DirectionReservoir) == 12);

}  // namespace helio
