#include "renderer/scene/mitsuba/emitters.h"

#include <cmath>
#include <cstring>

#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/texture.h"
#include "renderer/scene/mitsuba/fov.h"
#include "renderer/scene/mitsuba/textures.h"

namespace helio::mitsuba {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

V3d axis_of(const Plugin& plugin, const M44d& to_world) {
  const V3d axis(to_world[2][0], to_world[2][1], to_world[2][2]);
  if (length(axis) > 0) return normalize(axis);
  plugin.fail("has a transform without direction");
  return {0, 0, 1};
}

PunctualLight read_punctual(const Plugin& plugin, PunctualKind kind, const char* strength, LoadContext& context) {
  PunctualLight light;
  light.name = plugin.element().id.empty() ? plugin.type() : plugin.element().id;
  light.kind = kind;
  light.intensity = read_plain_color(plugin, strength, Rgb(1, 1, 1), SpectrumUse::emission, context);
  const M44d to_world = plugin.transform("to_world");
  light.position = V3d(to_world[3][0], to_world[3][1], to_world[3][2]);
  if (kind != PunctualKind::point) light.direction = axis_of(plugin, to_world);
  return light;
}

void read_point(const Plugin& plugin, LoadContext& context) {
  PunctualLight light = read_punctual(plugin, PunctualKind::point, "intensity", context);
  if (plugin.has("position")) light.position = plugin.vector("position", light.position);
  context.scene.lights.push_back(light);
}

void read_spot(const Plugin& plugin, LoadContext& context) {
  PunctualLight light = read_punctual(plugin, PunctualKind::spot, "intensity", context);
  const double cutoff = plugin.number("cutoff_angle", 20, {0, 90, true});
  const double beam = plugin.number("beam_width", cutoff * 0.75, {0, cutoff});
  light.outer_cone_angle = float(cutoff * kDegree);
  light.inner_cone_angle = float(beam * kDegree);
  light.falloff = SpotFalloff::linear_in_angle;
  if (plugin.has("texture")) plugin.fail("has a texture, which is not supported", ErrorCode::unimplemented);
  context.scene.lights.push_back(light);
}

void read_directional(const Plugin& plugin, LoadContext& context) {
  PunctualLight light = read_punctual(plugin, PunctualKind::directional, "irradiance", context);
  if (plugin.has("direction")) {
    const V3d direction = plugin.vector("direction", {0, 0, 1});
    if (!(length(direction) > 0)) return plugin.fail("has the direction 0");
    light.direction = normalize(direction);
  }
  context.scene.lights.push_back(light);
}

// Width over height of the picture that a projector shows.
double picture_aspect(const TextureSlot& picture, const LoadContext& context) {
  if (!picture.present()) return 1;
  const Image& image = context.scene.images[std::size_t(picture.image)];
  return double(image.width) / image.height;
}

// As Mitsuba 3.9.1's projector.cpp: directions of its perspective sensor (along +z, +x to the left), and the irradiance
// pi times the picture at depth 1. Depths count in the projector's own space, the cosine to the image of its z axis
// by a normal that keeps that axis' length: a projector scaled by s is s times as bright.
void read_projector(const Plugin& plugin, LoadContext& context) {
  PunctualLight light;
  light.name = plugin.element().id.empty() ? plugin.type() : plugin.element().id;
  light.kind = PunctualKind::projector;
  const ColorOrTexture irradiance = read_color(plugin, "irradiance", Rgb(1), SpectrumUse::emission, context);
  light.projection.picture = irradiance.texture;
  const double scale = plugin.number("scale", 1, {0, 1e30});
  const double aspect = picture_aspect(light.projection.picture, context);
  const double half_height = std::tan(vertical_fov(plugin, aspect) / 2);
  const M44d to_world = plugin.transform("to_world");
  light.position = V3d(to_world[3][0], to_world[3][1], to_world[3][2]);

  const V3d x(to_world[0][0], to_world[0][1], to_world[0][2]), y(to_world[1][0], to_world[1][1], to_world[1][2]);
  const V3d z(to_world[2][0], to_world[2][1], to_world[2][2]);
  const double determinant = dot(x, cross(y, z)), box = length(x) * length(y) * length(z);
  if (!(std::abs(determinant) > 1e-9 * box) || !(std::abs(determinant) >= 1e-60) || !(box <= 1e60))
    return plugin.fail("has a transform that flattens it or scales it by more than 1e20");
  // Coordinates of the projector's space, as functions of the world's.
  const V3d depth = cross(x, y) / determinant;
  const double unit = length(depth);
  light.direction = normalize(z);
  light.projection.depth = depth / unit;
  light.projection.across = cross(y, z) * (-0.5 / (half_height * aspect * determinant * unit));
  light.projection.down = cross(z, x) * (-0.5 / (half_height * determinant * unit));
  light.intensity = Rgb(V3d(irradiance.color) * (std::numbers::pi * scale / (unit * unit * length(z))));
  if (!is_finite(light.intensity)) return plugin.fail("is brighter than a float can say, allowed: below 3.4e38");
  context.scene.lights.push_back(light);
}

// Mitsuba puts the first and last rows of a map on the poles (row = v (height - 1)); ours have their centres at
// (j + 0.5) / height. The same function at ours: every row split in `factor`, which leaves only the kinks of the
// piecewise linear function a little rounded.
Image rows_from_poles(const Image& map, const TextureTable& table, int index, TexelEncoding encoding, int factor) {
  Image fine;
  fine.name = map.name;
  fine.width = map.width;
  fine.height = map.height * factor;
  fine.channels = 3;
  fine.format = TexelFormat::f32;
  fine.texels.resize(std::size_t(fine.width) * std::size_t(fine.height) * 12);
  for (int j = 0; j < fine.height; ++j) {
    const double row = (j + 0.5) / fine.height * (map.height - 1);
    const int above = std::min(int(row), std::max(0, map.height - 2)), below = std::min(above + 1, map.height - 1);
    const float t = float(row - above);
    for (int i = 0; i < fine.width; ++i) {
      const V4f a = table.texel(index, encoding, i, above), b = table.texel(index, encoding, i, below);
      const V4f c = a * (1 - t) + b * t;
      const float rgb[3] = {c.x, c.y, c.z};
      std::memcpy(fine.texels.data() + (std::size_t(j) * std::size_t(fine.width) + std::size_t(i)) * 12, rgb, 12);
    }
  }
  return fine;
}

void read_envmap(const Plugin& plugin, LoadContext& context) {
  const int image = load_image(plugin, plugin.text("filename", ""), context);
  if (image < 0) return;
  Image& map = context.scene.images[std::size_t(image)];
  if (Status s = check_environment_image(map); !s.ok()) return context.diagnostics.fail(plugin.place(), s.error());
  const bool integer = map.format == TexelFormat::u8 || map.format == TexelFormat::u16;
  // 32 rows for one as long as that keeps the map below 4 million texels.
  const std::uint64_t texels = std::uint64_t(map.width) * std::uint64_t(map.height);
  int factor = 32;
  while (factor > 1 && texels * std::uint64_t(factor) > (4u << 20)) factor /= 2;
  if (Status s = context.budget.reserve(texels * std::uint64_t(factor), 12, map.name); !s.ok())
    return context.diagnostics.fail(plugin.place(), s.error());
  Image fine = rows_from_poles(map, TextureTable(context.scene.images), image,
                               integer ? TexelEncoding::srgb : TexelEncoding::linear, factor);
  if (Status s = prepare_environment_image(fine); !s.ok()) return context.diagnostics.fail(plugin.place(), s.error());
  plugin.boolean("mis_compensation", false);  // how it is sampled
  Environment environment;
  environment.image = int(context.scene.images.size());
  environment.radiance = Rgb(float(plugin.number("scale", 1, {0, 1e30})));
  environment.to_world = plugin.transform("to_world");
  context.scene.images.push_back(std::move(fine));
  context.scene.environment = environment;
}

void read_environment(const Plugin& plugin, bool own_environment, LoadContext& context) {
  if (!own_environment) return plugin.warn("gives way to the environment that was asked for");
  if (context.scene.environment) return plugin.fail("is a second environment, allowed: 1");
  if (plugin.type() == "envmap") return read_envmap(plugin, context);
  Environment environment;
  environment.radiance = read_plain_color(plugin, "radiance", Rgb(1, 1, 1), SpectrumUse::emission, context);
  context.scene.environment = environment;
}

}  // namespace

void read_emitter(const Element& element, bool own_environment, LoadContext& context) {
  const Plugin plugin(element, context.document, context.diagnostics);
  plugin.number("sampling_weight", 1, {0, 1e30});  // how often it is sampled, not how bright it is
  const std::string& type = plugin.type();
  if (type == "point") return read_point(plugin, context);
  if (type == "spot") return read_spot(plugin, context);
  if (type == "directional") return read_directional(plugin, context);
  if (type == "projector") return read_projector(plugin, context);
  if (type == "constant" || type == "envmap") return read_environment(plugin, own_environment, context);
  plugin.fail(
      "is not supported; emitters that are: area (of a shape), point, spot, directional, projector, constant, "
      "envmap",
      ErrorCode::unimplemented);
}

}  // namespace helio::mitsuba
