#include "tests/statistical/hard/torture_scenes.h"

#include <algorithm>
#include <cstring>
#include <iterator>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kImages = 4;  // of a scene; the last one has values far beyond 1
constexpr int kBright = kImages - 1;

// A few texels of extremes: no picture is worse.
Image extreme_image(Extremes& x, bool bright) {
  Image image;
  image.name = "extreme";
  image.width = 1 + x.below(5);
  image.height = 1 + x.below(5);
  image.channels = 4;
  image.format = bright || x.chance(0.3f) ? TexelFormat::f32 : TexelFormat::u8;
  const int count = image.width * image.height * image.channels;
  if (image.format == TexelFormat::u8) {
    for (int i = 0; i < count; ++i) image.texels.push_back(std::uint8_t(255 * x.unit()));
    return image;
  }
  for (int i = 0; i < count; ++i) {
    const float value = x.unit() * (bright ? x.log_uniform(1e-6f, 1e6f) : 1);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
    image.texels.insert(image.texels.end(), bytes, bytes + sizeof value);
  }
  return image;
}

TextureSlot some_texture(Extremes& x) {
  TextureSlot slot;
  slot.image = x.below(kBright);
  slot.wrap_u = slot.wrap_v = WrapMode(x.below(3));
  slot.filter = FilterMode(x.below(2));
  slot.encoding = TexelEncoding(x.below(2));
  if (x.chance(0.3f)) slot.uv_transform = {x.uniform(-1e3f, 1e3f), 0, x.uniform(), 0, x.uniform(-1e-3f, 1e-3f), 0};
  return slot;
}

// Present or not.
TextureSlot maybe_texture(Extremes& x, float p = 0.2f) {
  return x.chance(p) ? some_texture(x) : TextureSlot();
}

void add_layers(Extremes& x, MaterialLayers& l) {
  l.clearcoat = x.unit();
  l.clearcoat_roughness = x.unit();
  l.clearcoat_normal_texture = maybe_texture(x);
  l.sheen_color = x.color();
  l.sheen_roughness = x.unit();
  l.anisotropy = x.unit();
  l.anisotropy_rotation = x.uniform(-10, 10);
  l.anisotropy_texture = maybe_texture(x);
  l.iridescence = x.unit();
  l.iridescence_ior = x.uniform(1, 3);
  l.iridescence_thickness_max = x.chance(0.3f) ? 0 : x.log_uniform(1, 1e5f);
  l.diffuse_transmission = x.unit();
  l.diffuse_transmission_color = x.color();
}

void be_principled(Extremes& x, Material& m) {
  m.principled = {x.unit(), x.unit(), x.unit(), x.unit(), x.unit(), x.unit(), x.unit()};
  m.transmission = x.chance(0.5f) ? 0 : x.unit();
  m.thickness = m.transmission > 0 ? 1.0f : 0.0f;
  m.ior = m.transmission > 0 ? std::max(m.ior, 1.001f) : m.ior;
  m.one_sided = !(m.transmission > 0);
  m.numbers.metallic = maybe_texture(x);
  m.numbers.transmission = maybe_texture(x);
  m.numbers.anisotropic = maybe_texture(x);
  m.numbers.clearcoat_gloss = maybe_texture(x);
}

// One that is not made of others.
Material simple_material(Extremes& x) {
  static constexpr MaterialModel kModels[] = {MaterialModel::metallic_roughness,
                                              MaterialModel::metallic_roughness,
                                              MaterialModel::specular_glossiness,
                                              MaterialModel::unlit,
                                              MaterialModel::conductor,
                                              MaterialModel::plastic,
                                              MaterialModel::pane,
                                              MaterialModel::principled};
  Material m;
  m.model = kModels[x.below(int(std::size(kModels)))];
  m.base_color = x.color();
  m.base_color_texture = maybe_texture(x);
  m.metallic = x.unit();
  m.roughness = x.unit();
  m.specular = x.unit();
  m.specular_color = x.color();
  m.ior = x.chance(0.3f) ? 1.0f : x.uniform(1, 3);
  m.double_sided = x.chance(0.5f);
  m.distribution = x.chance(0.5f) ? MicrofacetDistribution::ggx : MicrofacetDistribution::beckmann;
  m.numbers.roughness = maybe_texture(x, 0.1f);
  switch (m.model) {
    case MaterialModel::metallic_roughness:
      m.metallic_roughness_texture = maybe_texture(x);
      if (x.chance(0.4f)) {
        m.transmission = x.unit();
        m.thickness = x.chance(0.5f) ? 1.0f : 0.0f;
        m.attenuation_color = x.color();
        m.attenuation_distance = x.log_uniform(1e-6f, 1e6f);
        if (x.chance(0.3f)) m.roughness_across = x.unit();
        m.tinted_reflection = x.chance(0.3f);
      }
      if (x.chance(0.3f)) add_layers(x, m.layers);
      break;
    case MaterialModel::specular_glossiness:
      m.specular_glossiness_f0 = x.color();
      m.glossiness = x.unit();
      m.specular_glossiness_texture = maybe_texture(x);
      break;
    case MaterialModel::conductor:
      m.one_sided = x.chance(0.5f);
      if (x.chance(0.3f)) m.roughness_across = x.unit();
      for (int c = 0; c < 3; ++c) {
        m.conductor_eta[c] = x.chance(0.2f) ? 0 : x.log_uniform(1e-3f, 1e2f);
        m.conductor_k[c] = x.chance(0.2f) ? 0 : x.log_uniform(1e-3f, 1e2f);
      }
      break;
    case MaterialModel::plastic:
      m.one_sided = x.chance(0.5f);
      m.metallic = 0;
      m.ior = std::max(m.ior, 1.0001f);
      m.nonlinear = x.chance(0.5f);
      break;
    case MaterialModel::pane:
      m.metallic = m.roughness = 0;
      m.transmission = 1;
      break;
    case MaterialModel::principled:
      be_principled(x, m);
      break;
    default:
      break;
  }
  return m;
}

void add_map(Extremes& x, Material& m) {
  m.map_rule = MapRule(x.below(3));
  m.map_shadowing = x.chance(0.5f);
  m.map_mirrored = x.chance(0.5f);
  if (x.chance(0.5f)) {
    m.normal_texture = some_texture(x);
    m.normal_texture.encoding = TexelEncoding::linear;
    m.normal_scale = x.chance(0.3f) ? 0 : x.log_uniform(1e-3f, 1e2f);
  } else {
    m.bump_texture = some_texture(x);
    m.bump_scale = (x.chance(0.5f) ? -1 : 1) * x.log_uniform(1e-6f, 1e6f);
  }
}

// What concerns a surface whatever it is made of.
void add_surface(Extremes& x, Material& m) {
  if (x.chance(0.3f)) {
    m.emission = x.color() * x.log_uniform(1e-6f, 1e9f);
    m.emission_texture = maybe_texture(x, 0.3f);
    if (m.emission_texture.present() && x.chance(0.3f)) m.emission_texture.image = kBright;
  }
  if (x.chance(0.2f)) {
    m.alpha_mode = x.chance(0.5f) ? AlphaMode::blend : AlphaMode::mask;
    m.base_alpha = x.unit();
    m.alpha_cutoff = x.unit();
    m.opacity_texture = maybe_texture(x);
  }
}

// Whether a blend may be made of it: as Mitsuba's files have them.
bool is_part(const Material& m, const std::vector<Material>& others) {
  const bool mapped = m.normal_texture.present() || m.bump_texture.present();
  if (m.model == MaterialModel::unlit || m.alpha_mode != AlphaMode::opaque || m.transmission > 0 || m.layers.any() ||
      bounds_volume(m) || (mapped && m.map_rule == MapRule::bend))
    return false;
  const auto is_blend = [&](int i) { return others[std::size_t(i)].model == MaterialModel::blend; };
  return m.model != MaterialModel::blend || !(is_blend(m.blend.first) || is_blend(m.blend.second));
}

// Some are blends of those before.
Material extreme_material(Extremes& x, const std::vector<Material>& before) {
  std::vector<int> opaque;
  for (int i = 0; i < int(before.size()); ++i) {
    if (is_part(before[std::size_t(i)], before)) opaque.push_back(i);
  }
  Material m;
  if (opaque.size() >= 2 && x.chance(0.3f)) {
    m.model = MaterialModel::blend;
    m.blend.first = opaque[std::size_t(x.below(int(opaque.size())))];
    m.blend.second = opaque[std::size_t(x.below(int(opaque.size())))];
    m.blend.weight = x.unit();
    m.blend.weight_texture = maybe_texture(x);
    m.blend.by_side = x.chance(0.3f);
    m.metallic = 0;
  } else {
    m = simple_material(x);
    if (x.chance(0.3f)) add_map(x, m);
  }
  add_surface(x, m);
  return m;
}

// Triangles from needles to squares; some with vertex normals that point anywhere, some with texture coordinates that
// stand still.
TriangleMesh extreme_mesh(Extremes& x, int material, float size) {
  TriangleMesh mesh;
  const int count = 1 + x.below(20);
  for (int i = 0; i < count; ++i) {
    const V3f corner = x.direction() * size * x.uniform();
    const V3f u = x.direction() * size * x.log_uniform(1e-6f, 1), v = x.direction() * size * x.log_uniform(1e-6f, 1);
    const auto first = std::uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {corner, corner + u, corner + (x.chance(0.1f) ? u : v)});
    mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2});
  }
  if (x.chance(0.3f)) {
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) mesh.normals.push_back(x.direction());
  }
  if (x.chance(0.7f)) {
    const float spread = x.chance(0.2f) ? 0 : x.log_uniform(1e-6f, 1e3f);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      mesh.texcoords[0].push_back(V2f(x.uniform(), x.uniform()) * spread);
  }
  if (x.chance(0.2f)) {
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Rgb color = x.color();
      mesh.colors.push_back({color.x, color.y, color.z, x.unit()});
    }
  }
  mesh.material = material;
  return mesh;
}

PunctualLight extreme_light(Extremes& x, float scale) {
  PunctualLight light;
  light.kind = PunctualKind(x.below(4));
  light.position = V3d(x.direction()) * double(scale * x.uniform());
  light.direction = V3d(x.direction());
  light.intensity = x.color() * x.log_uniform(1e-6f, 1e6f);
  if (light.kind != PunctualKind::directional) light.intensity *= sqr(scale);
  if (light.kind == PunctualKind::point && x.chance(0.3f)) light.range = scale * x.log_uniform(1e-3f, 10);
  if (light.kind == PunctualKind::spot) {
    light.outer_cone_angle = x.log_uniform(1e-4f, 1.5f);
    light.inner_cone_angle = light.outer_cone_angle * x.uniform(0, 0.999f);
    light.falloff = SpotFalloff(x.below(2));
  }
  if (light.kind == PunctualKind::projector) {
    const V3d depth = light.direction;
    const V3d across = normalize(cross(depth, std::abs(depth.y) < 0.9 ? V3d(0, 1, 0) : V3d(1, 0, 0)));
    const double half_width = double(x.log_uniform(1e-3f, 10));
    light.projection.depth = depth;
    light.projection.across = across * (0.5 / half_width);
    light.projection.down = cross(depth, across) * (0.5 / half_width);
    light.projection.picture = maybe_texture(x, 0.7f);
  }
  return light;
}

}  // namespace

float Extremes::unit() {
  static const float kEnds[] = {0, 1e-30f, 1e-6f, 1e-4f, 1e-3f, 0.0316f, 0.0995f, 0.1f, 0.5f, 0.999f, 0.9999999f, 1};
  return chance(0.5f) ? kEnds[below(int(std::size(kEnds)))] : uniform();
}

V3f Extremes::direction() {
  for (;;) {
    const V3f v(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    if (length_squared(v) <= 1 && length_squared(v) > 1e-4f) return normalize(v);
  }
}

SceneDescription torture_scene(Extremes& x, float scale) {
  SceneDescription scene;
  for (int i = 0; i < kImages; ++i) scene.images.push_back(extreme_image(x, i == kBright));
  const int materials = 3 + x.below(6);
  for (int i = 0; i < materials; ++i) scene.materials.push_back(extreme_material(x, scene.materials));
  const auto any = [&] { return x.below(materials); };
  if (x.chance(0.6f)) add_mesh(scene, box(V3f(-1) * scale, V3f(1) * scale, any(), true));
  const int objects = 1 + x.below(6);
  for (int i = 0; i < objects; ++i) {
    if (x.chance(0.3f)) {
      add_sphere(scene, x.direction() * scale * x.uniform(), scale * x.log_uniform(1e-4f, 0.7f), any());
      continue;
    }
    Object object;
    object.meshes.push_back(extreme_mesh(x, any(), scale));
    const int index = add_object(scene, std::move(object));
    for (int copies = 1 + x.below(3); copies > 0; --copies) {
      M44d place;
      for (int axis = 0; axis < 3; ++axis) {
        place[axis][axis] = (x.chance(0.2f) ? -1 : 1) * double(x.log_uniform(0.01f, 2));
        place[3][axis] = double(scale) * x.uniform(-0.5f, 0.5f);
      }
      add_instance(scene, index, place);
    }
  }
  for (int lights = x.below(5); lights > 0; --lights) scene.lights.push_back(extreme_light(x, scale));
  if (x.chance(0.7f)) {
    scene.environment = Environment{};
    scene.environment->radiance = x.color() * x.log_uniform(1e-6f, 1e6f);
    if (x.chance(0.4f)) scene.environment->image = x.chance(0.6f) ? kBright : 0;
  }
  return scene;
}

CameraPose torture_camera(Extremes& x, float scale) {
  const V3d eye = V3d(x.direction()) * double(scale) * double(x.chance(0.7f) ? x.uniform() : x.log_uniform(1, 1000));
  CameraPose pose =
      camera_at(eye, V3d(x.direction()) * double(scale) * 0.3, x.chance(0.2f) ? 178 : x.uniform(0.2f, 90));
  if (x.chance(0.2f)) {
    pose.projection = Projection::orthographic;
    pose.half_height = double(scale) * x.log_uniform(1e-3f, 10);
  }
  if (x.chance(0.3f)) {
    pose.lens_radius = double(scale) * x.log_uniform(1e-4f, 1);
    pose.focus_distance = double(scale) * x.log_uniform(1e-2f, 10);
  }
  return pose;
}

}  // namespace helio::test
