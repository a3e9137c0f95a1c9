#include "tests/statistical/bidirectional_scenes.h"

#include <cstring>

#include "tests/support/bumpy_ball.h"
#include "tests/support/random.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

// ---- what scenes are put together from

constexpr int kWalls = 0, kLamp = 1;

// A closed room around the origin, 2 wide, seen from its front wall; its lamp is to be hung.
BidirectionalScene room() {
  BidirectionalScene s;
  s.description.materials = {lambert(Rgb(0.6f, 0.5f, 0.4f)), lambert(Rgb(0, 0, 0), Rgb(9, 8, 7))};
  s.description.materials[kLamp].double_sided = false;
  add_mesh(s.description, box({-1, -1, -1}, {1, 1, 1}, kWalls, true));
  s.pose = camera_at({0, 0, 0.95}, {0, -0.25, -1}, 70);
  return s;
}

// Under the ceiling, shining down.
void hang_lamp(SceneDescription& scene, float half_side, float y = 0.98f) {
  add_mesh(scene, quad({-half_side, y, -half_side}, {2 * half_side, 0, 0}, {0, 0, 2 * half_side}, kLamp));
}

int add_material(SceneDescription& scene, Material material) {
  scene.materials.push_back(std::move(material));
  return int(scene.materials.size()) - 1;
}

Material metal(float alpha) {
  Material m;
  m.metallic = 1;
  m.roughness = std::sqrt(alpha);
  m.base_color = Rgb(0.9f, 0.7f, 0.4f);
  return m;
}

Material absorbing_glass(float ior, const Rgb& color, float distance) {
  Material m = glass(ior);
  m.attenuation_color = color;
  m.attenuation_distance = distance;
  return m;
}

// A ball of few triangles with the normals of a sphere.
TriangleMesh coarse_ball(const V3f& center, float radius, int material) {
  TriangleMesh mesh = bumpy_ball(center, radius, 5, 0, false, 1);
  for (const V3f& p : mesh.positions) mesh.normals.push_back(normalize(p - center));
  mesh.material = material;
  return mesh;
}

template <typename Texel>  // Rgb of (x, y), in [0, 1]; the fourth channel of `alpha`
int add_picture(SceneDescription& scene, int side, Texel&& texel) {
  Image image;
  image.name = "picture";
  image.width = image.height = side;
  image.channels = 4;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (const float value : texel(x, y)) image.texels.push_back(std::uint8_t(std::lround(255 * value)));
    }
  }
  scene.images.push_back(std::move(image));
  return int(scene.images.size()) - 1;
}

TextureSlot slot(int image, FilterMode filter = FilterMode::bilinear) {
  TextureSlot s;
  s.image = image;
  s.filter = filter;
  return s;
}

// Normals up to 45 degrees off, at random.
int add_normal_map(SceneDescription& scene) {
  return add_picture(scene, 4, [random = Random(3)](int, int) mutable {
    const float x = random.next_float() - 0.5f, y = random.next_float() - 0.5f;
    const V3f n = normalize(V3f(x, y, 0.7f));
    return std::array<float, 4>{0.5f + 0.5f * n.x, 0.5f + 0.5f * n.y, 0.5f + 0.5f * n.z, 1};
  });
}

int add_heights(SceneDescription& scene) {
  return add_picture(scene, 6, [random = Random(5)](int, int) mutable {
    const float height = random.next_float();
    return std::array<float, 4>{height, height, height, 1};
  });
}

void add_point(SceneDescription& scene, const V3d& position, const Rgb& intensity) {
  PunctualLight light;
  light.position = position;
  light.intensity = intensity;
  scene.lights.push_back(light);
}

// ---- the scenes

BidirectionalScene diffuse_room() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.1f);
  add_mesh(s.description, box({-0.6f, -1, -0.6f}, {-0.1f, -0.2f, -0.1f}, kWalls));
  s.light_sees_all = true;
  return s;
}

BidirectionalScene smooth_normals() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  add_mesh(s.description, coarse_ball({-0.45f, -0.5f, -0.4f}, 0.45f, kWalls));
  const int rough = add_material(s.description, metal(0.3f));
  add_mesh(s.description, coarse_ball({0.5f, -0.5f, -0.2f}, 0.45f, rough));
  s.light_sees_all = true;
  return s;
}

BidirectionalScene normal_map() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  Material floor = lambert(Rgb(0.8f, 0.7f, 0.6f));
  floor.normal_texture = slot(add_normal_map(s.description));
  add_mesh(s.description, quad({-1, -0.9f, 1}, {2, 0, 0}, {0, 0, -2}, add_material(s.description, floor)));
  Material wall = metal(0.25f);
  wall.normal_texture = floor.normal_texture;
  add_mesh(s.description, quad({-0.9f, -0.9f, -0.9f}, {1.8f, 0, 0}, {0, 1.2f, 0}, add_material(s.description, wall)));
  return s;
}

BidirectionalScene bump_maps() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  Material bent = lambert(Rgb(0.8f, 0.7f, 0.6f));
  bent.bump_texture = slot(add_heights(s.description));
  bent.bump_scale = 0.15f;
  add_mesh(s.description, quad({-1, -0.9f, 1}, {2, 0, 0}, {0, 0, -2}, add_material(s.description, bent)));
  Material framed = bent;
  framed.map_rule = MapRule::own_frame;
  framed.map_shadowing = true;
  add_mesh(s.description, quad({-0.9f, -0.9f, -0.9f}, {1.8f, 0, 0}, {0, 1.4f, 0}, add_material(s.description, framed)));
  framed.map_rule = MapRule::own_frame_unflipped;
  framed.map_shadowing = false;
  framed.map_mirrored = true;
  add_mesh(s.description, coarse_ball({0.4f, -0.45f, -0.2f}, 0.4f, add_material(s.description, framed)));
  return s;
}

// Without weights what a connection to the bright spot on the ceiling brings is without bound.
BidirectionalScene point_in_closed_box() {
  BidirectionalScene s = room();
  add_point(s.description, {0.3, 0.7, -0.2}, Rgb(1, 1.2f, 0.8f));
  s.light_sees_all = true;
  s.samples = 64;
  return s;
}

// A sheet that lets half of the light through, a ten-thousandth above the floor, and a box in a corner.
BidirectionalScene near_touching() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  Material sheet = lambert(Rgb(0.8f, 0.8f, 0.3f));
  sheet.alpha_mode = AlphaMode::blend;
  sheet.base_alpha = 0.5f;
  add_mesh(s.description,
           quad({-0.8f, -0.9999f, 0.6f}, {1.6f, 0, 0}, {0, 0, -1.4f}, add_material(s.description, sheet)));
  add_mesh(s.description, box({0.4999f, -1, -0.9999f}, {0.9999f, -0.3f, -0.5f}, kWalls));
  s.light_sees_all = true;
  return s;
}

// A lit floor that leaves the film on every side.
BidirectionalScene film_edges() {
  BidirectionalScene s;
  s.description.materials = {lambert(Rgb(0.7f, 0.7f, 0.7f)), lambert(Rgb(0, 0, 0), Rgb(9, 8, 7))};
  s.description.materials[kLamp].double_sided = false;
  add_mesh(s.description, quad({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, kWalls));
  add_mesh(s.description, box({-0.2f, 0, -0.2f}, {0.1f, 0.4f, 0.1f}, kWalls));
  hang_lamp(s.description, 0.8f, 3);
  s.pose = camera_at({0.4, 1.5, 1}, {0, 0, 0}, 50);
  s.max_segments = 4;
  s.light_sees_all = true;
  return s;
}

BidirectionalScene film_edges_gaussian() {
  BidirectionalScene s = film_edges();
  s.filter = {PixelFilterKind::gaussian, 0.8};
  return s;
}

BidirectionalScene film_edges_thin_lens() {
  BidirectionalScene s = film_edges();
  s.pose.lens_radius = 0.2;
  s.pose.focus_distance = 1.2;
  return s;
}

BidirectionalScene film_edges_orthographic() {
  BidirectionalScene s = film_edges();
  s.samples = 32;
  s.pose.projection = Projection::orthographic;
  s.pose.half_height = 0.6;
  return s;
}

BidirectionalScene film_edges_orthographic_lens() {
  BidirectionalScene s = film_edges_orthographic();
  s.filter = {PixelFilterKind::tent, 1.5};
  s.pose.lens_radius = 0.2;
  s.pose.focus_distance = 1.2;
  return s;
}

BidirectionalScene mirrored_instances() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  const int rough = add_material(s.description, metal(0.3f));
  Object object;
  object.meshes.push_back(coarse_ball({0, 0, 0}, 0.3f, rough));
  object.meshes.push_back(box({-0.1f, 0.2f, -0.1f}, {0.3f, 0.5f, 0.2f}, kWalls));
  object.spheres.push_back({V3f(-0.2f, 0.3f, 0), 0.15f, kWalls});
  // Fronts stay fronts in the mirror, and so does the lamp's.
  object.meshes.push_back(quad({-0.1f, 0.9f, -0.1f}, {0.2f, 0, 0}, {0, 0.1f, 0.2f}, kLamp));
  const int index = add_object(s.description, object);
  M44d placed, mirrored, squashed;
  placed[3][0] = -0.5, placed[3][1] = -0.65;
  mirrored[0][0] = -1.2, mirrored[3][0] = 0.55, mirrored[3][1] = -0.5, mirrored[3][2] = -0.4;
  squashed[1][1] = -0.5, squashed[2][2] = 0.8, squashed[3][1] = 0.4, squashed[3][2] = -0.6;
  for (const M44d& m : {placed, mirrored, squashed}) add_instance(s.description, index, m);
  s.light_sees_all = true;
  s.samples = 40;
  return s;
}

BidirectionalScene glass_in_absorbing_glass() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.6f);
  add_sphere(s.description, {0, -0.3f, -0.2f}, 0.6f,
             add_material(s.description, absorbing_glass(1.3f, Rgb(0.5f, 0.8f, 0.6f), 0.6f)));
  add_sphere(s.description, {0.1f, -0.25f, -0.2f}, 0.3f,
             add_material(s.description, absorbing_glass(1.6f, Rgb(0.9f, 0.4f, 0.3f), 0.4f)));
  // A diffuse body in the glass: vertices inside of volumes are joined to one another.
  add_mesh(s.description, box({-0.4f, -0.4f, -0.3f}, {-0.25f, -0.2f, 0}, kWalls));
  s.max_segments = 9;
  s.largest_error = 0.005;
  return s;
}

// Light paths begin inside of one volume, and some of another.
BidirectionalScene lamps_in_absorbing_glass() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  add_sphere(s.description, {0, -0.3f, -0.2f}, 0.6f,
             add_material(s.description, absorbing_glass(1.3f, Rgb(0.5f, 0.8f, 0.6f), 0.6f)));
  add_mesh(s.description, box({-0.05f, -0.5f, -0.5f}, {0.35f, -0.1f, 0},
                              add_material(s.description, absorbing_glass(1.5f, Rgb(0.9f, 0.4f, 0.3f), 0.4f))));
  const int lamp = add_material(s.description, lambert(Rgb(0, 0, 0), Rgb(8, 8, 8)));
  add_mesh(s.description, quad({-0.4f, -0.4f, -0.2f}, {0.2f, 0, 0}, {0, 0.3f, 0.1f}, lamp));
  add_mesh(s.description, quad({0.05f, -0.4f, -0.3f}, {0.2f, 0, 0}, {0, 0.2f, 0}, lamp));
  add_mesh(s.description, box({-0.2f, -0.75f, -0.3f}, {0.1f, -0.6f, 0}, kWalls));
  s.max_segments = 8;
  s.largest_error = 0.005;
  return s;
}

BidirectionalScene lamp_behind_frosted_glass() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.65f);
  Material frosted = absorbing_glass(1.5f, Rgb(0.9f, 0.8f, 0.7f), 0.2f);
  frosted.roughness = 0.6f;
  const int material = add_material(s.description, frosted);
  add_mesh(s.description, box({-0.8f, 0.8f, -0.8f}, {0.8f, 0.9f, 0.8f}, material));
  s.max_segments = 7;
  s.largest_error = 0.005;
  return s;
}

// A bright spot of the sky, seen through a hole in the wall by the room alone.
// So few light paths get in that pixels of `light` are far from normal: it is not compared.
BidirectionalScene sky_through_window() {
  BidirectionalScene s;
  s.description.materials = {lambert(Rgb(0.7f, 0.6f, 0.5f))};
  const auto wall = [&](const V3f& corner, const V3f& u, const V3f& v) {
    add_mesh(s.description, quad(corner, u, v, kWalls));
  };
  wall({-1, -1, 1}, {2, 0, 0}, {0, 0, -2});
  wall({-1, 1, 1}, {0, 0, -2}, {2, 0, 0});
  wall({-1, -1, -1}, {2, 0, 0}, {0, 2, 0});
  wall({-1, -1, 1}, {0, 2, 0}, {2, 0, 0});
  wall({1, -1, 1}, {0, 0, -2}, {0, 2, 0});
  // The left wall around the window, 0.5 high and wide.
  wall({-1, -1, 1}, {0, 0, -2}, {0, 1, 0});
  wall({-1, 0.5f, 1}, {0, 0, -2}, {0, 0.5f, 0});
  wall({-1, 0, 1}, {0, 0, -1}, {0, 0.5f, 0});
  wall({-1, 0, -0.5f}, {0, 0, -0.5f}, {0, 0.5f, 0});
  Image sky;
  sky.name = "sky";
  sky.width = 16, sky.height = 8, sky.channels = 3, sky.format = TexelFormat::f32;
  std::vector<float> texels;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      const float bright = y == 2 && x % 4 == 1 ? 30 : y < 4 ? 2 : 0.3f;
      texels.insert(texels.end(), {bright, bright, 1.2f * bright});
    }
  }
  sky.texels.resize(texels.size() * sizeof(float));
  std::memcpy(sky.texels.data(), texels.data(), sky.texels.size());
  s.description.images.push_back(sky);
  s.description.environment = Environment{};
  s.description.environment->image = 0;
  s.pose = camera_at({0.2, 0, 0.95}, {0.2, -0.25, -1}, 70);
  s.max_segments = 5;
  s.samples = 32;
  s.largest_error = 0.005;
  return s;
}

BidirectionalScene constant_sky() {
  BidirectionalScene s = film_edges();
  s.description.instances.pop_back();  // the lamp
  s.description.environment = Environment{};
  s.description.environment->radiance = Rgb(1, 1.5f, 2);
  s.samples = 64;
  add_mesh(s.description, box({-1, 0, -1}, {-0.4f, 0.6f, -0.4f}, kWalls));
  return s;
}

BidirectionalScene mirror_and_glass() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.5f);
  add_sphere(s.description, {-0.45f, -0.6f, -0.4f}, 0.4f, add_material(s.description, metal(0)));
  add_sphere(s.description, {0.45f, -0.6f, 0}, 0.4f, add_material(s.description, glass(1.5f)));
  add_mesh(s.description, coarse_ball({0.1f, 0.2f, -0.6f}, 0.3f, add_material(s.description, glass(1.4f))));
  s.max_segments = 7;
  s.largest_error = 0.005;
  return s;
}

BidirectionalScene glossy_metal() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  const int glossy = add_material(s.description, metal(0.1f));
  add_sphere(s.description, {-0.45f, -0.55f, -0.4f}, 0.4f, glossy);
  add_mesh(s.description, box({0.1f, -1, -0.7f}, {0.7f, -0.2f, -0.2f}, glossy));
  s.light_sees_all = true;
  s.largest_error = 0.005;
  return s;
}

BidirectionalScene punctual_lights() {
  BidirectionalScene s;
  s.description.materials = {lambert(Rgb(0.7f, 0.6f, 0.5f))};
  add_mesh(s.description, quad({-1, -1, 1}, {2, 0, 0}, {0, 0, -2}, kWalls));
  add_mesh(s.description, quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, kWalls));
  add_mesh(s.description, quad({1, -1, 1}, {0, 0, -2}, {0, 2, 0}, kWalls));
  add_mesh(s.description, box({-0.6f, -1, -0.6f}, {-0.1f, -0.2f, -0.1f}, kWalls));
  PunctualLight spot;
  spot.kind = PunctualKind::spot;
  spot.position = {0.2, 0.9, 0.3};
  spot.direction = V3d(0.2, -1, -0.3).normalized();
  spot.inner_cone_angle = 0.3f, spot.outer_cone_angle = 0.6f;
  spot.intensity = Rgb(3, 2, 1);
  PunctualLight sun;
  sun.kind = PunctualKind::directional;
  sun.direction = V3d(0.4, -0.8, -0.5).normalized();
  sun.intensity = Rgb(0.5f, 0.6f, 0.8f);
  PunctualLight projector;
  projector.kind = PunctualKind::projector;
  projector.position = {-0.3, 0.2, 0.9};
  projector.direction = {0, 0, -1};
  projector.intensity = Rgb(2, 2, 2);
  projector.projection.picture =
      slot(add_picture(s.description, 4,
                       [](int x, int y) {
                         return std::array<float, 4>{(x + y) % 2 ? 1.0f : 0.1f, x / 3.0f, y / 3.0f, 1};
                       }),
           FilterMode::nearest);
  PunctualLight ranged;
  ranged.position = {0.5, -0.3, 0.2};
  ranged.range = 1.1f;
  ranged.intensity = Rgb(0.3f, 0.2f, 0.4f);
  s.description.lights = {spot, sun, projector, ranged};
  s.pose = camera_at({0, 0, 0.95}, {0, -0.25, -1}, 70);
  s.light_sees_all = true;
  s.samples = 64;
  return s;
}

// A pane that lets half through, one with holes, and a two-sided lamp whose brightness a picture gives.
BidirectionalScene alpha_and_textured_lamp() {
  BidirectionalScene s = room();
  const int picture = add_picture(s.description, 4, [](int x, int y) {
    return std::array<float, 4>{x == y ? 1.0f : 0.2f, 0.5f, x / 3.0f, (x + y) % 2 ? 1.0f : 0.0f};
  });
  Material lamp = lambert(Rgb(0.2f, 0.2f, 0.2f), Rgb(6, 6, 6));
  lamp.emission_texture = slot(picture);
  add_mesh(s.description,
           quad({-0.3f, 0.1f, -0.5f}, {0.6f, 0, 0.2f}, {0, 0.5f, 0.1f}, add_material(s.description, lamp)));
  Material pane = lambert(Rgb(0.3f, 0.8f, 0.3f));
  pane.alpha_mode = AlphaMode::blend;
  pane.base_alpha = 0.4f;
  add_mesh(s.description, quad({-0.8f, -0.9f, 0.1f}, {0.8f, 0, 0}, {0, 0.8f, 0}, add_material(s.description, pane)));
  Material holes = lambert(Rgb(0.8f, 0.7f, 0.6f));
  holes.base_color_texture = slot(picture, FilterMode::nearest);
  holes.alpha_mode = AlphaMode::mask;
  add_mesh(s.description, quad({0.1f, -0.6f, 0.2f}, {0.8f, 0, 0}, {0, 0, -0.9f}, add_material(s.description, holes)));
  s.light_sees_all = true;
  return s;
}

BidirectionalScene black_backs_and_thin_sheets() {
  BidirectionalScene s = room();
  hang_lamp(s.description, 0.3f);
  Material one_sided = lambert(Rgb(0.8f, 0.7f, 0.6f));
  one_sided.double_sided = false;
  one_sided.one_sided = true;
  const int front = add_material(s.description, one_sided);
  add_mesh(s.description, quad({-0.9f, -0.9f, -0.3f}, {0.6f, 0, 0.2f}, {0, 0.9f, 0}, front));  // front in view
  add_mesh(s.description, quad({-0.2f, -0.9f, -0.4f}, {0, 0.7f, 0}, {0.4f, 0, 0}, front));     // back in view
  Material paper = lambert(Rgb(0.8f, 0.8f, 0.7f));
  paper.layers.diffuse_transmission = 0.6f;
  paper.layers.diffuse_transmission_color = Rgb(0.9f, 0.6f, 0.4f);
  add_mesh(s.description,
           quad({0.3f, -0.5f, -0.6f}, {0.6f, 0, 0}, {0, 0.1f, 0.6f}, add_material(s.description, paper)));
  Material thin = glass(1.5f);
  thin.thickness = 0;
  thin.roughness = 0.8f;
  add_mesh(s.description, quad({-0.7f, 0.5f, 0.4f}, {1.4f, 0, 0}, {0, 0, -1.0f}, add_material(s.description, thin)));
  s.light_sees_all = true;
  s.samples = 32;
  return s;
}

BidirectionalScene sphere_lamps() {
  BidirectionalScene s = room();
  add_sphere(s.description, {-0.4f, 0.3f, -0.3f}, 0.15f, kLamp);
  Object object;
  object.spheres.push_back({V3f(0, 0, 0), 0.2f, kLamp});
  M44d stretched;
  stretched[0][0] = 0.3, stretched[2][2] = 1.5;
  stretched[3][0] = 0.6, stretched[3][1] = -0.4, stretched[3][2] = -0.4;
  add_instance(s.description, add_object(s.description, object), stretched);
  add_mesh(s.description, box({-0.2f, -1, -0.4f}, {0.2f, -0.5f, 0}, kWalls));
  s.light_sees_all = true;
  s.samples = 24;
  return s;
}

// Of everything a little (small_rooms.h).
BidirectionalScene everything() {
  BidirectionalScene s;
  s.description = mixed_scene();
  s.pose = camera_at({0, 0, 0.95}, {0, -0.25, -1}, 70);
  s.largest_error = 0.005;
  return s;
}

// Walls and a box of two blends each: what is known of one vertex's blend must outlive the evaluation of another's.
BidirectionalScene two_blends() {
  BidirectionalScene s = room();
  SceneDescription& scene = s.description;
  hang_lamp(scene, 0.3f);
  const auto blend_of = [&](const Rgb& color, const Material& other, float weight) {
    Material m;
    m.model = MaterialModel::blend;
    m.blend.first = add_material(scene, lambert(color));
    m.blend.second = add_material(scene, other);
    m.blend.weight = weight;
    return add_material(scene, m);
  };
  scene.materials[kWalls] = scene.materials[std::size_t(blend_of(Rgb(0.7f, 0.3f, 0.2f), metal(0.4f), 0.3f))];
  const int box_material = blend_of(Rgb(0.1f, 0.3f, 0.8f), metal(0.2f), 0.7f);
  add_mesh(scene, box({-0.5f, -1, -0.7f}, {0.3f, -0.4f, 0}, box_material));
  return s;
}

constexpr NamedBidirectionalScene kScenes[] = {
    {"DiffuseRoom", diffuse_room, true},
    {"SmoothNormals", smooth_normals},
    {"NormalMap", normal_map},
    {"BumpMaps", bump_maps},
    {"PointInClosedBox", point_in_closed_box},
    {"NearTouching", near_touching, true},
    {"FilmEdges", film_edges},
    {"FilmEdgesGaussian", film_edges_gaussian},
    {"FilmEdgesThinLens", film_edges_thin_lens, true},
    {"FilmEdgesOrthographic", film_edges_orthographic},
    {"FilmEdgesOrthographicLens", film_edges_orthographic_lens},
    {"MirroredInstances", mirrored_instances},
    {"GlassInAbsorbingGlass", glass_in_absorbing_glass, true},
    {"LampsInAbsorbingGlass", lamps_in_absorbing_glass},
    {"LampBehindFrostedGlass", lamp_behind_frosted_glass},
    {"SkyThroughWindow", sky_through_window},
    {"ConstantSky", constant_sky, true},
    {"MirrorAndGlass", mirror_and_glass, true},
    {"GlossyMetal", glossy_metal},
    {"PunctualLights", punctual_lights, true},
    {"AlphaAndTexturedLamp", alpha_and_textured_lamp, true},
    {"BlackBacksAndThinSheets", black_backs_and_thin_sheets},
    {"SphereLamps", sphere_lamps},
    {"TwoBlends", two_blends},
    {"Everything", everything},
};

}  // namespace

BidirectionalScene half_covered() {
  BidirectionalScene s;
  SceneDescription& scene = s.description;
  scene.materials = {lambert(Rgb(0.6f, 0.5f, 0.4f)), lambert(Rgb(0, 0, 0), Rgb(800, 720, 640))};
  scene.materials[kLamp].double_sided = false;
  add_mesh(scene, box({-3, -1, -1}, {1, 1, 1}, kWalls, true));
  add_mesh(scene, quad({0, -1, -1}, {0, 0, 1.7f}, {0, 2, 0}, kWalls));
  add_mesh(scene, quad({0.45f, 0.95f, 0.05f}, {0.1f, 0, 0}, {0, 0, -0.1f}, kLamp));  // shines up
  add_mesh(scene, quad({0.2f, 0.94f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, kWalls));   // its cover
  // Its texels are much smaller than pixels: what is as noisy one way as the other.
  Material screen = lambert(Rgb(0, 0, 0), Rgb(3, 3, 3));
  screen.emission_texture = slot(add_picture(scene, 5,
                                             [](int x, int y) {
                                               const float value = x == 0 && y == 0 ? 1 : 0;
                                               return std::array<float, 4>{value, value, value, 1};
                                             }),
                                 FilterMode::nearest);
  screen.emission_texture.uv_transform = {3001, 0, 0, 0, 2003, 0};
  add_mesh(scene, quad({-3, -1, -0.99f}, {3, 0, 0}, {0, 2, 0}, add_material(scene, screen)));
  s.pose = camera_at({0.002, 0, 0.95}, {-0.4, 0, -1}, 45);
  s.largest_error = 0.01;
  return s;
}

std::span<const NamedBidirectionalScene> bidirectional_scenes() {
  return kScenes;
}

void PrintTo(const NamedBidirectionalScene& scene, std::ostream* out) {
  *out << scene.name;
}

}  // namespace helio::test
