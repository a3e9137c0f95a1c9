// Two materials side by side, finer than can be seen: f = (1 - weight) f_first + weight f_second. Mitsuba's
// "blendbsdf".
//
// Chosen by the weight; the density is that of the mixture. Where only one of the two is a delta, its samples are
// deltas with the probability (1 - weight) or weight times its own.
//
// These are the parameters; BlendBsdf is in bsdf.h, as it holds two materials of any model.
#pragma once

#include "renderer/trace/bsdf/surface_params.h"

namespace helio {

struct BlendParams {
  SurfaceParams first, second;
  float weight = 0;  // [0, 1]
};

}  // namespace helio
