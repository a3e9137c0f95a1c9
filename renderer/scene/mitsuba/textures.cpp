#include "renderer/scene/mitsuba/textures.h"

#include <spdlog/fmt/fmt.h>

#include <cstring>
#include <utility>

#include "renderer/scene/images/image_decoder.h"
#include "renderer/scene/images/texture.h"
#include "renderer/scene/mitsuba/transform.h"

namespace helio::mitsuba {

namespace {

Image float_image(const std::string& name, int width, int height, int channels, const std::vector<float>& values) {
  Image image;
  image.name = name;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.format = TexelFormat::f32;
  image.texels.resize(values.size() * sizeof(float));
  std::memcpy(image.texels.data(), values.data(), image.texels.size());
  return image;
}

int add_image(Image image, LoadContext& context) {
  context.scene.images.push_back(std::move(image));
  return int(context.scene.images.size()) - 1;
}

// Of 0.5 and 0.6: 1 is raw, -1 what the image says.
double read_gamma(const Plugin& plugin) {
  const double gamma = plugin.number("gamma", -1);
  if (gamma != 1 && gamma != -1)
    plugin.warn(
        fmt::format("has gamma {}, which is ignored; allowed: 1 (raw), -1 (as the image's format has it)", gamma));
  return gamma;
}

TextureSlot read_bitmap(const Plugin& plugin, LoadContext& context) {
  TextureSlot slot;
  slot.image = load_image(plugin, plugin.text("filename", ""), context);
  const std::string filter = plugin.text("filter_type", "bilinear");
  if (filter == "nearest")
    slot.filter = FilterMode::nearest;
  else if (filter == "trilinear" || filter == "ewa")  // of 0.5 and 0.6
    plugin.warn("has filter_type \"" + filter + "\": lookups are bilinear");
  else if (filter != "bilinear")
    plugin.fail("has filter_type \"" + filter + "\", allowed: bilinear, nearest");
  const std::string wrap = plugin.text("wrap_mode", "repeat");
  if (wrap == "clamp")
    slot.wrap_u = slot.wrap_v = WrapMode::clamp;
  else if (wrap == "mirror")
    slot.wrap_u = slot.wrap_v = WrapMode::mirror;
  else if (wrap != "repeat")
    plugin.fail("has wrap_mode \"" + wrap + "\", allowed: repeat, clamp, mirror");
  slot.uv_transform = uv_rows(plugin.transform("to_uv"));
  plugin.text("format", "");      // how Mitsuba keeps the texels
  plugin.boolean("accel", true);  // and looks them up
  const bool raw = plugin.boolean("raw", false) || read_gamma(plugin) == 1;
  if (slot.image >= 0) {
    const TexelFormat format = context.scene.images[std::size_t(slot.image)].format;
    const bool integer = format == TexelFormat::u8 || format == TexelFormat::u16;
    slot.encoding = integer && !raw ? TexelEncoding::srgb : TexelEncoding::linear;
  }
  return slot;
}

// Two by two texels without filtering: color0 where both halves of (u, v) agree, else color1.
TextureSlot read_checkerboard(const Plugin& plugin, SpectrumUse use, LoadContext& context, TextureUse texture_use) {
  if (use == SpectrumUse::emission) use = SpectrumUse::index;  // of a lamp too, its colours are not light by themselves
  Rgb a = read_plain_color(plugin, "color0", Rgb(0.4f), use, context);
  Rgb b = read_plain_color(plugin, "color1", Rgb(0.2f), use, context);
  if (texture_use == TextureUse::number) std::swap(a, b);
  TextureSlot slot;
  slot.image = add_image(
      float_image("checkerboard", 2, 2, 3, {a.x, a.y, a.z, b.x, b.y, b.z, b.x, b.y, b.z, a.x, a.y, a.z}), context);
  slot.filter = FilterMode::nearest;
  slot.uv_transform = uv_rows(plugin.transform("to_uv"));
  return slot;
}

}  // namespace

ColorOrTexture read_color(const Plugin& plugin, const char* name, const Rgb& fallback, SpectrumUse use,
                          LoadContext& context, TextureUse texture_use) {
  const Element* element = plugin.find(name);
  if (!element) return {fallback, {}};
  if (const std::optional<Rgb> color = color_of(*element, use, context.diagnostics)) return {*color, {}};
  const TextureSlot slot = read_texture(plugin.other(*element), use, context, texture_use);
  return {slot.present() ? Rgb(1, 1, 1) : fallback, slot};
}

NumberOrTexture read_number(const Plugin& plugin, const char* name, double fallback, const Range& range,
                            LoadContext& context) {
  const Element* element = plugin.find(name);
  if (!element || element->tag == "float" || element->tag == "integer")
    return {plugin.number(name, fallback, range), {}};
  const ColorOrTexture read =
      read_color(plugin, name, Rgb(float(fallback)), SpectrumUse::reflectance, context, TextureUse::number);
  if (read.texture.present()) return {1, read.texture};
  return {luminance(read.color), {}};
}

TextureSlot read_texture(const Plugin& texture, SpectrumUse use, LoadContext& context, TextureUse texture_use) {
  const bool is_texture = texture.element().tag == "texture";
  if (is_texture && texture.type() == "bitmap") return read_bitmap(texture, context);
  if (is_texture && texture.type() == "checkerboard") return read_checkerboard(texture, use, context, texture_use);
  texture.fail("is not supported; textures that are: bitmap, checkerboard, and "
               "mesh_attribute as the base colour of diffuse, plastic and principled", ErrorCode::unimplemented);
  return {};
}

ColorOrTexture read_base_color(const Plugin& plugin, const char* name, const Rgb& fallback, LoadContext& context) {
  const Element* element = plugin.find(name);
  if (!element || element->tag != "texture" || element->type != "mesh_attribute")
    return read_color(plugin, name, fallback, SpectrumUse::reflectance, context);
  const Plugin texture = plugin.other(*element);
  const std::string attribute = texture.text("name", "");
  if (!attribute.starts_with("vertex_") && !attribute.starts_with("face_"))
    texture.fail("has the name \"" + attribute + "\", allowed: one that begins with vertex_ or face_");
  else
    context.attribute = attribute;
  return {Rgb(float(texture.number("scale", 1, {0, 1}))), {}};
}

Rgb read_plain_color(const Plugin& plugin, const char* name, const Rgb& fallback, SpectrumUse use,
                     LoadContext& context) {
  const ColorOrTexture value = read_color(plugin, name, fallback, use, context);
  if (value.texture.present())
    plugin.fail(std::string("has a texture as ") + name + ", where only a colour is supported",
                ErrorCode::unimplemented);
  return value.color;
}

int load_image(const Plugin& plugin, const std::string& filename, LoadContext& context) {
  if (const auto known = context.images.find(filename); known != context.images.end()) return known->second;
  Result<FoundFile> file = find_file(context.document, context.source, filename, context.budget);
  if (!file.ok()) {
    context.diagnostics.fail(plugin.place(), file.error());
    return -1;
  }
  const std::uint64_t used_before = context.budget.used();
  std::vector<std::string> notices;
  Result<Image> image =
      decode_image(file->bytes, file->path, context.budget.remaining(), &notices,
                   [&](std::uint64_t bytes) { return context.budget.reserve(bytes, file->path); });
  for (const std::string& notice : notices) context.diagnostics.notice(notice);
  if (!image.ok()) {
    context.budget.release(context.budget.used() - used_before);
    context.diagnostics.fail(plugin.place(), image.error());
    return -1;
  }
  return context.images[filename] = add_image(std::move(*image), context);
}

int opacity_image(const Plugin& plugin, const TextureSlot& texture, LoadContext& context) {
  const Image& original = context.scene.images[std::size_t(texture.image)];
  const std::uint64_t texels = std::uint64_t(original.width) * std::uint64_t(original.height);
  if (Status s = context.budget.reserve(texels, 16, original.name); !s.ok()) {
    context.diagnostics.fail(plugin.place(), s.error());
    return -1;
  }
  const TextureTable table(context.scene.images);
  std::vector<float> values;
  values.reserve(std::size_t(texels) * 4);
  for (int y = 0; y < original.height; ++y)
    for (int x = 0; x < original.width; ++x) {
      const V4f t = table.texel(texture.image, texture.encoding, x, y);
      values.insert(values.end(), {1, 1, 1, std::clamp(luminance(Rgb(t.x, t.y, t.z)), 0.0f, 1.0f)});
    }
  return add_image(float_image("opacity of " + original.name, original.width, original.height, 4, values), context);
}

}  // namespace helio::mitsuba
