#include "renderer/scene/mitsuba_bsdfs.h"

#include <cmath>

#include "renderer/scene/mitsuba_indices.h"
#include "renderer/scene/mitsuba_textures.h"

namespace helio::mitsuba {

namespace {

Material lambert(const ColorOrTexture& reflectance) {
  Material m;
  m.metallic = 0;
  m.specular = 0;
  m.one_sided = true;
  m.base_color = reflectance.color;
  m.base_color_texture = reflectance.texture;
  return m;
}

Material read_diffuse(const Plugin& plugin, LoadContext& context) {
  return lambert(read_color(plugin, "reflectance", Rgb(0.5f), SpectrumUse::reflectance, context));
}

// alpha, or alpha_u = alpha_v; and the distribution.
void read_roughness(const Plugin& plugin, Material& m) {
  const std::string distribution = plugin.text("distribution", "beckmann");
  if (distribution == "ggx")
    m.distribution = MicrofacetDistribution::ggx;
  else if (distribution == "beckmann")
    m.distribution = MicrofacetDistribution::beckmann;
  else
    plugin.fail("has distribution \"" + distribution + "\", allowed: beckmann, ggx", ErrorCode::unimplemented);
  for (const char* name : {"alpha", "alpha_u", "alpha_v"})
    if (const Element* e = plugin.find(name); e && e->tag == "texture") {
      plugin.fail(std::string("has a texture as ") + name + ", where only a number is supported",
                  ErrorCode::unimplemented);
      return;
    }
  const Range range{0, 1};
  const double alpha = plugin.number("alpha", 0.1, range);
  const double u = plugin.number("alpha_u", alpha, range), v = plugin.number("alpha_v", alpha, range);
  if (u != v)
    plugin.fail("is anisotropic (alpha_u and alpha_v differ), which is not supported", ErrorCode::unimplemented);
  plugin.boolean("sample_visible", true);  // how it is sampled, not what it is
  m.roughness = float(std::sqrt(u));
}

// Factors that physically are 1, for which our models have no place.
void require_white(const Plugin& plugin, const char* name, LoadContext& context) {
  if (read_plain_color(plugin, name, Rgb(1, 1, 1), SpectrumUse::reflectance, context) != Rgb(1, 1, 1))
    plugin.fail(std::string("has ") + name + " other than 1, which is not supported", ErrorCode::unimplemented);
}

Material read_conductor(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.model = MaterialModel::conductor;
  m.one_sided = true;
  m.roughness = 0;
  if (plugin.type() == "roughconductor") read_roughness(plugin, m);
  const std::string metal = plugin.text("material", plugin.has("eta") ? "none" : "Cu");
  ComplexIndex index = metal_index(plugin, metal);
  index.eta = read_plain_color(plugin, "eta", index.eta, SpectrumUse::index, context);
  index.k = read_plain_color(plugin, "k", index.k, SpectrumUse::index, context);
  const float outside = float(read_ior(plugin, "ext_eta", 1));
  m.conductor_eta = index.eta / outside;
  m.conductor_k = index.k / outside;
  require_white(plugin, "specular_reflectance", context);
  return m;
}

Material read_dielectric(const Plugin& plugin, LoadContext& context) {
  Material m;
  m.metallic = 0;
  m.roughness = 0;
  m.transmission = 1;
  m.thickness = 1;
  if (plugin.type() == "roughdielectric") read_roughness(plugin, m);
  const double inside = read_ior(plugin, "int_ior", 1.5046), outside = read_ior(plugin, "ext_ior", 1.000277);
  m.ior = float(inside / outside);
  require_white(plugin, "specular_reflectance", context);
  require_white(plugin, "specular_transmittance", context);
  return m;
}

Material nested(const Plugin& plugin, LoadContext& context) {
  const std::vector<const Element*> inner = plugin.children("bsdf");
  if (inner.size() != 1) {
    plugin.fail("holds " + std::to_string(inner.size()) + " bsdfs, where 1 is supported",
                inner.empty() ? ErrorCode::invalid_argument : ErrorCode::unimplemented);
    return default_material();
  }
  return read_bsdf(*inner.front(), context);
}

Material read_twosided(const Plugin& plugin, LoadContext& context) {
  Material m = nested(plugin, context);
  if (m.transmission > 0) plugin.fail("wraps a bsdf that transmits, allowed: those that only reflect");
  m.one_sided = false;
  return m;
}

Material read_mask(const Plugin& plugin, LoadContext& context) {
  Material m = nested(plugin, context);
  const ColorOrTexture opacity = read_color(plugin, "opacity", Rgb(0.5f), SpectrumUse::reflectance, context);
  m.alpha_mode = AlphaMode::blend;
  m.base_alpha = luminance(opacity.color);
  if (!opacity.texture.present()) return m;
  if (m.base_color_texture.present()) {
    plugin.fail("has a texture as opacity over a textured bsdf, which is not supported", ErrorCode::unimplemented);
    return m;
  }
  m.base_color_texture = opacity.texture;
  m.base_color_texture.encoding = TexelEncoding::linear;
  m.base_color_texture.image = opacity_image(plugin, opacity.texture, context);
  return m;
}

Material read_normal_map(const Plugin& plugin, LoadContext& context) {
  Material m = nested(plugin, context);
  const ColorOrTexture map = read_color(plugin, "normalmap", Rgb(0.5f, 0.5f, 1), SpectrumUse::reflectance, context);
  if (!map.texture.present()) {
    plugin.fail("needs a texture named normalmap");
    return m;
  }
  if (map.texture.encoding == TexelEncoding::srgb)
    plugin.warn("reads its map as sRGB colours; normals are meant to be raw");
  m.normal_texture = map.texture;
  return m;
}

Material read_new_bsdf(const Plugin& plugin, LoadContext& context) {
  const std::string& type = plugin.type();
  if (type == "diffuse") return read_diffuse(plugin, context);
  if (type == "twosided") return read_twosided(plugin, context);
  if (type == "mask") return read_mask(plugin, context);
  if (type == "normalmap") return read_normal_map(plugin, context);
  if (type == "conductor" || type == "roughconductor") return read_conductor(plugin, context);
  if (type == "dielectric" || type == "roughdielectric") return read_dielectric(plugin, context);
  plugin.fail(
      "is not supported; bsdfs that are: diffuse, twosided, mask, normalmap, conductor, roughconductor, dielectric, "
      "roughdielectric",
      ErrorCode::unimplemented);
  return default_material();
}

}  // namespace

Material read_bsdf(const Element& element, LoadContext& context) {
  if (const auto known = context.materials.find(&element); known != context.materials.end()) return known->second;
  // An element that refers to itself finds this entry instead of starting again.
  context.materials[&element] = default_material();
  Material m = read_new_bsdf(Plugin(element, context.document, context.diagnostics), context);
  m.name = element.id.empty() ? element.type : element.id;
  return context.materials[&element] = m;
}

Material default_material() {
  Material m = lambert({Rgb(0.5f), {}});
  m.name = "default";
  return m;
}

}  // namespace helio::mitsuba
