// Variant paper: adaptive sampling and reprojection as published (Schalk 2018, "Adaptive sampling and reprojection",
// paper 000), the baseline of ours. Everything that it has of its own lies in this folder.
#pragma once

#include "renderer/frame/variant_parts.h"

namespace helio {

extern const VariantParts kPaperParts;

}  // namespace helio
