// Materials with layers (LobeModel::stack) that the tests of bsdf_stack share.
#pragma once

#include <deque>

#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {

// Materials point to their layers; this keeps them.
inline SurfaceParams with_layers(SurfaceParams params, const LayerParams& layers) {
  static std::deque<LayerParams> kept;
  kept.push_back(layers);
  params.model = LobeModel::stack;
  params.layers = &kept.back();
  return params;
}

// One material per layer and some of several, over bases of roughness alpha; `white`: nothing absorbs.
inline std::vector<NamedMaterial> layered_materials(float alpha, bool white) {
  const auto color = [&](float r, float g, float b) { return white ? Rgb(1, 1, 1) : Rgb(r, g, b); };
  std::vector<NamedMaterial> list;
  SurfaceParams plastic = metallic_roughness(MicrofacetDistribution::ggx, alpha);
  plastic.base_color = color(0.8f, 0.3f, 0.1f);
  SurfaceParams metal = plastic;
  metal.metallic = 1;
  metal.base_color = color(0.9f, 0.6f, 0.2f);
  SurfaceParams clear = glass(MicrofacetDistribution::ggx, alpha, 1.5f, false);
  SurfaceParams beckmann = plastic;
  beckmann.distribution = MicrofacetDistribution::beckmann;

  LayerParams coat;
  coat.clearcoat = 1;
  list.push_back({"smooth coat", with_layers(plastic, coat)});
  coat.clearcoat_alpha = 0.09f;
  list.push_back({"rough coat", with_layers(plastic, coat)});
  list.push_back({"rough coat on beckmann", with_layers(beckmann, coat)});
  LayerParams tilted = coat;
  tilted.clearcoat = 0.7f;
  tilted.clearcoat_normal = direction_at(20, 70);
  list.push_back({"coat with its own normal", with_layers(metal, tilted)});

  LayerParams sheen;
  sheen.sheen_color = color(0.9f, 0.7f, 0.5f);
  sheen.sheen_alpha = 0.25f;
  list.push_back({"sheen 0.5", with_layers(plastic, sheen)});
  sheen.sheen_alpha = 0.0625f;
  list.push_back({"sheen 0.25", with_layers(plastic, sheen)});
  sheen.sheen_alpha = 1;
  list.push_back({"sheen 1", with_layers(plastic, sheen)});

  LayerParams brushed;
  brushed.anisotropy = 0.7f;
  brushed.anisotropy_direction = V2f(0.6f, 0.8f);
  list.push_back({"brushed metal", with_layers(metal, brushed)});
  list.push_back({"brushed plastic", with_layers(plastic, brushed)});
  list.push_back({"brushed glass", with_layers(clear, brushed)});
  list.push_back({"brushed glass from inside", with_layers(clear, brushed), true});

  LayerParams leaf;
  leaf.diffuse_transmission = 0.4f;
  leaf.diffuse_transmission_color = color(0.3f, 0.9f, 0.2f);
  list.push_back({"leaf", with_layers(plastic, leaf)});
  SurfaceParams wax = plastic;
  wax.thin = false;
  list.push_back({"wax", with_layers(wax, leaf)});
  list.push_back({"wax from inside", with_layers(wax, leaf), true});

  LayerParams film;
  film.iridescence = 1;
  film.film_thickness = 420;
  list.push_back({"film on plastic", with_layers(plastic, film)});
  film.iridescence = 0.8f;
  list.push_back({"film on metal", with_layers(metal, film)});
  list.push_back({"film on glass", with_layers(clear, film)});
  list.push_back({"film on glass from inside", with_layers(clear, film), true});

  LayerParams all = coat;
  all.clearcoat = 0.7f;
  all.sheen_color = color(0.4f, 0.5f, 0.6f);
  all.sheen_alpha = 0.3f;
  all.anisotropy = 0.5f;
  all.anisotropy_direction = V2f(0.8f, -0.6f);
  all.iridescence = 0.5f;
  all.film_thickness = 300;
  all.diffuse_transmission = 0.5f;
  all.diffuse_transmission_color = color(0.7f, 0.6f, 0.1f);
  SurfaceParams mixed = plastic;
  mixed.metallic = 0.2f;
  mixed.transmission = 0.4f;
  list.push_back({"everything, thin", with_layers(mixed, all)});
  mixed.thin = false;
  list.push_back({"everything, volume", with_layers(mixed, all)});
  list.push_back({"everything, volume from inside", with_layers(mixed, all), true});
  return list;
}

}  // namespace helio::test
