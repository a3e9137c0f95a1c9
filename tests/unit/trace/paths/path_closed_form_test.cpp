// Scenes whose radiance is known: the mean must lie within 0.5 % and within three standard errors of it (plus 1e-4 for
// float rounding, where the estimate has no variance at all).
#include <gtest/gtest.h>

#include <array>

#include "renderer/trace/scene/media.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

void expect_mean(const Film& film, const V3d& expected, const char* what) {
  const MeanEstimate e = mean_of(film);
  for (int c = 0; c < 3; ++c) {
    const double error = std::abs(e.mean[c] - expected[c]);
    EXPECT_LE(error, 0.005 * expected[c] + 1e-7)
        << what << " channel " << c << ": " << e.mean[c] << " for " << expected[c];
    EXPECT_LE(error, 3 * e.standard_error[c] + 1e-4 * expected[c]) << what << " channel " << c;
  }
}

Environment constant(float value) {
  Environment e;
  e.radiance = Rgb(value, value, value);
  return e;
}

// A closed box whose walls emit e and reflect a: n segments see e (1 + a + ... + a^(n-1)), everywhere.
TEST(PathClosedForm, EmittingBox) {
  for (int segments : {1, 2, 3, 6, 7}) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0.5f, 0.25f, 0.8f), Rgb(1, 2, 0.5f))};
    add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
    PathSettings settings;
    settings.max_segments = segments;
    settings.roulette = segments % 2 ? RouletteRule::root : RouletteRule::throughput;
    const Film film = render(*build(scene), camera_at({0.2, 0.1, 0.3}, {1, 0.4, 0.2}, 90), 16, 16, 256, settings);
    V3d expected(0, 0, 0), power(1, 2, 0.5);
    for (int i = 0; i < segments; ++i) {
      expected += power;
      power *= V3d(0.5, 0.25, 0.8);
    }
    expect_mean(film, expected, "emitting box");
  }
}

// A convex Lambert body under constant light L shows albedo x L.
TEST(PathClosedForm, LambertSphereInFurnace) {
  for (float albedo : {0.18f, 0.9f, 1.0f}) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(albedo, albedo, albedo))};
    add_sphere(scene, {0, 0, 0}, 1, 0);
    scene.environment = constant(2);
    const Film film = render(*build(scene), camera_at({0, 0, 3}, {0, 0, 0}, 10), 16, 16, 128);
    expect_mean(film, V3d(2 * albedo, 2 * albedo, 2 * albedo), "Lambert sphere");
  }
}

// Smooth glass neither absorbs nor emits: under constant light it cannot be seen. 40 segments leave less than 1e-3 out.
TEST(PathClosedForm, GlassIsInvisibleInFurnace) {
  for (bool sphere : {true, false}) {
    SceneDescription scene;
    scene.materials = {glass(1.5f)};
    if (sphere)
      add_sphere(scene, {0, 0, 0}, 1, 0);
    else
      add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0));
    scene.environment = constant(1);
    PathSettings settings;
    settings.max_segments = 60;
    settings.roulette_from = 60;
    const Film film = render(*build(scene), camera_at({2.5, 1.5, 3}, {0, 0, 0}, 40), 24, 24, 64, settings);
    expect_mean(film, V3d(1, 1, 1), sphere ? "glass sphere" : "glass box");
  }
}

// ior 1 does not bend or reflect: light crosses d units of the volume and keeps color^(d / attenuation_distance).
TEST(PathClosedForm, AbsorbingSlab) {
  SceneDescription scene;
  scene.materials = {glass(1.0f)};
  scene.materials[0].attenuation_color = Rgb(0.9f, 0.5f, 0.1f);
  scene.materials[0].attenuation_distance = 2;
  add_mesh(scene, box({-50, -50, -1.5f}, {50, 50, 1.5f}, 0));
  scene.environment = constant(1);
  CameraPose pose = camera_at({0, 0, 10}, {0, 0, 0});
  pose.projection = Projection::orthographic;
  pose.half_height = 1;
  const Film film = render(*build(scene), pose, 8, 8, 16);
  expect_mean(film, V3d(std::pow(0.9, 1.5), std::pow(0.5, 1.5), std::pow(0.1, 1.5)), "absorbing slab");
}

// The environment beyond two nested absorbing boxes: outer 1 unit, inner 1 unit, outer 1 unit on the axis.
TEST(PathClosedForm, NestedAbsorption) {
  SceneDescription scene;
  scene.materials = {glass(1.0f), glass(1.0f)};
  scene.materials[0].attenuation_color = Rgb(0.5f, 0.5f, 0.5f);
  scene.materials[0].attenuation_distance = 1;
  scene.materials[1].attenuation_color = Rgb(0.25f, 1, 0.9f);
  scene.materials[1].attenuation_distance = 1;
  add_mesh(scene, box({-9, -9, -1.5f}, {9, 9, 1.5f}, 0));
  add_mesh(scene, box({-5, -5, -0.5f}, {5, 5, 0.5f}, 1));
  scene.environment = constant(1);
  CameraPose pose = camera_at({0, 0, 10}, {0, 0, 0});
  pose.projection = Projection::orthographic;
  pose.half_height = 1;
  PathSettings settings;
  settings.roulette_from = 10;
  expect_mean(render(*build(scene), pose, 8, 8, 16, settings), V3d(0.25 * 0.25, 0.25 * 1, 0.25 * 0.9),
              "nested absorption");
}

// Boxes within each other, of their own material each: every one is 0.1 thick on either side of those within, and keeps
// (0.9 - 0.05 k, 1, 1) of the light per unit.
SceneDescription nested_boxes(int depth) {
  SceneDescription scene;
  for (int k = 0; k < depth; ++k) {
    scene.materials.push_back(glass(1.0f));
    scene.materials.back().attenuation_color = Rgb(0.9f - 0.05f * float(k), 1, 1);
    scene.materials.back().attenuation_distance = 0.1f;
    const float half = 0.1f * float(depth - k);
    add_mesh(scene, box({-9 + 0.1f * float(k), -9, -half}, {9 - 0.1f * float(k), 9, half}, k));
  }
  scene.environment = constant(1);
  return scene;
}

TEST(PathClosedForm, EightNestedMedia) {
  CameraPose pose = camera_at({0, 0, 10}, {0, 0, 0});
  pose.projection = Projection::orthographic;
  pose.half_height = 1;
  PathSettings settings;
  settings.max_segments = settings.roulette_from = 30;
  for (const int depth : {4, 5, 8, 9, 12}) {
    TraceStats stats;
    const Film film = render(*build(nested_boxes(depth)), pose, 8, 8, 1, settings, &stats);
    // Media within the eighth absorb as the eighth does.
    double red = 1;
    for (int k = 0; k < depth; ++k) red *= std::pow(double(0.9f - 0.05f * float(std::min(k, 7))), 2);
    // Starts of rays, off each surface, take a little of each way.
    EXPECT_NEAR(mean_of(film).mean[0], red, 0.003 * red) << depth;
    EXPECT_EQ(stats.media_overflows, stats.paths * std::uint64_t(std::max(0, depth - 8))) << depth;
  }
}

// A medium that is not known is left before one that is, though both are of one material.
TEST(PathClosedForm, LeavingAMediumBeyondTheDepthLeavesNoOther) {
  MediumStack media;
  for (std::uint32_t m = 0; m < 8; ++m) EXPECT_TRUE(media.cross(m, true));
  EXPECT_FALSE(media.cross(3, true));
  EXPECT_FALSE(media.cross(7, true));
  media.cross(7, false);
  media.cross(3, false);
  EXPECT_EQ(media.count, 8);
  media.cross(7, false);
  EXPECT_EQ(media.count, 7);
  EXPECT_EQ(media.material[6], 6);
  EXPECT_TRUE(media.cross(9, true));
}

// Punctual lights over a Lambert floor seen straight from above: albedo / pi x irradiance.
TEST(PathClosedForm, PunctualLights) {
  for (PunctualKind kind : {PunctualKind::point, PunctualKind::spot, PunctualKind::directional}) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
    add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
    PunctualLight light;
    light.kind = kind;
    light.position = {0, 3, 0};
    light.direction = {0, -1, 0};
    light.intensity = Rgb(4, 8, 2);
    scene.lights = {light};
    const Film film = render(*build(scene), camera_at({0, 2, 0}, {0, 0, 0}, 0.2), 8, 8, 16);
    const double irradiance = kind == PunctualKind::directional ? 1.0 : 1.0 / 9;
    expect_mean(film, V3d(4, 8, 2) * (irradiance * 0.5 / 3.14159265358979), "punctual light");
  }
}

// Half of the light behind a half-opaque black pane arrives; a mask below its cutoff is not there at all.
TEST(PathClosedForm, AlphaBlendAndMask) {
  for (AlphaMode mode : {AlphaMode::blend, AlphaMode::mask}) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0, 0, 0))};
    scene.materials[0].alpha_mode = mode;
    scene.materials[0].base_alpha = 0.25f;
    add_mesh(scene, quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0));
    scene.environment = constant(1);
    const Film film = render(*build(scene), camera_at({0, 0, 3}, {0, 0, 0}, 30), 16, 16, 256);
    const double expected = mode == AlphaMode::blend ? 0.75 : 1;
    expect_mean(film, V3d(expected, expected, expected), "alpha");
  }
}

// A shadow ray meets the same pane: a point light behind alpha 0.25 keeps 0.75 of its light.
TEST(PathClosedForm, AlphaShadow) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0, 0, 0))};
  scene.materials[1].alpha_mode = AlphaMode::blend;
  scene.materials[1].base_alpha = 0.25f;
  add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
  add_mesh(scene, quad({-5, 2.5f, 5}, {10, 0, 0}, {0, 0, -10}, 1));
  PunctualLight light;
  light.position = {0, 3, 0};
  light.intensity = Rgb(1, 1, 1);
  scene.lights = {light};
  const Film film = render(*build(scene), camera_at({0, 2, 0}, {0, 0, 0}, 0.2), 16, 16, 512);
  const double expected = 0.75 / 9 * 0.5 / 3.14159265358979;
  expect_mean(film, V3d(expected, expected, expected), "alpha shadow");
}

// A single-sided emitter is black from behind; mirrored and instanced ones keep their front.
TEST(PathClosedForm, EmissionLeavesTheFront) {
  for (bool instanced : {false, true}) {
    for (bool mirrored : {false, true}) {
      for (bool from_front : {true, false}) {
        SceneDescription scene;
        scene.materials = {lambert(Rgb(0, 0, 0), Rgb(3, 2, 1))};
        scene.materials[0].double_sided = false;
        Object object;
        object.meshes.push_back(quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0));
        const int index = add_object(scene, object);
        M44d m;
        if (mirrored) m[0][0] = -1;
        add_instance(scene, index, m);
        if (instanced) {
          M44d away = m;
          away[3][2] = -1000;
          add_instance(scene, index, away);
        }
        const auto built = build(scene);
        const Film film = render(*built, camera_at({0, 0, from_front ? 3.0 : -3.0}, {0, 0, 0}, 20), 8, 8, 4);
        expect_mean(film, from_front ? V3d(3, 2, 1) : V3d(0, 0, 0), "one-sided emitter");
      }
    }
  }
}

// Next-event estimation and BSDF sampling must agree however near the light is: a floor 0.02 under a large lamp sees it
// fill the hemisphere, so that the floor shows albedo x emission (the lamp overhangs by 250 times the gap).
TEST(PathClosedForm, FloorJustUnderALamp) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0, 0, 0), Rgb(2, 2, 2))};
  scene.materials[1].double_sided = false;
  add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
  add_mesh(scene, quad({-5, 0.02f, -5}, {10, 0, 0}, {0, 0, 10}, 1));
  PathSettings settings;
  settings.max_segments = 2;
  const Film film = render(*build(scene), camera_at({0, 0.01, 0}, {0.01, 0, 0}, 20), 16, 16, 256, settings);
  expect_mean(film, V3d(1, 1, 1), "floor under a lamp");
}

Image image_of(int width, int height, const std::vector<std::array<std::uint8_t, 4>>& texels) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = 4;
  for (const auto& texel : texels) image.texels.insert(image.texels.end(), texel.begin(), texel.end());
  return image;
}

// The floor of FloorJustUnderALamp under a lamp of emission 2 made of `lamp`: the floor shows the lamp's mean coverage.
Film floor_under_lamp(const Material& lamp, TriangleMesh mesh, std::vector<Image> images = {}) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lamp};
  scene.materials[1].emission = Rgb(2, 2, 2);
  scene.materials[1].base_color = Rgb(0, 0, 0);
  scene.materials[1].double_sided = false;
  scene.images = std::move(images);
  add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
  add_mesh(scene, std::move(mesh));
  PathSettings settings;
  settings.max_segments = 2;
  return render(*build(scene), camera_at({0, 0.01, 0}, {0, 0, 0}, 20), 16, 16, 256, settings);
}

TriangleMesh lamp_quad() {
  return quad({-5, 0.02f, -5}, {10, 0, 0}, {0, 0, 10}, 1);
}

// A lamp of alpha a lights with a times what the opaque one gives, whichever technique finds it; a mask with all or
// nothing.
TEST(PathClosedForm, AlphaOfALampDimsItsLight) {
  const auto lamp = [](AlphaMode mode, float alpha, float cutoff = 0.5f) {
    Material m = lambert(Rgb(0, 0, 0));
    m.alpha_mode = mode;
    m.base_alpha = alpha;
    m.alpha_cutoff = cutoff;
    return m;
  };
  expect_mean(floor_under_lamp(lamp(AlphaMode::blend, 0.25f), lamp_quad()), V3d(0.25, 0.25, 0.25), "blend");
  expect_mean(floor_under_lamp(lamp(AlphaMode::blend, 0), lamp_quad()), V3d(0, 0, 0), "transparent blend");
  expect_mean(floor_under_lamp(lamp(AlphaMode::mask, 0.4f), lamp_quad()), V3d(0, 0, 0), "mask below its cutoff");
  expect_mean(floor_under_lamp(lamp(AlphaMode::mask, 0.6f), lamp_quad()), V3d(1, 1, 1), "mask above its cutoff");
  expect_mean(floor_under_lamp(lamp(AlphaMode::mask, 1, 1.5f), lamp_quad()), V3d(0, 0, 0), "cutoff above 1");
  // Alpha over vertices: 0.2 to 0.8 across the lamp, 0.5 in its middle.
  TriangleMesh faded = lamp_quad();
  faded.colors = {V4f(1, 1, 1, 0.2f), V4f(1, 1, 1, 0.8f), V4f(1, 1, 1, 0.8f), V4f(1, 1, 1, 0.2f)};
  expect_mean(floor_under_lamp(lamp(AlphaMode::blend, 1), faded), V3d(0.5, 0.5, 0.5), "vertex alpha");
  // Alpha in a texture: stripes of alpha 1 and 0.2, so fine that the floor sees their mean; a mask keeps one of each
  // two.
  for (const AlphaMode mode : {AlphaMode::blend, AlphaMode::mask}) {
    Material striped = lamp(mode, 1);
    striped.base_color_texture.image = 0;
    striped.base_color_texture.filter = FilterMode::nearest;
    striped.base_color_texture.uv_transform = {5000, 0, 0, 0, 5000, 0};
    const Film film =
        floor_under_lamp(striped, lamp_quad(), {image_of(2, 1, {{255, 255, 255, 255}, {255, 255, 255, 51}})});
    const double expected = mode == AlphaMode::blend ? 0.6 : 0.5;
    expect_mean(film, V3d(expected, expected, expected), "alpha in a texture");
  }
}

// Radiance of a floor of albedo 0.5 at the origin, seen from above, in the light of the spheres of `object` placed by
// `placements`; material 1 is the lamp.
Film floor_under_spheres(const Object& object, const std::vector<M44d>& placements, const Material& lamp,
                         std::vector<Image> images = {}) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lamp};
  scene.images = std::move(images);
  add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
  const int index = add_object(scene, object);
  for (const M44d& placement : placements) add_instance(scene, index, placement);
  PathSettings settings;
  settings.max_segments = 2;
  return render(*build(scene), camera_at({0, 0.5, 0}, {0, 0, 0}, 0.1), 8, 8, 64, settings);
}

Material lamp_material(float alpha = 1) {
  Material m = lambert(Rgb(0, 0, 0), Rgb(4, 4, 4));
  m.double_sided = false;
  if (alpha < 1) m.alpha_mode = AlphaMode::blend;
  m.base_alpha = alpha;
  return m;
}

// Rows: images of the axes, translation.
M44d placement(const V3d& x, const V3d& y, const V3d& z, const V3d& translation) {
  return {x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, translation.x, translation.y, translation.z, 1};
}

// The same lamp as a sphere of its own, placed twice (the other time out of sight below the floor), and as a sphere
// under a scale that is not uniform: albedo x emission x (r / d)^2, and for a spheroid of radii a, a, c at distance d
// on its axis albedo x emission x a^2 / (a^2 + d^2 - c^2). Not one of the 64 samples may go astray.
TEST(PathClosedForm, SpheresLightHoweverTheyArePlaced) {
  Object sphere;
  sphere.spheres.push_back({{0, 0, 0}, 0.5f, 1});
  const M44d at = placement({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 2, 0});
  const M44d below = placement({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -2, 0});
  const double plain = 0.5 * 4 * sqr(0.5 / 2);
  for (const float alpha : {1.0f, 0.25f}) {
    const V3d expected = V3d(1, 1, 1) * (plain * alpha);
    expect_mean(floor_under_spheres(sphere, {at}, lamp_material(alpha)), expected, "sphere");
    expect_mean(floor_under_spheres(sphere, {at, below}, lamp_material(alpha)), expected, "sphere placed twice");
    // Turned, grown by 2 and mirrored; the sphere itself half as large.
    Object half;
    half.spheres.push_back({{0, 0, 0}, 0.25f, 1});
    const M44d turned = placement({1.2, 1.6, 0}, {-1.6, 1.2, 0}, {0, 0, -2}, {0, 2, 0});
    expect_mean(floor_under_spheres(half, {turned, below}, lamp_material(alpha)), expected, "turned sphere");
    for (const double c : {0.1, 1.2}) {
      const double a = 0.3, d = 2;
      const M44d stretched =
          placement({0.6 * 2 * a, 0, 0.8 * 2 * a}, {0, 2 * c, 0}, {-0.8 * 2 * a, 0, 0.6 * 2 * a}, {0, d, 0});
      expect_mean(floor_under_spheres(sphere, {stretched}, lamp_material(alpha)),
                  V3d(1, 1, 1) * (0.5 * 4 * alpha * a * a / (a * a + d * d - c * c)), "spheroid");
    }
  }
}

// Emission and alpha of a sphere follow its texture: bright above and black below (the texture's rows go from +y to -y)
// light no floor; upside down they do, however the sphere is placed.
TEST(PathClosedForm, SpheresAreTexturedAsLights) {
  Object sphere;
  sphere.spheres.push_back({{0, 0, 0}, 0.5f, 1});
  const M44d upright = placement({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 2, 0});
  const M44d turned = placement({1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {0, 2, 0});
  const M44d flattened = placement({1, 0, 0}, {0, -1, 0}, {0, 0, -1.0001}, {0, 2, 0});
  const std::vector<Image> images = {image_of(1, 2, {{255, 255, 255, 255}, {0, 0, 0, 0}})};
  for (const bool alpha : {false, true}) {
    Material lamp = lamp_material();
    TextureSlot& slot = alpha ? lamp.base_color_texture : lamp.emission_texture;
    slot.image = 0;
    slot.filter = FilterMode::nearest;
    if (alpha) lamp.alpha_mode = AlphaMode::mask;
    const double lit = 0.5 * 4 * sqr(0.5 / 2);
    expect_mean(floor_under_spheres(sphere, {upright}, lamp, images), V3d(0, 0, 0), "dark below");
    expect_mean(floor_under_spheres(sphere, {turned}, lamp, images), V3d(lit, lit, lit), "bright below");
    expect_mean(floor_under_spheres(sphere, {flattened}, lamp, images), V3d(lit, lit, lit), "flattened, bright below");
  }
}

// A ray through a sphere of alpha a meets two surfaces: (1 - a)^2 of what is behind remains.
TEST(PathClosedForm, AlphaOfASphereIsMetTwice) {
  for (const bool instanced : {false, true}) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0, 0, 0))};
    scene.materials[0].alpha_mode = AlphaMode::blend;
    scene.materials[0].base_alpha = 0.4f;
    Object sphere;
    sphere.spheres.push_back({{0, 0, 0}, 1, 0});
    const int index = add_object(scene, sphere);
    add_instance(scene, index);
    if (instanced) add_instance(scene, index, placement({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 50, 0}));
    scene.environment = constant(1);
    const Film film = render(*build(scene), camera_at({0, 0, 3}, {0, 0, 0}, 10), 16, 16, 1024);
    expect_mean(film, V3d(0.36, 0.36, 0.36), "blended sphere");
  }
}

// A mirror of albedo 1 cannot be seen in a furnace, whatever its normals: the box's corner normals lean up to 55
// degrees from its faces, so that grazing views mirror into the box.
TEST(PathClosedForm, SmoothNormalsOfAMirrorLoseNoLight) {
  for (const bool instanced : {false, true}) {
    SceneDescription scene;
    scene.materials = {Material()};
    scene.materials[0].base_color = Rgb(1, 1, 1);
    scene.materials[0].metallic = 1;
    scene.materials[0].roughness = 0;
    Object object;
    object.meshes.push_back(box({-1, -1, -1}, {1, 1, 1}, 0));
    for (const V3f& p : object.meshes[0].positions) object.meshes[0].normals.push_back(normalize(p));
    const int index = add_object(scene, object);
    add_instance(scene, index);
    if (instanced) add_instance(scene, index, placement({1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 40, 0}));
    scene.environment = constant(1);
    const Film film = render(*build(scene), camera_at({3, 1.3, 2}, {0, 0, 0}, 45), 32, 32, 16);
    expect_mean(film, V3d(1, 1, 1), "mirror box");
  }
}

// A scene moved by ten million units through its node shows the same picture.
TEST(PathClosedForm, FarFromTheOrigin) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.25f, 0.8f), Rgb(1, 1, 1))};
  M44d m;
  m[3][0] = 1e7;
  m[3][1] = -1e7;
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true), m);
  PathSettings settings;
  settings.max_segments = 3;
  const Film film = render(*build(scene), camera_at({1e7 + 0.2, -1e7 + 0.1, 0.3}, {1e7 + 1, -1e7 + 0.4, 0.2}, 90), 16,
                           16, 256, settings);
  expect_mean(film, V3d(1.75, 1 + 0.25 + 0.0625, 1 + 0.8 + 0.64), "far box");
}

TEST(PathClosedForm, UnlitShowsItsColourAndReflectsNothing) {
  SceneDescription scene;
  scene.materials = {Material()};
  scene.materials[0].model = MaterialModel::unlit;
  scene.materials[0].base_color = Rgb(0.25f, 0.5f, 0.75f);
  scene.materials[0].double_sided = true;
  add_mesh(scene, quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0));
  scene.environment = constant(5);
  expect_mean(render(*build(scene), camera_at({0, 0, 3}, {0, 0, 0}, 30), 8, 8, 4), V3d(0.25, 0.5, 0.75), "unlit");
}

}  // namespace
}  // namespace helio::test
