#include "tests/statistical/closed_form_scenes.h"

#include <array>
#include <cstring>
#include <ostream>

namespace helio::test {
namespace {

constexpr double kPiD = std::numbers::pi;
// Of the views of one point: a thousandth of the distance, within which nothing here changes by more than 1e-5.
constexpr double kPoint = 1e-3;
constexpr int kDirect = 2;  // segments: light sources and what they light

V3d times(const V3d& a, const V3d& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}

Environment constant_environment(const Rgb& radiance) {
  Environment e;
  e.radiance = radiance;
  return e;
}

Material mirror(const Rgb& f0) {
  Material m;
  m.base_color = f0;
  m.metallic = 1;
  m.roughness = 0;
  return m;
}

// Black, and shines from its front alone.
Material lamp(const Rgb& radiance) {
  Material m = lambert(Rgb(0, 0, 0), radiance);
  m.double_sided = false;
  return m;
}

// No larger than it need be: surfaces and the starts of rays are off by some 1e-5 of a scene's extent
// (trace/accel/edge_dilation.h, trace/scene/surface.h), and so is what a lamp nearby gives.
TriangleMesh floor_quad(float half_side) {
  return quad({-half_side, 0, half_side}, {2 * half_side, 0, 0}, {0, 0, -2 * half_side}, 0);
}

// A floor of albedo (0.6, 0.4, 0.2) through the origin, seen there from beside and above.
ClosedFormScene lit_floor() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(0.6f, 0.4f, 0.2f))};
  add_mesh(s.description, floor_quad(1));
  s.eye = {0.3, 0.4, 0.8};
  s.target = {0, 0, 0};
  s.reach = kPoint * length(s.eye);
  s.max_segments = kDirect;
  return s;
}
const V3d kFloorAlbedo(0.6, 0.4, 0.2);

// ---- furnaces: under constant light a body that reflects all of it is invisible, and a convex one of albedo a shows
// ---- a times the light

ClosedFormScene white_furnace() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(1, 1, 1))};
  add_mesh(s.description, floor_quad(50));
  add_mesh(s.description, box({-1.5f, 0, -0.5f}, {-0.5f, 1, 0.5f}, 0));
  add_sphere(s.description, {1, 1, 0}, 1, 0);
  s.description.environment = constant_environment({1, 2, 0.5f});
  s.radiance = {1, 2, 0.5};
  s.eye = {0, 2.5, 6};
  s.target = {0, 0.5, 0};
  s.reach = 2;
  s.max_segments = 300;  // next to no path gets there
  return s;
}

// The same of boxes in instances, moved, scaled and mirrored.
ClosedFormScene white_furnace_of_instances() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(1, 1, 1))};
  Object object;
  object.meshes.push_back(box({-1, -1, -1}, {1, 1, 1}, 0));
  const int index = add_object(s.description, object);
  M44d moved, mirrored;
  moved[3][0] = -1.2;
  mirrored[0][0] = -0.4;
  mirrored[3][0] = 1;
  mirrored[3][1] = 0.3;
  add_instance(s.description, index, moved);
  add_instance(s.description, index, mirrored);
  s.description.environment = constant_environment({1, 1, 1});
  s.radiance = {1, 1, 1};
  s.eye = {1, 2, 6};
  s.target = {0, 0, 0};
  s.reach = 1.5;
  s.max_segments = 300;
  return s;
}

ClosedFormScene grey_floor_in_furnace() {
  ClosedFormScene s = lit_floor();
  s.description.environment = constant_environment({1, 2, 0.5f});
  s.radiance = times(kFloorAlbedo, {1, 2, 0.5});
  s.reach = 0.1;
  return s;
}

ClosedFormScene grey_sphere_in_furnace() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(0.18f, 0.5f, 0.9f))};
  add_sphere(s.description, {0, 0, 0}, 1, 0);
  s.description.environment = constant_environment({2, 2, 2});
  s.radiance = {0.36, 1, 1.8};
  s.eye = {1, 2, 4};
  s.target = {0, 0, 0};
  s.reach = 0.5;
  s.max_segments = 4;
  return s;
}

ClosedFormScene mirror_sphere_in_furnace() {
  ClosedFormScene s = grey_sphere_in_furnace();
  s.description.materials = {mirror(Rgb(1, 1, 1))};
  s.radiance = {2, 2, 2};
  s.reach = 1.5;
  return s;
}

ClosedFormScene glass_sphere_in_furnace() {
  ClosedFormScene s = mirror_sphere_in_furnace();
  s.description.materials = {glass(1.5f)};
  s.max_segments = 200;  // total internal reflection may go round; a hundredth of the paths has ten segments
  return s;
}

// ---- closed rooms: every bounce returns the same share of the light, n segments see the first n terms of the series

// Walls that emit e and reflect a: e (1 + a + ... + a^(n-1)).
ClosedFormScene emitting_box() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(0.5f, 0.25f, 0.8f), Rgb(1, 2, 0.5f))};
  add_mesh(s.description, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  s.eye = {0.2, 0.1, 0.3};
  s.target = {-0.5, 0.2, -0.4};
  s.reach = 0.3;
  s.max_segments = 7;
  s.radiance = {0, 0, 0};
  V3d term(1, 2, 0.5);
  for (int i = 0; i < s.max_segments; ++i, term = times(term, {0.5, 0.25, 0.8})) s.radiance += term;
  return s;
}

// The same walls as mirrors, seen along their normals, where Schlick's reflectance is f0: the same series.
ClosedFormScene mirror_box() {
  ClosedFormScene s = emitting_box();
  Material& walls = s.description.materials[0];
  walls = mirror(Rgb(0.5f, 0.25f, 0.8f));
  walls.emission = Rgb(1, 2, 0.5f);
  s.eye = {0.2, 0.1, 0.3};
  s.target = {0.2, 0.1, -1};
  s.reach = 1.3 * kPoint;
  return s;
}

// A point light of intensity I in the middle of a sphere of radius R and albedo a: its irradiance I / R^2 is the same
// everywhere, and so is that of each bounce, a times the one before (integrating sphere: Walsh 1920). Radiance
// I / (pi R^2) (a + a^2 + ... + a^(n-1)).
ClosedFormScene integrating_sphere() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(0.9f, 0.5f, 0.2f))};
  add_sphere(s.description, {0, 0, 0}, 2, 0);
  PunctualLight light;
  light.intensity = Rgb(4, 8, 2);
  s.description.lights = {light};
  s.eye = {0.5, 0.1, 0};
  s.target = {1.5, 0.3, 0.2};
  s.reach = 0.4;
  s.max_segments = 9;
  s.radiance = {0, 0, 0};
  const V3d albedo(0.9, 0.5, 0.2);
  V3d term = times(albedo, V3d(4, 8, 2) / (kPiD * 4));
  for (int i = 1; i < s.max_segments; ++i, term = times(term, albedo)) s.radiance += term;
  return s;
}

// The same sphere around a black lamp of radius r and radiance L. The wall sees it under the form factor
// x = (r / R)^2 and itself under 1 - x (concentric spheres: Siegel and Howell, Thermal Radiation Heat Transfer).
// Radiance L x (a + a^2 (1 - x) + ... + a^(n-1) (1 - x)^(n-2)).
ClosedFormScene lamp_in_a_sphere() {
  ClosedFormScene s = integrating_sphere();
  s.description.lights.clear();
  s.description.materials.push_back(lamp(Rgb(4, 8, 2)));
  add_sphere(s.description, {0, 0, 0}, 0.5f, 1);
  s.eye = {1, 0, 0};
  s.target = {1.9, 0, 0};
  s.radiance = {0, 0, 0};
  const V3d albedo(0.9, 0.5, 0.2);
  const double x = 0.0625;
  V3d term = times(albedo, V3d(4, 8, 2) * x);
  for (int i = 1; i < s.max_segments; ++i, term = times(term, albedo) * (1 - x)) s.radiance += term;
  return s;
}

// ---- light sources over a Lambert floor: albedo / pi times the irradiance E

// Form factor of a rectangle a x b at height h, parallel to the element below its corner (Siegel and Howell, Thermal
// Radiation Heat Transfer, configuration factors of elements).
double corner_form_factor(double a, double b, double h) {
  const double x = a / h, y = b / h, rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
  return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2 * kPiD);
}

// A rectangle of 0.8 x 0.5 facing down from height 1, a corner of it 0.2 and 0.1 from above the origin.
void add_rectangle(SceneDescription& scene, const Rgb& radiance) {
  scene.materials.push_back(lamp(radiance));
  const int material = int(scene.materials.size()) - 1;
  add_mesh(scene, quad({-0.2f, 1, -0.1f}, {0.8f, 0, 0}, {0, 0, 0.5f}, material));
}
double rectangle_form_factor() {
  return corner_form_factor(0.2, 0.1, 1) + corner_form_factor(0.6, 0.1, 1) + corner_form_factor(0.2, 0.4, 1) +
         corner_form_factor(0.6, 0.4, 1);
}

// E = pi L F.
ClosedFormScene rectangle_light() {
  ClosedFormScene s = lit_floor();
  add_rectangle(s.description, {5, 4, 3});
  s.radiance = times(kFloorAlbedo, {5, 4, 3}) * rectangle_form_factor();
  return s;
}

// Lambert's formula for a polygon that the element sees whole (Photometria, 1760): E = L / 2 sum of
// angle_i cos(normal, edge plane_i) over its edges.
double polygon_irradiance(std::span<const V3d> corners, const V3d& normal) {
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const V3d a = normalize(corners[i]), b = normalize(corners[(i + 1) % corners.size()]);
    const V3d edge = cross(a, b);
    sum += std::atan2(length(edge), dot(a, b)) * dot(normal, edge / length(edge));
  }
  return std::abs(sum) / 2;
}

ClosedFormScene triangle_light() {
  ClosedFormScene s = lit_floor();
  s.description.materials.push_back(lamp(Rgb(20, 10, 5)));
  s.description.materials.back().double_sided = true;
  const std::array<V3d, 3> corners = {V3d(-0.9, 0.5, -0.6), V3d(0.3, 1.2, -1.1), V3d(0.2, 0.4, -0.5)};
  TriangleMesh mesh;
  for (const V3d& corner : corners) mesh.positions.push_back(V3f(corner));
  mesh.indices = {0, 1, 2};
  mesh.material = 1;
  add_mesh(s.description, std::move(mesh));
  s.radiance = times(kFloorAlbedo, {20, 10, 5}) * (polygon_irradiance(corners, {0, 1, 0}) / kPiD);
  return s;
}

// A sphere all above the horizon: E = pi L (r / d)^2 cos (Siegel and Howell).
const V3d kLampCenter(-0.6, 1.2, -0.8);
constexpr double kLampRadius = 0.4;
double sphere_form_factor() {
  return kLampRadius * kLampRadius * kLampCenter.y / std::pow(length(kLampCenter), 3);
}

ClosedFormScene sphere_light() {
  ClosedFormScene s = lit_floor();
  s.description.materials.push_back(lamp(Rgb(5, 4, 3)));
  add_sphere(s.description, V3f(kLampCenter), float(kLampRadius), 1);
  s.radiance = times(kFloorAlbedo, {5, 4, 3}) * sphere_form_factor();
  return s;
}

// Radiance 4 - theta at the angle theta from the zenith: E = 2 pi int (4 - theta) cos sin = pi (4 - pi / 4). Linear in
// theta, as texels are interpolated: rows give it exactly, but for half a row at the zenith.
ClosedFormScene sky_with_a_gradient() {
  ClosedFormScene s = lit_floor();
  Image map;
  map.name = "sky";
  map.width = 4;
  map.height = 256;
  map.channels = 3;
  map.format = TexelFormat::f32;
  map.texels.resize(std::size_t(map.width) * std::size_t(map.height) * 12);
  for (std::size_t i = 0; i < map.texels.size(); i += 12) {
    const float radiance = float(4 - (double(i / 12 / 4) + 0.5) / 256 * kPiD);
    for (std::size_t c = 0; c < 12; c += 4) std::memcpy(&map.texels[i + c], &radiance, 4);
  }
  s.description.images = {map};
  s.description.environment = constant_environment({1, 1, 1});
  s.description.environment->image = 0;
  s.radiance = kFloorAlbedo * (4 - kPiD / 4);
  return s;
}

// E = I cos / d^2 at the origin, (x, y, z) above it.
const V3d kPointPlace(0.5, 1.5, 0.7);
double point_irradiance() {
  return kPointPlace.y / std::pow(length(kPointPlace), 3);
}

PunctualLight point_source(const Rgb& intensity) {
  PunctualLight light;
  light.position = kPointPlace;
  light.intensity = intensity;
  return light;
}

ClosedFormScene point_light() {
  ClosedFormScene s = lit_floor();
  s.description.lights = {point_source({4, 8, 2})};
  s.radiance = times(kFloorAlbedo, {4, 8, 2}) * (point_irradiance() / kPiD);
  return s;
}

// The same between the cones of a spot, 20 degrees off its axis: KHR_lights_punctual has the square of
// (cos - cos outer) / (cos inner - cos outer).
constexpr double kDegree = kPiD / 180;
PunctualLight spot_source(const Rgb& intensity) {
  PunctualLight light = point_source(intensity);
  light.kind = PunctualKind::spot;
  const V3d to_floor = -normalize(kPointPlace), across = normalize(cross(to_floor, V3d(0, 1, 0)));
  light.direction = to_floor * std::cos(20 * kDegree) + across * std::sin(20 * kDegree);
  light.inner_cone_angle = float(10 * kDegree);
  light.outer_cone_angle = float(35 * kDegree);
  return light;
}
double spot_factor() {
  const double outer = std::cos(35 * kDegree), inner = std::cos(10 * kDegree);
  return std::pow((std::cos(20 * kDegree) - outer) / (inner - outer), 2);
}

ClosedFormScene spot_light() {
  ClosedFormScene s = lit_floor();
  s.description.lights = {spot_source({4, 8, 2})};
  s.radiance = times(kFloorAlbedo, {4, 8, 2}) * (spot_factor() * point_irradiance() / kPiD);
  return s;
}

// E = E_facing cos.
PunctualLight sun(const Rgb& irradiance) {
  PunctualLight light;
  light.kind = PunctualKind::directional;
  light.direction = {-0.6, -0.8, 0};
  light.intensity = irradiance;
  return light;
}

ClosedFormScene directional_light() {
  ClosedFormScene s = lit_floor();
  s.description.lights = {sun({3, 2, 1})};
  s.radiance = times(kFloorAlbedo, {3, 2, 1}) * (0.8 / kPiD);
  return s;
}

// Light adds up. Two lights are selected by their power.
ClosedFormScene two_lights() {
  ClosedFormScene s = point_light();
  s.description.lights.push_back(sun({3, 2, 1}));
  s.radiance += directional_light().radiance;
  return s;
}

// More by a light tree; the lamps hide their own part of the sky.
ClosedFormScene six_lights() {
  ClosedFormScene s = rectangle_light();
  s.description.materials.push_back(lamp(Rgb(5, 4, 3)));
  add_sphere(s.description, V3f(kLampCenter), float(kLampRadius), 2);
  s.description.lights = {sun({3, 2, 1}), point_source({4, 8, 2}), spot_source({4, 8, 2})};
  // From the spot's place to one from which no lamp is in the way either.
  s.description.lights[1].position.z = -kPointPlace.z;
  s.description.lights[1].position.x = -kPointPlace.x - 1;
  s.description.environment = constant_environment({0.5f, 0.6f, 0.7f});
  const V3d moved = s.description.lights[1].position;
  s.radiance += sphere_light().radiance + directional_light().radiance + spot_light().radiance;
  s.radiance += times(kFloorAlbedo, {4, 8, 2}) * (moved.y / std::pow(length(moved), 3) / kPiD);
  s.radiance += times(kFloorAlbedo, {0.5, 0.6, 0.7}) * (1 - rectangle_form_factor() - sphere_form_factor());
  s.samples = 2048;
  return s;
}

// ---- panes and slabs

// Half-opaque black: 1 - alpha of what is behind.
ClosedFormScene alpha_pane() {
  ClosedFormScene s;
  s.description.materials = {lambert(Rgb(0, 0, 0))};
  s.description.materials[0].alpha_mode = AlphaMode::blend;
  s.description.materials[0].base_alpha = 0.25f;
  add_mesh(s.description, quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0));
  s.description.environment = constant_environment({1, 2, 0.5f});
  s.radiance = V3d(1, 2, 0.5) * 0.75;
  s.eye = {1, 0.5, 3};
  s.target = {0, 0, 0};
  s.reach = 1;
  s.max_segments = 3;
  return s;
}

// Beer and Lambert: index 1 neither bends nor reflects, light keeps color^(length / attenuation_distance); 60 degrees
// make the way through twice the thickness.
ClosedFormScene absorbing_slab() {
  ClosedFormScene s;
  s.description.materials = {glass(1.0f)};
  s.description.materials[0].attenuation_color = Rgb(0.9f, 0.5f, 0.1f);
  s.description.materials[0].attenuation_distance = 2;
  add_mesh(s.description, box({-4, -4, -0.75f}, {4, 4, 0.75f}, 0));
  s.description.environment = constant_environment({1, 2, 0.5f});
  s.radiance = times({1, 2, 0.5}, {std::pow(0.9, 1.5), std::pow(0.5, 1.5), std::pow(0.1, 1.5)});
  s.eye = {6 * std::sqrt(3), 0, 6};
  s.target = {0, 0, 0};
  s.reach = 12 * kPoint;
  s.max_segments = 5;
  return s;
}

// Fresnel: an interface of index n reflects R = (r_s^2 + r_p^2) / 2. A slab whose inside keeps A of the light along one
// crossing lets (1 - R)^2 A (1 + R^2 A^2 + R^4 A^4 + ...) pass (Stokes 1862, "On the Intensity of the Light Reflected
// from or Transmitted through a Pile of Plates"). Seen against a lamp, in the dark.
ClosedFormScene glass_slab(double angle, const V3d& kept) {
  const double n = 1.5, thickness = 0.5;
  ClosedFormScene s;
  s.description.materials = {glass(float(n)), lamp(Rgb(5, 4, 3))};
  s.description.materials[0].attenuation_color = Rgb(kept);
  s.description.materials[0].attenuation_distance = 1;
  add_mesh(s.description, box({-4, -4, float(-thickness)}, {4, 4, 0}, 0));
  add_mesh(s.description, quad({-8, -8, -1}, {16, 0, 0}, {0, 16, 0}, 1));
  const double cos_i = std::cos(angle), sin_t = std::sin(angle) / n, cos_t = std::sqrt(1 - sin_t * sin_t);
  const double r_s = (cos_i - n * cos_t) / (cos_i + n * cos_t), r_p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
  const double reflected = (r_s * r_s + r_p * r_p) / 2;
  for (int c = 0; c < 3; ++c) {
    const double a = std::pow(kept[c], thickness / cos_t);
    s.radiance[c] = (1 - reflected) * (1 - reflected) * a / (1 - reflected * reflected * a * a);
  }
  s.radiance = times(s.radiance, {5, 4, 3});
  s.eye = V3d(std::sin(angle), 0, cos_i) * 8.0;
  s.target = {0, 0, 0};
  s.reach = 8 * kPoint;
  s.max_segments = 40;
  return s;
}
ClosedFormScene clear_slab() {
  return glass_slab(0, {1, 1, 1});
}
ClosedFormScene tinted_slab_at_an_angle() {
  return glass_slab(65 * kDegree, {0.9, 0.5, 0.2});
}

constexpr NamedScene kScenes[] = {
    {"WhiteFurnace", white_furnace},
    {"WhiteFurnaceOfInstances", white_furnace_of_instances},
    {"GreyFloorInFurnace", grey_floor_in_furnace},
    {"GreySphereInFurnace", grey_sphere_in_furnace},
    {"MirrorSphereInFurnace", mirror_sphere_in_furnace},
    {"GlassSphereInFurnace", glass_sphere_in_furnace},
    {"EmittingBox", emitting_box},
    {"MirrorBox", mirror_box},
    {"IntegratingSphere", integrating_sphere},
    {"LampInASphere", lamp_in_a_sphere},
    {"RectangleLight", rectangle_light},
    {"TriangleLight", triangle_light},
    {"SphereLight", sphere_light},
    {"SkyWithAGradient", sky_with_a_gradient},
    {"PointLight", point_light},
    {"SpotLight", spot_light},
    {"DirectionalLight", directional_light},
    {"TwoLights", two_lights},
    {"SixLights", six_lights},
    {"AlphaPane", alpha_pane},
    {"AbsorbingSlab", absorbing_slab},
    {"ClearSlab", clear_slab},
    {"TintedSlabAtAnAngle", tinted_slab_at_an_angle},
};

}  // namespace

std::span<const NamedScene> closed_form_scenes() {
  return kScenes;
}

void PrintTo(const NamedScene& scene, std::ostream* out) {
  *out << scene.name;
}

const char* to_string(CameraKind kind) {
  switch (kind) {
    case CameraKind::perspective:
      return "perspective";
    case CameraKind::orthographic:
      return "orthographic";
    case CameraKind::thin_lens:
      return "thin lens";
  }
  return "unknown";
}

CameraPose pose_of(const ClosedFormScene& scene, CameraKind kind) {
  const double distance = length(scene.target - scene.eye);
  CameraPose pose = camera_at(scene.eye, scene.target);
  pose.vertical_fov = 2 * std::atan(scene.reach / distance);
  pose.half_height = scene.reach;
  if (kind == CameraKind::orthographic) pose.projection = Projection::orthographic;
  if (kind == CameraKind::thin_lens) {
    pose.lens_radius = scene.reach / 3;
    pose.focus_distance = distance;
  }
  Problems problems;
  validate(pose, "camera", problems);
  EXPECT_TRUE(problems.empty()) << problems.to_error().to_string();
  return pose;
}

}  // namespace helio::test
