// How what surfaces send to a camera compares to what they sent to an earlier one: what the few directions that a
// pixel remembers say of it, and what it comes to when pixels around that show the same surface are heard as well.
//
// Directions scatter, and a pixel's own scatter must not decide how far it is believed: of four directions one with a
// large ratio says at once that the surface has become brighter and that this is known badly, so that what rises would
// be shrunk and what falls would not (in a glossy room 0.9 % of the picture). Pixels are drawn towards the mean of
// their neighbourhood instead, which keeps what they say together, as far as the neighbourhood's noise explains how
// they differ (empirical Bayes: Efron and Morris 1973), and that mean towards no change (James and Stein 1961).
#pragma once

#include <span>

#include "renderer/base/math.h"

namespace helio {

struct ViewReweighting {
  Rgb ratio{1, 1, 1};   // new over old
  Rgb albedo{1, 1, 1};  // the same of what CentreHit::albedo tells, by which lookups are scaled already
  float error = 0;      // standard error of the ratio, over the ratio; >= 0
  // Albedo of directions that the earlier picture could not tell of (ratios above kMostRatio): what arrives by them is
  // not known.
  Rgb arrival{0, 0, 0};
};

// Of a ratio of BSDFs, new over old: where it is larger the earlier view's lobe hardly reaches the direction.
inline constexpr float kMostRatio = 16;

// What one pixel's directions say. Changes are relative and beyond that of the albedo: ratio less one.
struct ViewEvidence {
  Rgb albedo{1, 1, 1};   // ViewReweighting::albedo
  Rgb change{0, 0, 0};   // [-1, kMostRatio - 1]
  float off = 0;         // of the luminance, likewise
  float scatter = 0;     // squared standard error of that; of no meaning for fewer than two directions
  float unknown = 0;     // share of the light of which no direction tells: it may change altogether
  Rgb arrival{0, 0, 0};  // ViewReweighting::arrival
  float unseen = 0;      // how much light that no direction has met may change by
  bool lit = false;      // some light is known of
  int directions = 0;    // distinct ones
  const void* material = nullptr;
  V3f normal{0, 0, 0};  // shading
  bool pools = true;    // neighbours of the same material and normal tell of it: it has no textures

  // Whether this and another pixel's are of one surface.
  bool like(const ViewEvidence& other) const;
};

// `own` is among `alike`, which are all of its surface. shared: how many of them draw on the same pixel of the earlier
// picture, and so know no more than one, >= 1.
ViewReweighting pooled_change(const ViewEvidence& own, std::span<const ViewEvidence* const> alike, float shared);

}  // namespace helio
