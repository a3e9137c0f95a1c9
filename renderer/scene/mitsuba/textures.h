// Textures bitmap, checkerboard, mesh_attribute and uniform.
#pragma once

#include "renderer/scene/mitsuba/context.h"

namespace helio::mitsuba {

// A property that is a colour or a texture: color times the texture, where there is one.
struct ColorOrTexture {
  Rgb color{0, 0, 0};
  TextureSlot texture;
};

// What a texture is asked for. Mitsuba 3.9.1 swaps the two colours of a checkerboard that is asked for a number.
enum class TextureUse { color, number };

// The property `name` of `plugin`; `fallback` where it is absent.
ColorOrTexture read_color(const Plugin& plugin, const char* name, const Rgb& fallback, SpectrumUse use,
                          LoadContext& context, TextureUse texture_use = TextureUse::color);

// A property that is a number or a texture: `value` times the texture's luminance, where there is one.
struct NumberOrTexture {
  double value = 0;
  TextureSlot texture;
};

// The property `name` of `plugin`; `fallback` where it is absent. Of a colour, its luminance.
NumberOrTexture read_number(const Plugin& plugin, const char* name, double fallback, const Range& range,
                            LoadContext& context);

// A texture plugin: bitmap or checkerboard. Others are refused by name and absent.
TextureSlot read_texture(const Plugin& texture, SpectrumUse use, LoadContext& context,
                         TextureUse texture_use = TextureUse::color);

// As read_color, of a property that must be a colour: a texture is refused by name.
Rgb read_plain_color(const Plugin& plugin, const char* name, const Rgb& fallback, SpectrumUse use,
                     LoadContext& context);

// As read_color, of a bsdf's base colour, which may be an attribute of the mesh: a mesh_attribute gives white and sets
// context.attribute.
ColorOrTexture read_base_color(const Plugin& plugin, const char* name, const Rgb& fallback, LoadContext& context);

// The image of a file, decoded once; -1 after a reported failure.
int load_image(const Plugin& plugin, const std::string& filename, LoadContext& context);

// An image of the same size whose alpha is the luminance of the texture's decoded colour and whose colour is white:
// what a mask's opacity becomes. -1 after a reported failure.
int opacity_image(const Plugin& plugin, const TextureSlot& texture, LoadContext& context);

}  // namespace helio::mitsuba
