// Materials of all models, with layers, maps and blends, from outside and from inside.
#pragma once

#include "tests/unit/trace/bsdf/layer_cases.h"
#include "tests/unit/trace/bsdf/mitsuba_cases.h"

namespace helio::test {

inline std::vector<NamedMaterial> all_materials() {
  std::vector<NamedMaterial> all = materials_at(MicrofacetDistribution::ggx, 0.2f);
  for (const auto& more : {layered_materials(0.2f, false), mitsuba_materials(0.2f, false)})
    all.insert(all.end(), more.begin(), more.end());
  all.push_back(lambert_material());
  NamedMaterial mapped = all[2];
  mapped.params.mapped = true;
  mapped.params.map_normal = normalize(V3f(0.2f, -0.1f, 1));
  mapped.params.map_alpha2 = 0.1f;
  all.push_back({"mapped", mapped.params});
  return all;
}

}  // namespace helio::test
