#include "renderer/frame/variant_parts.h"

#include "renderer/frame/paper/paper_parts.h"

namespace helio {

const VariantParts* variant_parts(const RenderSettings& settings) {
  if (!allocates(settings.mode) && !reuses(settings.mode)) return nullptr;
  return settings.variant == ModeVariant::paper ? &kPaperParts : nullptr;
}

}  // namespace helio
