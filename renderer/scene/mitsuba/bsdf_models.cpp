#include "renderer/scene/mitsuba/bsdf_models.h"

#include <cmath>

#include "renderer/scene/mitsuba/indices.h"

namespace helio::mitsuba {

namespace {

// A number in [0, 1] where Mitsuba takes no texture.
double plain_number(const Plugin& plugin, const char* name, double fallback) {
  const Element* e = plugin.find(name);
  if (!e || e->tag != "texture") return plugin.number(name, fallback, {0, 1});
  plugin.fail(std::string("has a texture as ") + name + ", allowed: a number from 0 to 1");
  return fallback;
}

void read_distribution(const Plugin& plugin, Material& m) {
  const std::string distribution = lower_case(plugin.text("distribution", "beckmann"));
  if (distribution == "ggx")
    m.distribution = MicrofacetDistribution::ggx;
  else if (distribution == "beckmann")
    m.distribution = MicrofacetDistribution::beckmann;
  else
    plugin.fail("has distribution \"" + distribution + "\", allowed: beckmann, ggx", ErrorCode::unimplemented);
  plugin.boolean("sample_visible", true);  // how it is sampled, not what it is
}

// alpha, or alpha_u and alpha_v; and the distribution. Numbers or textures.
void read_roughness(const Plugin& plugin, LoadContext& context, Material& m) {
  read_distribution(plugin, m);
  const Range range{0, 1};
  if (plugin.has("alpha") && (plugin.has("alpha_u") || plugin.has("alpha_v")))
    plugin.fail("has alpha and alpha_u or alpha_v, allowed: alpha alone, or those two");
  if (plugin.has("alpha_u") != plugin.has("alpha_v"))
    plugin.fail(std::string("has ") + (plugin.has("alpha_u") ? "alpha_u without alpha_v" : "alpha_v without alpha_u") +
                ", allowed: both");
  const bool directed = plugin.has("alpha_u");
  const NumberOrTexture along = read_number(plugin, directed ? "alpha_u" : "alpha", 0.1, range, context);
  m.roughness = float(std::sqrt(along.value));
  m.numbers.roughness = along.texture;
  if (!directed) return;
  const NumberOrTexture across = read_number(plugin, "alpha_v", 0.1, range, context);
  if (across.value != along.value || along.texture.present() || across.texture.present())
    m.roughness_across = float(std::sqrt(across.value));
  m.numbers.roughness_across = across.texture;
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
  if (plugin.type() == "roughconductor") read_roughness(plugin, context, m);
  // Without any of the three a perfect mirror; eta alone has k = 1, k alone eta = 0.
  const std::string metal = plugin.text("material", "none");
  if (metal != "none" && (plugin.has("eta") || plugin.has("k")))
    plugin.fail("has material and eta or k, allowed: material alone, or eta and k");
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
  if (plugin.type() == "roughdielectric") read_roughness(plugin, context, m);
  m.ior = relative_ior(plugin, 1.5046);
  const ColorOrTexture passed =
      read_color(plugin, "specular_transmittance", Rgb(1, 1, 1), SpectrumUse::reflectance, context);
  m.base_color = passed.color;
  m.base_color_texture = passed.texture;
  read_specular_reflectance(plugin, context, m);
  m.tinted_reflection = true;
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
  if (plugin.type() == "roughplastic") {
    read_distribution(plugin, m);
    m.roughness = float(std::sqrt(plain_number(plugin, "alpha", 0.1)));
  }
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
  const auto share = [&](const char* name, double fallback, TextureSlot& texture) {
    const NumberOrTexture number = read_number(plugin, name, fallback, unit, context);
    texture = number.texture;
    return float(number.value);
  };
  const ColorOrTexture base = read_base_color(plugin, "base_color", Rgb(0.5f), context);
  m.base_color = base.color;
  m.base_color_texture = base.texture;
  m.roughness = share("roughness", 0.5, m.numbers.roughness);
  m.metallic = share("metallic", 0, m.numbers.metallic);
  m.transmission = share("spec_trans", 0, m.numbers.transmission);
  m.principled.anisotropic = share("anisotropic", 0, m.numbers.anisotropic);
  m.principled.spec_tint = share("spec_tint", 0, m.numbers.spec_tint);
  m.principled.sheen = share("sheen", 0, m.numbers.sheen);
  m.principled.sheen_tint = share("sheen_tint", 0, m.numbers.sheen_tint);
  m.principled.flatness = share("flatness", 0, m.numbers.flatness);
  m.principled.clearcoat = share("clearcoat", 0, m.numbers.clearcoat);
  m.principled.clearcoat_gloss = share("clearcoat_gloss", 0, m.numbers.clearcoat_gloss);
  if (plugin.has("eta") && plugin.has("specular")) plugin.fail("has eta and specular, allowed: one of the two");
  if (plugin.has("eta")) {
    m.ior = float(plugin.number("eta", 1.5, {1, 100}));
  } else {
    // specular = 0.5 is an ior of 1.5: F at normal incidence = 0.08 specular (Burley 2012, section 5.5).
    double specular = plugin.number("specular", 0.5, unit);
    if (m.transmission > 0 && specular == 0) specular = 1e-3;  // as Mitsuba: nothing refracts at an ior of 1
    m.ior = float(2 / (1 - std::sqrt(0.08 * specular)) - 1);
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
