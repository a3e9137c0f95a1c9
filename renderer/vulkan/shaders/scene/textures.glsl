// Texture lookup: TextureTable::lookup of scene/images/texture.cpp. Include after scene.glsl.
#ifndef TEXTURES_GLSL
#define TEXTURES_GLSL

#include "base/base.glsl"
#include "lights/light_features.glsl"
#include "tables/textures.h"

// Drivers put every call into the place of the call, and some make a loop over the invocations of every load from an
// address: that is why there are as few loads as possible, in loops that need not be unrolled.

// An ImageTable by two loads.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer ImageTables {
  uvec4 addresses;  // of texels and of sRGB values
  uvec4 shape;      // width, height, channels, format
};
const uint kImageTableSize = 32u;

// A TextureSlotTable by three loads.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TextureSlotParts {
  uvec3 head;
  vec3 transform_u, transform_v;
};
const uint kTextureSlotSize = 36u;

TextureSlotTable load_texture_slot(uint64_t slots, uint index) {
  TextureSlotParts parts = TextureSlotParts(slots + uint64_t(index) * kTextureSlotSize);
  const uvec3 head = parts.head;
  const vec3 u = parts.transform_u, v = parts.transform_v;
  return TextureSlotTable(head.x, int(head.y), head.z, float[6](u.x, u.y, u.z, v.x, v.y, v.z));
}

bool texture_present(TextureSlotTable slot) {
  return has_light_feature(kHasImages) && slot.image != kNone;
}

// Linear value of an sRGB-encoded one, extended to all finite values as texture.h says.
float srgb_to_linear(float encoded) {
  const float magnitude = abs(encoded);
  const float linear = magnitude <= 0.04045 ? magnitude / 12.92 : pow((magnitude + 0.055) / 1.055, 2.4);
  return copysign(linear, encoded);
}

// The bytes of a texel, the first in the lowest bits; bits beyond its own are undefined. Reads no word of memory that
// has none of them.
uvec4 load_texel(uint64_t texels, uint index, uint size) {
  const uint64_t address = texels + uint64_t(index) * size;
  const uint shift = has_light_feature(kHasUnalignedTexels) ? 8 * (uint(address) & 3u) : 0;
  const uint count = (shift / 8 + size + 3) / 4;
  Uints words = Uints(address & ~uint64_t(3));
  uvec4 value = uvec4(0);
  for (uint i = 0; i < count; ++i) value[i] = words.at[i];
  if (shift > 0) value.xy = (value.xy >> shift) | uvec2(value.y << (32 - shift), 0);
  return value;
}

bool is_format(uint format, uint wanted) {
  return has_light_feature(1u << (kHasFormatShift + wanted)) && format == wanted;
}

// One texel, decoded: rgb linear, a as stored. Grey images have three equal channels, those without alpha have 1.
vec4 read_texel(ImageTable image, uint index, bool srgb) {
  const uint channel_size = is_format(image.format, kTexelU8) ? 1 : is_format(image.format, kTexelF32) ? 4 : 2;
  const uvec4 words = load_texel(image.texels, index, image.channels * channel_size);
  uvec4 codes = words;
  vec4 value = uintBitsToFloat(words);
  if (is_format(image.format, kTexelU8)) {
    codes = (words.xxxx >> uvec4(0, 8, 16, 24)) & 0xffu;
    value = vec4(codes) / 255.0;
  } else if (is_format(image.format, kTexelU16)) {
    codes = (words.xxyy >> uvec4(0, 16, 0, 16)) & 0xffffu;
    value = vec4(codes) / 65535.0;
  } else if (is_format(image.format, kTexelF16)) {
    value = vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y));
  }
  const uint coded = srgb ? (image.channels >= 3 ? 3 : 1) : 0;
  for (uint c = 0; c < coded; ++c) {
    value[c] = image.srgb != 0 ? Floats(image.srgb).at[codes[c]] : srgb_to_linear(value[c]);
  }
  if (image.channels < 3) return vec4(value.xxx, image.channels == 2 ? value.y : 1.0);
  return vec4(value.rgb, image.channels == 4 ? value.a : 1.0);
}

// A coordinate that arithmetic survives: NaN, infinity and values beyond 1e9 become 0. The comparison is by bits,
// because compilers of shaders may assume that there are neither NaN nor infinity.
float safe_coordinate(float u) {
  return (floatBitsToUint(u) & 0x7fffffffu) < floatBitsToUint(1e9) ? u : 0.0;
}

// Maps a coordinate into [0, 1], the range in which the neighbours of a texel are its neighbours under the wrap mode
// (repeat: modulo the size; clamp and mirror: clamped).
float fold_coordinate(float u, uint wrap) {
  if (wrap == kWrapRepeat) {
    const float f = u - floor(u);
    return f < 1.0 ? f : 0.0;
  }
  if (wrap == kWrapMirror) {
    const float f = u - 2.0 * floor(0.5 * u);
    return f > 1.0 ? 2.0 - f : f;
  }
  return clamp(u, 0.0, 1.0);
}

int wrap_index(int i, int size, uint wrap) {
  if (wrap == kWrapRepeat) return i < 0 ? i + size : i >= size ? i - size : i;
  return clamp(i, 0, size - 1);
}

// The two texels along one axis, and the weight of the second.
struct TextureTaps {
  int first, second;
  float weight;
};

TextureTaps bilinear_taps(float u, int size, uint wrap) {
  const float x = fold_coordinate(u, wrap) * float(size) - 0.5;
  const float low = floor(x);
  const int i = int(low);
  return TextureTaps(wrap_index(i, size, wrap), wrap_index(i + 1, size, wrap), x - low);
}

int nearest_tap(float u, int size, uint wrap) {
  return min(int(fold_coordinate(u, wrap) * float(size)), size - 1);
}

ImageTables image_table(TextureSlotTable slot) {
  return ImageTables(scene.textures.images + uint64_t(slot.image) * kImageTableSize);
}

// Size of the image in texels. Precondition: texture_present(slot).
ivec2 texture_size(TextureSlotTable slot) {
  return ivec2(image_table(slot).shape.xy);
}

// The filtered value at uv, which may be any numbers. Precondition: texture_present(slot).
vec4 texture_lookup(TextureSlotTable slot, vec2 uv) {
  if (!has_light_feature(kHasImages)) return vec4(0);
  ImageTables table = image_table(slot);
  const uvec4 addresses = table.addresses, shape = table.shape;
  const ImageTable image = ImageTable(packUint2x32(addresses.xy), packUint2x32(addresses.zw), shape.x, shape.y, shape.z,
                                      shape.w);
  const ivec2 size = ivec2(shape.xy);
  const float u = safe_coordinate(slot.uv_transform[0] * uv.x + slot.uv_transform[1] * uv.y + slot.uv_transform[2]);
  const float v = safe_coordinate(slot.uv_transform[3] * uv.x + slot.uv_transform[4] * uv.y + slot.uv_transform[5]);
  const uint wrap_u = slot.modes & kWrapMask, wrap_v = (slot.modes >> kWrapVShift) & kWrapMask;
  TextureTaps x = bilinear_taps(u, size.x, wrap_u), y = bilinear_taps(v, size.y, wrap_v);
  const bool nearest = (slot.modes & kFilterNearest) != 0;
  if (nearest) {
    x.first = nearest_tap(u, size.x, wrap_u);
    y.first = nearest_tap(v, size.y, wrap_v);
  }
  vec4 value = vec4(0);
  const uint taps = nearest ? 1 : 4;
  for (uint tap = 0; tap < taps; ++tap) {
    const bool right = (tap & 1) != 0, below = (tap & 2) != 0;
    const uint column = uint(right ? x.second : x.first), row = uint(below ? y.second : y.first);
    const uint index = row * uint(size.x) + column;  // images have at most 2^32 texels
    const vec4 texel = read_texel(image, index, (slot.modes & kEncodingSrgb) != 0);
    const float weight = (right ? x.weight : 1.0 - x.weight) * (below ? y.weight : 1.0 - y.weight);
    value += texel * (nearest ? 1.0 : weight);
  }
  return value;
}

#endif
