#include "renderer/scene/mitsuba_bsdf_models.h"

#include <cmath>

#include "renderer/scene/mitsuba_indices.h"

namespace helio::mitsuba {

namespace {

bool is_texture(const Plugin& plugin, const char* name) {
  const Element* e = plugin.find(name);
  return e && e->tag == "texture";
}

// A number where Mitsuba takes a texture too.
double plain_number(const Plugin& plugin, const char* name, double fallback, const Range& range) {
  if (!is_texture(plugin, name)) return plugin.number(name, fallback, range);
  plugin.fail(std::string("has a texture as ") + name + ", where only a number is supported", ErrorCode::unimplemented);
  return fallback;
}

// alpha, or alpha_u and alpha_v; and the distribution.
void read_roughness(const Plugin& plugin, bool anisotropic, Material& m) {
  const std::string distribution = plugin.text("distribution", "beckmann");
  if (distribution == "ggx")
    m.distribution = MicrofacetDistribution::ggx;
  else if (distribution == "beckmann")
    m.distribution = MicrofacetDistribution::beckmann;
  else
    plugin.fail("has distribution \"" + distribution + "\", allowed: beckmann, ggx", ErrorCode::unimplemented);
  const Range range{0, 1};
  const double alpha = plain_number(plugin, "alpha", 0.1, range);
  m.roughness = float(std::sqrt(alpha));
  plugin.boolean("sample_visible", true);  // how it is sampled, not what it is
  if (!anisotropic) return;
  const double u = plain_number(plugin, "alpha_u", alpha, range), v = plain_number(plugin, "alpha_v", alpha, range);
  m.roughness = float(std::sqrt(u));
  if (u != v) m.roughness_across = float(std::sqrt(v));
}

void read_specular_reflectance(const Plugin& plugin, LoadContext& context, Material& m) {
  const ColorOrTexture tint =
      read_color(plugin, "specular_reflectance", Rgb(1, 1, 1), SpectrumUse::reflectance, context);
  m.specular_color = tint.color;
  m.specular_color_texture = tint.texture;
}

Material read_conductor(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.model = MaterialModel::conductor;
  m.one_sided = true;
  m.roughness = 0;
  if (plugin.type() == "roughconductor") read_roughness(plugin, true, m);
  const std::string metal = plugin.text("material", plugin.has("eta") ? "none" : "Cu");
  ComplexIndex index = metal_index(plugin, metal);
  index.eta = read_plain_color(plugin, "eta", index.eta, SpectrumUse::index, context);
  index.k = read_plain_color(plugin, "k", index.k, SpectrumUse::index, context);
  const float outside = float(read_ior(plugin, "ext_eta", 1));
  m.conductor_eta = index.eta / outside;
  m.conductor_k = index.k / outside;
  read_specular_reflectance(plugin, context, m);
  return m;
}

// int_ior over ext_ior.
float relative_ior(const Plugin& plugin, double inside) {
  return float(read_ior(plugin, "int_ior", inside) / read_ior(plugin, "ext_ior", 1.000277));
}

Material read_dielectric(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.metallic = 0;
  m.roughness = 0;
  m.transmission = 1;
  m.thickness = 1;
  if (plugin.type() == "roughdielectric") read_roughness(plugin, true, m);
  m.ior = relative_ior(plugin, 1.5046);
  const ColorOrTexture passed =
      read_color(plugin, "specular_transmittance", Rgb(1, 1, 1), SpectrumUse::reflectance, context);
  m.base_color = passed.color;
  m.base_color_texture = passed.texture;
  if (read_plain_color(plugin, "specular_reflectance", Rgb(1, 1, 1), SpectrumUse::reflectance, context) !=
      Rgb(1, 1, 1))
    plugin.fail("has specular_reflectance other than 1, which is not supported", ErrorCode::unimplemented);
  return m;
}

Material read_pane(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.model = MaterialModel::pane;
  m.metallic = 0;
  m.roughness = 0;
  m.transmission = 1;
  m.ior = relative_ior(plugin, 1.5046);
  const ColorOrTexture passed =
      read_color(plugin, "specular_transmittance", Rgb(1, 1, 1), SpectrumUse::reflectance, context);
  m.base_color = passed.color;
  m.base_color_texture = passed.texture;
  read_specular_reflectance(plugin, context, m);
  return m;
}

Material read_plastic(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.model = MaterialModel::plastic;
  m.one_sided = true;
  m.metallic = 0;
  m.roughness = 0;
  if (plugin.type() == "roughplastic") read_roughness(plugin, false, m);
  m.ior = relative_ior(plugin, 1.49);
  if (!(m.ior > 1)) {
    plugin.fail("has int_ior / ext_ior of " + std::to_string(m.ior) + ", allowed: above 1");
    m.ior = 1.49f;
  }
  const ColorOrTexture base =
      read_base_color(plugin, "diffuse_reflectance", Rgb(0.5f), context);
  m.base_color = base.color;
  m.base_color_texture = base.texture;
  read_specular_reflectance(plugin, context, m);
  m.nonlinear = plugin.boolean("nonlinear", false);
  return m;
}

Material read_principled(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.model = MaterialModel::principled;
  const Range unit{0, 1};
  const auto share = [&](const char* name, double fallback) {
    return float(plain_number(plugin, name, fallback, unit));
  };
  const ColorOrTexture base = read_base_color(plugin, "base_color", Rgb(0.5f), context);
  m.base_color = base.color;
  m.base_color_texture = base.texture;
  m.roughness = share("roughness", 0.5);
  m.metallic = share("metallic", 0);
  m.transmission = share("spec_trans", 0);
  m.principled.anisotropic = share("anisotropic", 0);
  m.principled.spec_tint = share("spec_tint", 0);
  m.principled.sheen = share("sheen", 0);
  m.principled.sheen_tint = share("sheen_tint", 0);
  m.principled.flatness = share("flatness", 0);
  m.principled.clearcoat = share("clearcoat", 0);
  m.principled.clearcoat_gloss = share("clearcoat_gloss", 0);
  if (plugin.has("eta") && plugin.has("specular")) plugin.fail("has eta and specular, allowed: one of the two");
  if (plugin.has("eta")) {
    m.ior = float(plugin.number("eta", 1.5, {1, 100}));
  } else {
    // specular = 0.5 is an ior of 1.5: F at normal incidence = 0.08 specular (Burley 2012, section 5.5).
    m.ior = float(2 / (1 - std::sqrt(0.08 * plugin.number("specular", 0.5, unit))) - 1);
  }
  // An ior of 1 refracts nothing and has no half vectors.
  if (m.transmission > 0) m.ior = std::max(m.ior, 1.001f);
  m.thickness = m.transmission > 0 ? 1.0f : 0.0f;
  m.one_sided = !(m.transmission > 0);
  // How often which part is sampled.
  for (const char* rate :
       {"diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"})
    plugin.number(rate, 1, {0, 1e30});
  return m;
}

// There is nothing: all rays pass.
Material read_null() {
  Material m = diffuse_material({Rgb(0, 0, 0), {}});
  m.alpha_mode = AlphaMode::blend;
  m.base_alpha = 0;
  return m;
}

}  // namespace

Material diffuse_material(const ColorOrTexture& reflectance) {
  Material m;
  m.metallic = 0;
  m.specular = 0;
  m.one_sided = true;
  m.base_color = reflectance.color;
  m.base_color_texture = reflectance.texture;
  return m;
}

std::optional<Material> read_bsdf_model(const Plugin& plugin, LoadContext& context) {
  const std::string& type = plugin.type();
  if (type == "diffuse")
    return diffuse_material(read_base_color(plugin, "reflectance", Rgb(0.5f), context));
  if (type == "conductor" || type == "roughconductor") return read_conductor(plugin, context);
  if (type == "dielectric" || type == "roughdielectric") return read_dielectric(plugin, context);
  if (type == "thindielectric") return read_pane(plugin, context);
  if (type == "plastic" || type == "roughplastic") return read_plastic(plugin, context);
  if (type == "principled") return read_principled(plugin, context);
  if (type == "null") return read_null();
  return std::nullopt;
}

}  // namespace helio::mitsuba
