// Each feature bit is set by the material, geometry or light that needs it, and by nothing else.
#include <gtest/gtest.h>

#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/load/scene_features.h"

namespace helio {
namespace {

// A Lambert material: no specular reflection, no metal, no transmission.
Material lambert() {
  Material m;
  m.metallic = 0;
  m.specular = 0;
  return m;
}

// One flat triangle with the given material.
SceneDescription scene_of(Material material) {
  SceneDescription scene;
  scene.materials.push_back(std::move(material));
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.indices = {0, 1, 2};
  Object object;
  object.meshes.push_back(mesh);
  scene.objects.push_back(object);
  scene.instances.push_back({"i", 0, M44d()});
  return scene;
}

using Names = std::vector<std::string>;

TEST(SceneFeatures, LambertAloneNeedsNothingElse) {
  const SceneFeatures f = find_scene_features(scene_of(lambert()));
  EXPECT_EQ(f.names(), Names{"only_lambert"});
  EXPECT_EQ(f.light_count, 0u);
}

TEST(SceneFeatures, MaterialsSetTheirBits) {
  Material m;
  m.metallic = 1;
  m.roughness = 0.8f;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), Names{"microfacet"});
  m.roughness = 0.3f;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"microfacet", "caustics"}));
  m.roughness = 0;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"delta_lobes", "microfacet", "caustics"}));
  m.metallic = 0;
  m.transmission = 1;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"delta_lobes", "microfacet", "caustics"}));
  m.roughness = 0.4f;
  m.thickness = 1;
  m.attenuation_color = Rgb(0.5f, 1, 1);
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"rough_transmission", "microfacet", "caustics"}));
  m.attenuation_distance = 2;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(),
            (Names{"rough_transmission", "microfacet", "absorption", "caustics"}));

  Material conductor;
  conductor.model = MaterialModel::conductor;
  conductor.roughness = 0.9f;
  EXPECT_EQ(find_scene_features(scene_of(conductor)).names(), Names{"microfacet"});

  Material glossy;
  glossy.model = MaterialModel::specular_glossiness;
  glossy.glossiness = 0.2f;
  EXPECT_EQ(find_scene_features(scene_of(glossy)).names(), Names{"microfacet"});

  Material unlit;
  unlit.model = MaterialModel::unlit;
  EXPECT_EQ(find_scene_features(scene_of(unlit)).names(), Names{});
}

TEST(SceneFeatures, LayersSetTheirBits) {
  Material m = lambert();
  m.layers.clearcoat_roughness = 1;  // of a coat that is not there
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), Names{"only_lambert"});
  m.roughness = 1;
  m.layers.sheen_color = Rgb(0.1f, 0, 0);
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"microfacet", "layers"}));
  m.layers.clearcoat = 0.5f;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"microfacet", "layers"}));
  m.layers.clearcoat_roughness = 0.4f;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"microfacet", "layers", "caustics"}));
  m.layers.clearcoat_roughness = 0;
  EXPECT_EQ(find_scene_features(scene_of(m)).names(), (Names{"delta_lobes", "microfacet", "layers", "caustics"}));
  // Light that gets in diffusely is absorbed on its way.
  Material wax;
  wax.metallic = 0;
  wax.roughness = 1;
  wax.thickness = 1;
  wax.attenuation_distance = 1;
  wax.attenuation_color = Rgb(0.5f, 0.5f, 0.5f);
  EXPECT_EQ(find_scene_features(scene_of(wax)).names(), Names{"microfacet"});
  wax.layers.diffuse_transmission = 1;
  EXPECT_EQ(find_scene_features(scene_of(wax)).names(), (Names{"microfacet", "absorption", "layers"}));
}

TEST(SceneFeatures, ARoughnessTextureMayBeAMirror) {
  Material m;
  m.metallic = 1;
  m.roughness = 1;
  m.metallic_roughness_texture.image = 0;
  SceneDescription scene = scene_of(m);
  Image image;
  image.width = image.height = 1;
  image.channels = 3;
  image.texels = {0, 0, 0};
  scene.images.push_back(image);
  EXPECT_EQ(find_scene_features(scene).names(), (Names{"delta_lobes", "microfacet", "textures", "caustics"}));
}

TEST(SceneFeatures, TexturesNormalMapsAndAlpha) {
  Material m = lambert();
  m.alpha_mode = AlphaMode::mask;
  m.base_color_texture.image = 0;
  m.normal_texture.image = 0;
  SceneDescription scene = scene_of(m);
  Image image;
  image.width = image.height = 1;
  image.channels = 4;
  image.texels = {255, 255, 255, 255};
  scene.images.push_back(image);
  EXPECT_EQ(find_scene_features(scene).names(), (Names{"only_lambert", "textures", "normal_maps"}));
  scene.images[0].texels[3] = 254;
  EXPECT_TRUE(find_scene_features(scene).alpha);
  scene.materials[0].alpha_mode = AlphaMode::opaque;
  EXPECT_FALSE(find_scene_features(scene).alpha);

  SceneDescription faded = scene_of(lambert());
  faded.materials[0].alpha_mode = AlphaMode::blend;
  EXPECT_FALSE(find_scene_features(faded).alpha);
  faded.objects[0].meshes[0].colors.assign(3, V4f(1, 1, 1, 0.5f));
  EXPECT_EQ(find_scene_features(faded).names(), (Names{"only_lambert", "vertex_colors", "alpha"}));
  faded.objects[0].meshes[0].colors.clear();
  faded.materials[0].base_alpha = 0.5f;
  EXPECT_TRUE(find_scene_features(faded).alpha);
}

TEST(SceneFeatures, Geometry) {
  SceneDescription scene = scene_of(lambert());
  scene.objects[0].meshes[0].normals.assign(3, V3f(0, 0, 1));
  scene.objects[0].spheres.push_back({});
  scene.instances.push_back({"again", 0, M44d()});
  EXPECT_EQ(find_scene_features(scene).names(), (Names{"only_lambert", "instances", "spheres", "smooth_normals"}));
}

TEST(SceneFeatures, WhatNoInstanceUsesDoesNotCount) {
  SceneDescription scene = scene_of(lambert());
  Material glass;
  glass.transmission = 1;
  glass.roughness = 0;
  scene.materials.push_back(glass);
  Object unused = scene.objects[0];
  unused.meshes[0].material = 1;
  scene.objects.push_back(unused);
  EXPECT_EQ(find_scene_features(scene).names(), Names{"only_lambert"});
}

TEST(SceneFeatures, LightsAreCountedOverInstances) {
  Material m = lambert();
  m.emission = Rgb(1, 0, 0);
  SceneDescription scene = scene_of(m);
  scene.objects[0].spheres.push_back({});
  scene.instances.push_back({"again", 0, M44d()});
  EXPECT_EQ(find_scene_features(scene).light_count, 4u);  // two triangles, two spheres
  EXPECT_TRUE(find_scene_features(scene).area_lights);

  scene.lights.push_back({});
  scene.environment = Environment{};
  const SceneFeatures f = find_scene_features(scene);
  EXPECT_EQ(f.light_count, 6u);
  EXPECT_TRUE(f.delta_lights && f.environment && !f.textured_emission);

  scene.environment->radiance = Rgb(0, 0, 0);
  EXPECT_EQ(find_scene_features(scene).light_count, 5u);
  EXPECT_FALSE(find_scene_features(scene).environment);

  SceneDescription lamps = scene_of(lambert());
  lamps.lights.resize(kLightTreeThreshold - 1);
  EXPECT_FALSE(find_scene_features(lamps).light_tree);
  lamps.lights.emplace_back();
  EXPECT_TRUE(find_scene_features(lamps).light_tree);
}

}  // namespace
}  // namespace helio
