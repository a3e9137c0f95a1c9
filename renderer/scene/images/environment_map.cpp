#include <half.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstring>

#include "renderer/scene/images/environment.h"

namespace helio {
namespace {

template <class Texel>
Texel texel_at(const Image& image, std::size_t i) {
  Texel texel;
  std::memcpy(&texel, image.texels.data() + i * sizeof(Texel), sizeof(Texel));
  return texel;
}

template <class Texel>
Status check_texels(const Image& image) {
  const std::size_t count = image.texels.size() / sizeof(Texel);
  for (std::size_t i = 0; i < count; ++i) {
    const float value = texel_at<Texel>(image, i);
    if (std::isfinite(value)) continue;
    const char* remedy = "clamp the map, for instance with oiiotool --clamp:max=1e6, or leave the sun out of it and add a "
                         "directional light";
    if (std::isnan(value)) {
      remedy = "repair the map, for instance with oiiotool --fixnan box3";
    } else if (sizeof(Texel) == 2) {
      remedy = "a sun is brighter than the 65504 that half floats hold: save the map as 32 bit float, or clamp it, for "
               "instance with oiiotool --clamp:max=65504";
    }
    const std::size_t pixel = i / std::size_t(image.channels);
    return Error{ErrorCode::invalid_argument,
                 fmt::format("texel ({}, {}) channel {} is {} (allowed: finite); {}", pixel % std::size_t(image.width),
                             pixel / std::size_t(image.width), i % std::size_t(image.channels), value, remedy),
                 image.name};
  }
  return ok_status();
}

template <class Texel>
void clamp_negative(Image& image) {
  const std::size_t count = image.texels.size() / sizeof(Texel);
  for (std::size_t i = 0; i < count; ++i) {
    if (float(texel_at<Texel>(image, i)) < 0) std::memset(image.texels.data() + i * sizeof(Texel), 0, sizeof(Texel));
  }
}

// Unit vector of a row of the rotation part; the map's axes stay orthonormal when the matrix scales.
V3f axis(const M44d& m, int row) {
  return V3f(normalize(V3d(m[row][0], m[row][1], m[row][2])));
}

}  // namespace

Status check_environment_image(const Image& image) {
  if (image.format == TexelFormat::f32) return check_texels<float>(image);
  if (image.format == TexelFormat::f16) return check_texels<half>(image);
  return ok_status();
}

Status prepare_environment_image(Image& image) {
  if (const Status usable = check_environment_image(image); !usable) return usable;
  if (image.format == TexelFormat::f32) clamp_negative<float>(image);
  if (image.format == TexelFormat::f16) clamp_negative<half>(image);
  return ok_status();
}

EnvironmentMap::EnvironmentMap(const Environment& environment, const TextureTable* textures)
    : scale_(environment.radiance) {
  for (int i = 0; i < 3; ++i) axes_[i] = axis(environment.to_world, i);
  if (environment.image < 0 || !textures) return;
  textures_ = textures;
  slot_.image = environment.image;
  slot_.wrap_u = WrapMode::repeat;
  slot_.wrap_v = WrapMode::clamp;
  const TexelFormat format = textures->format(environment.image);
  const bool integer = format == TexelFormat::u8 || format == TexelFormat::u16;
  slot_.encoding = integer ? TexelEncoding::srgb : TexelEncoding::linear;
}

V3f EnvironmentMap::to_map(const V3f& world) const {
  return {dot(world, axes_[0]), dot(world, axes_[1]), dot(world, axes_[2])};
}

V3f EnvironmentMap::to_world(const V3f& map) const {
  return axes_[0] * map.x + axes_[1] * map.y + axes_[2] * map.z;
}

Rgb EnvironmentMap::radiance(const V3f& direction) const {
  if (!textures_) return scale_;
  const V4f texel = textures_->lookup(slot_, environment_uv(to_map(direction)));
  return Rgb(texel.x, texel.y, texel.z) * scale_;
}

}  // namespace helio
