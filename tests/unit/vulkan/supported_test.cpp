// What a scene needs of shaders: what they have not is named, and what they have told apart. Needs no device.
#include <gtest/gtest.h>

#include "renderer/vulkan/scene/material_tables.h"
#include "renderer/vulkan/scene/supported.h"
#include "tests/support/test_scenes.h"

namespace helio {
namespace {

using test::lambert;

std::vector<std::string> unsupported_of(std::vector<Material> materials, const std::vector<int>& used) {
  SceneDescription scene;
  scene.materials = std::move(materials);
  for (const int material : used) test::add_sphere(scene, V3f(float(3 * material), 0, 0), 1, material);
  const auto built = test::build(std::move(scene));
  return built ? vulkan::unsupported(*built) : std::vector<std::string>{"not built"};
}

Material blend_of(int first, int second) {
  Material blend;
  blend.name = "mixture";
  blend.model = MaterialModel::blend;
  blend.blend.first = first;
  blend.blend.second = second;
  return blend;
}

using Names = std::vector<std::string>;

TEST(VulkanSupported, KnowsEveryModelButLayers) {
  const MaterialModel models[] = {MaterialModel::metallic_roughness,
                                  MaterialModel::specular_glossiness,
                                  MaterialModel::unlit,
                                  MaterialModel::conductor,
                                  MaterialModel::plastic,
                                  MaterialModel::pane,
                                  MaterialModel::principled};
  std::vector<Material> materials;
  std::vector<int> used;
  for (const MaterialModel model : models) {
    used.push_back(int(materials.size()));
    materials.emplace_back().model = model;
  }
  used.push_back(int(materials.size()));
  materials.push_back(blend_of(0, 3));
  EXPECT_EQ(unsupported_of(materials, used), Names());
}

TEST(VulkanSupported, NamesLayersWithTheirMaterial) {
  Material paint, cloth, foil, metal, leaf;
  paint.name = "paint";
  paint.layers.clearcoat = 1;
  cloth.name = "cloth";
  cloth.layers.sheen_color = Rgb(0, 0.5f, 0);
  foil.layers.iridescence = 0.5f;
  metal.name = "metal";
  metal.layers.anisotropy = 0.3f;
  metal.layers.clearcoat = 0.1f;
  leaf.name = "leaf";
  leaf.layers.diffuse_transmission = 0.2f;
  EXPECT_EQ(unsupported_of({paint, cloth, foil, metal, leaf}, {0, 1, 2, 3, 4}),
            (Names{"material 'paint': clearcoat", "material 'cloth': sheen", "material 2: iridescence",
                   "material 'metal': clearcoat, anisotropy", "material 'leaf': diffuse transmission"}));
}

TEST(VulkanSupported, LooksIntoBlendsAndPastUnusedMaterials) {
  Material paint;
  paint.name = "paint";
  paint.layers.clearcoat = 1;
  EXPECT_EQ(unsupported_of({lambert(Rgb(0.5f)), paint}, {0}), Names());
  EXPECT_EQ(unsupported_of({lambert(Rgb(0.5f)), paint, blend_of(0, 1)}, {2}), Names{"material 'paint': clearcoat"});
}

TEST(VulkanSupported, RefusesBlendsWithinBlends) {
  const std::vector<Material> materials{lambert(Rgb(0.5f)), lambert(Rgb(0.2f)), blend_of(0, 1), blend_of(0, 2)};
  EXPECT_EQ(unsupported_of(materials, {2}), Names());
  EXPECT_EQ(unsupported_of(materials, {3}), Names{"material 'mixture': a blend within a blend"});
}

TEST(VulkanSupported, RefusesMipMappedTextures) {
  SceneDescription scene;
  Image image;
  image.width = image.height = 2;
  image.channels = 3;
  image.texels.assign(12, 128);
  scene.images.push_back(image);
  scene.materials.push_back(lambert(Rgb(0.5f)));
  scene.materials[0].base_color_texture.image = 0;
  test::add_mesh(scene, test::quad(V3f(0), V3f(1, 0, 0), V3f(0, 1, 0), 0));
  const auto plain = test::build(scene);
  const auto mip_mapped = test::build(scene, {.texture_filter = TextureFilter::mip});
  ASSERT_TRUE(plain && mip_mapped);
  EXPECT_EQ(vulkan::unsupported(*plain), Names());
  EXPECT_EQ(vulkan::unsupported(*mip_mapped), Names{"mip-mapped textures"});
}

std::uint32_t features_of(std::vector<Material> materials, const std::vector<int>& used) {
  SceneDescription scene;
  scene.materials = std::move(materials);
  for (const int material : used) test::add_sphere(scene, V3f(float(3 * material), 0, 0), 1, material);
  const auto built = test::build(std::move(scene));
  return built ? vulkan::material_features(built->impl()) : 0;
}

TEST(VulkanFeatures, AreThoseOfUsedMaterials) {
  Material metal, clear, rough;
  metal.model = MaterialModel::conductor;
  metal.roughness_across = 0.2f;
  clear = test::glass(1.5f);
  rough.model = MaterialModel::conductor;
  rough.distribution = MicrofacetDistribution::beckmann;
  const std::vector<Material> materials{lambert(Rgb(0.5f)), metal, clear, rough, blend_of(0, 2)};
  const std::uint32_t diffuse = 1u << vulkan::kLobeLambert, conductor = 1u << vulkan::kLobeConductor;
  const std::uint32_t glass = 1u << vulkan::kLobeMetallicRoughness | vulkan::kFeatureTransmission;
  EXPECT_EQ(features_of(materials, {0}), diffuse);
  EXPECT_EQ(features_of(materials, {1}), conductor | vulkan::kFeatureAnisotropy);
  EXPECT_EQ(features_of(materials, {2}), glass);
  EXPECT_EQ(features_of(materials, {3}), conductor | vulkan::kFeatureBeckmann);
  EXPECT_EQ(features_of(materials, {4}), diffuse | glass | 1u << vulkan::kLobeBlend);
}

TEST(VulkanFeatures, KnowMapsAndVertexColours) {
  SceneDescription scene;
  Image image;
  image.width = image.height = 1;
  image.channels = 3;
  image.texels.assign(3, 128);
  scene.images.push_back(image);
  scene.materials.assign(1, lambert(Rgb(0.5f)));
  test::add_mesh(scene, test::quad(V3f(0), V3f(1, 0, 0), V3f(0, 1, 0), 0));
  const auto features = [&](const auto& change) {
    SceneDescription changed = scene;
    change(changed);
    const auto built = test::build(std::move(changed));
    return built ? vulkan::material_features(built->impl()) & ~(1u << vulkan::kLobeLambert) : ~0u;
  };
  EXPECT_EQ(features([](SceneDescription&) {}), 0u);
  EXPECT_EQ(features([](SceneDescription& s) { s.materials[0].base_color_texture.image = 0; }),
            vulkan::kFeatureTextures);
  EXPECT_EQ(features([](SceneDescription& s) { s.materials[0].normal_texture.image = 0; }), vulkan::kFeatureNormalMaps);
  EXPECT_EQ(features([](SceneDescription& s) {
              s.materials[0].normal_texture.image = 0;
              s.materials[0].map_rule = MapRule::own_frame;
            }),
            vulkan::kFeatureScatterMaps);
  EXPECT_EQ(features([](SceneDescription& s) {
              s.materials[0].emission = Rgb(1);
              s.materials[0].emission_texture.image = 0;
            }),
            vulkan::kFeatureEmissionMaps);
  EXPECT_EQ(features([](SceneDescription& s) { s.objects[0].meshes[0].colors.assign(4, V4f(1, 1, 1, 1)); }),
            vulkan::kFeatureTextures | vulkan::kFeatureEmissionMaps);
}

}  // namespace
}  // namespace helio
