// Sheen of KHR_materials_sheen: fibres that stand up and scatter at grazing angles.
//
//   f = D(m) V(wo, wi) / max(1, E(wo), E(wi))       per unit of sheen colour
//   D = (2 + 1 / alpha) sin(m)^(1 / alpha) / (2 pi)        (Estevez and Kulla 2017, "Charlie")
//   V = 1 / (4 (cos_i + cos_o - cos_i cos_o))              (Ashikhmin and Premoze 2007; Neubelt and Pettineo 2013)
//
// E(mu) is the directional albedo of D V. It exceeds 1 at grazing angles where alpha is below about 0.2 (4.0 at alpha
// 0.01), hence the division, which keeps reciprocity and never lets the lobe return more than its colour. Sampled
// uniformly over the hemisphere: the lobe is flat in solid angle, and has no peak that a half vector would find.
#pragma once

#include "renderer/trace/bsdf/bsdf_values.h"

namespace helio {

// Below it the lobe is a rim that no pixel resolves: smaller values are taken as this one.
inline constexpr float kLeastSheenAlpha = 0.01f;

// The lobe at unit colour, times cos wi, for wo.z > 0 and wi.z > 0; alpha in [kLeastSheenAlpha, 1]. albedo_o, albedo_i:
// sheen_albedo() of the two.
float evaluate_sheen(float alpha, const V3f& wo, const V3f& wi, float albedo_o, float albedo_i);

// Directional albedo E(mu) above, from a table; min(1, E) is at least the albedo of evaluate_sheen. Relative error
// about 1 %; the table is computed on first use (about 0.3 s) and then immutable.
float sheen_albedo(float alpha, float mu);

// Computes the table now, so that no frame waits for it. Thread safe.
void prepare_sheen_table();

}  // namespace helio
