#include "renderer/scene/mitsuba/bsdfs.h"

#include <optional>
#include <utility>

#include "renderer/scene/mitsuba/bsdf_models.h"

namespace helio::mitsuba {

namespace {

// That one material may hold: kMostBlends of trace/scene/surface_blend.h.
constexpr int kMostBlends = 8;

Material nested(const Plugin& plugin, LoadContext& context) {
  const std::vector<const Element*> inner = plugin.children("bsdf");
  if (inner.size() != 1) {
    plugin.fail("holds " + std::to_string(inner.size()) + " bsdfs, allowed: 1");
    return default_material();
  }
  return read_bsdf(*inner.front(), context);
}

int add_material(Material m, LoadContext& context) {
  context.scene.materials.push_back(std::move(m));
  return int(context.scene.materials.size()) - 1;
}

int blends_in(const Material& m, const LoadContext& context) {
  if (m.model != MaterialModel::blend) return 0;
  return 1 + blends_in(context.scene.materials[std::size_t(m.blend.first)], context) +
         blends_in(context.scene.materials[std::size_t(m.blend.second)], context);
}

// What normalmap and bumpmap have besides their map.
void read_map_options(const Plugin& plugin, Material& m) {
  m.map_shadowing = plugin.boolean("use_shadowing_function", true);
  m.map_rule = plugin.boolean("flip_invalid_normals", true) ? MapRule::own_frame : MapRule::own_frame_unflipped;
  m.map_mirrored = false;  // what is two-sided below the map turns with it
}

// The material lit from both sides. The parts of a blend are copied: others may refer to them as they are.
Material two_sided(Material m, LoadContext& context) {
  m.one_sided = false;
  m.map_mirrored = true;
  if (m.model != MaterialModel::blend || m.blend.by_side) return m;
  m.blend.first = add_material(two_sided(context.scene.materials[std::size_t(m.blend.first)], context), context);
  m.blend.second = add_material(two_sided(context.scene.materials[std::size_t(m.blend.second)], context), context);
  return m;
}

// The share of the light that meets the material; none where a texture says it.
std::optional<double> constant_opacity(const Material& m) {
  if (m.alpha_mode == AlphaMode::opaque) return 1;
  if (m.opacity_texture.present()) return std::nullopt;
  return m.base_alpha;
}

void make_opaque(Material& m) {
  m.alpha_mode = AlphaMode::opaque;
  m.base_alpha = 1;
}

// A blend of two materials, with what concerns the whole surface taken from both.
Material blend_of(const Plugin& plugin, Material first, Material second, LoadContext& context) {
  for (const Material* part : {&first, &second})
    if (part->alpha_mode != AlphaMode::opaque)
      plugin.fail(
          "holds a mask or null, allowed: one of constant opacity mixed by a constant weight, or a mask around "
          "the whole",
          ErrorCode::unimplemented);
  if (!context.attribute.empty())
    plugin.fail("holds a bsdf with mesh_attribute, allowed: one that is not mixed", ErrorCode::unimplemented);
  const bool volume = bounds_volume(first) || bounds_volume(second);
  for (const Material* part : {&first, &second})
    if (volume && part->transmission > 0 && !bounds_volume(*part))
      plugin.fail("mixes a bsdf that bounds a volume with a thin one that transmits", ErrorCode::unimplemented);
  Material m;
  m.model = MaterialModel::blend;
  m.one_sided = first.one_sided && second.one_sided;
  m.transmission = std::max(first.transmission, second.transmission);
  m.thickness = volume ? 1.0f : 0.0f;
  m.blend.first = add_material(std::move(first), context);
  m.blend.second = add_material(std::move(second), context);
  if (blends_in(m, context) <= kMostBlends) return m;
  plugin.fail("holds more than " + std::to_string(kMostBlends) + " blends, the most allowed");
  return default_material();  // what holds this again counts from 0: no exponential trees
}

Material read_twosided(const Plugin& plugin, LoadContext& context) {
  const std::vector<const Element*> inner = plugin.children("bsdf");
  if (inner.empty() || inner.size() > 2) {
    plugin.fail("holds " + std::to_string(inner.size()) + " bsdfs, allowed: 1, or 2 for front and back");
    return default_material();
  }
  plugin.boolean("allow_transmission", false);  // what transmits is refused below
  std::vector<Material> sides;
  for (const Element* element : inner) {
    sides.push_back(two_sided(read_bsdf(*element, context), context));
    if (sides.back().transmission > 0) plugin.fail("wraps a bsdf that transmits, allowed: those that only reflect");
  }
  if (sides.size() == 1) return sides.front();
  Material m = blend_of(plugin, sides[0], sides[1], context);
  m.blend.by_side = true;
  return m;
}

Material read_blend(const Plugin& plugin, LoadContext& context) {
  const std::vector<const Element*> inner = plugin.children("bsdf");
  if (inner.size() != 2) {
    plugin.fail("holds " + std::to_string(inner.size()) + " bsdfs, allowed: 2");
    return default_material();
  }
  const NumberOrTexture weight = read_number(plugin, "weight", 0.5, {0, 1}, context);
  Material first = read_bsdf(*inner[0], context), second = read_bsdf(*inner[1], context);
  // What is there of the two: opacities of the parts are taken out of them, and put around the whole.
  const bool constant =
      !weight.texture.present() && constant_opacity(first).has_value() && constant_opacity(second).has_value();
  double mixed = weight.value, opacity = 1;
  if (constant) {
    const double there = *constant_opacity(first) * (1 - mixed), there_too = *constant_opacity(second) * mixed;
    opacity = there + there_too;
    mixed = opacity > 0 ? there_too / opacity : mixed;
    for (Material* part : {&first, &second}) make_opaque(*part);
  }
  Material m = blend_of(plugin, std::move(first), std::move(second), context);
  m.blend.weight = float(mixed);
  m.blend.weight_texture = weight.texture;
  if (opacity < 1) {
    m.alpha_mode = AlphaMode::blend;
    m.base_alpha = float(opacity);
  }
  return m;
}

Material read_mask(const Plugin& plugin, LoadContext& context) {
  Material m = nested(plugin, context);
  const NumberOrTexture opacity = read_number(plugin, "opacity", 0.5, {0, 1}, context);
  const std::optional<double> inner = constant_opacity(m);
  if (!inner)
    plugin.fail("wraps a mask whose opacity is a texture, allowed: one of constant opacity", ErrorCode::unimplemented);
  m.alpha_mode = AlphaMode::blend;
  m.base_alpha = float(opacity.value * inner.value_or(1));
  if (!opacity.texture.present()) return m;
  m.opacity_texture = opacity.texture;
  m.opacity_texture.encoding = TexelEncoding::linear;
  m.opacity_texture.image = opacity_image(plugin, opacity.texture, context);
  return m;
}

bool is_mapped(const Material& m, const LoadContext& context) {
  if (m.normal_texture.present() || m.bump_texture.present()) return true;
  if (m.model != MaterialModel::blend) return false;
  return is_mapped(context.scene.materials[std::size_t(m.blend.first)], context) ||
         is_mapped(context.scene.materials[std::size_t(m.blend.second)], context);
}

bool has_map(const Plugin& plugin, const Material& m, const LoadContext& context) {
  const bool mapped = is_mapped(m, context);
  if (mapped) plugin.fail("wraps a bsdf that has a normal or bump map already", ErrorCode::unimplemented);
  return mapped;
}

Material read_normal_map(const Plugin& plugin, LoadContext& context) {
  Material m = nested(plugin, context);
  const ColorOrTexture map = read_color(plugin, "normalmap", Rgb(0.5f, 0.5f, 1), SpectrumUse::reflectance, context);
  if (has_map(plugin, m, context)) return m;
  if (!map.texture.present()) {
    plugin.fail("needs a texture named normalmap");
    return m;
  }
  if (map.texture.encoding == TexelEncoding::srgb)
    plugin.warn("reads its map as sRGB colours; normals are meant to be raw");
  m.normal_texture = map.texture;
  read_map_options(plugin, m);
  return m;
}

Material read_bump_map(const Plugin& plugin, LoadContext& context) {
  Material m = nested(plugin, context);
  const std::vector<const Element*> textures = plugin.children("texture");
  if (textures.size() != 1) {
    plugin.fail("holds " + std::to_string(textures.size()) + " textures, allowed: 1");
    return m;
  }
  if (has_map(plugin, m, context)) return m;
  m.bump_texture = read_texture(plugin.other(*textures.front()), SpectrumUse::reflectance, context, TextureUse::number);
  m.bump_scale = float(plugin.number("scale", 1, {-1e30, 1e30}));
  read_map_options(plugin, m);
  return m;
}

Material read_new_bsdf(const Plugin& plugin, LoadContext& context) {
  const std::string& type = plugin.type();
  if (type == "twosided") return read_twosided(plugin, context);
  if (type == "mask") return read_mask(plugin, context);
  if (type == "normalmap") return read_normal_map(plugin, context);
  if (type == "bumpmap") return read_bump_map(plugin, context);
  if (type == "blendbsdf") return read_blend(plugin, context);
  if (std::optional<Material> model = read_bsdf_model(plugin, context)) return *model;
  plugin.fail(
      "is not supported; bsdfs that are: diffuse, conductor, roughconductor, dielectric, roughdielectric, "
      "thindielectric, plastic, roughplastic, principled, null, twosided, mask, normalmap, bumpmap, blendbsdf",
      ErrorCode::unimplemented);
  return default_material();
}

}  // namespace

Material read_bsdf(const Element& element, LoadContext& context) {
  if (const auto known = context.materials.find(&element); known != context.materials.end()) {
    if (const auto attribute = context.attributes.find(&element); attribute != context.attributes.end())
      context.attribute = attribute->second;
    return known->second;
  }
  // An element that refers to itself finds this entry instead of starting again.
  context.materials[&element] = default_material();
  const std::string around = std::exchange(context.attribute, {});
  Material m = read_new_bsdf(Plugin(element, context.document, context.diagnostics), context);
  if (context.attribute.empty())
    context.attribute = around;
  else
    context.attributes[&element] = context.attribute;
  m.name = element.id.empty() ? element.type : element.id;
  return context.materials[&element] = m;
}

Material default_material() {
  Material m = diffuse_material({Rgb(0.5f), {}});
  m.name = "default";
  return m;
}

Material lamp_material() {
  Material m = diffuse_material({Rgb(0), {}});
  m.name = "lamp";
  return m;
}

}  // namespace helio::mitsuba
