// Materials, their extensions, textures and samplers; extras.heliograph.
#include <cmath>
#include <numbers>

#include "renderer/scene/images/texture.h"
#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

// A 1 x 1 PNG of magenta.
constexpr const char* kPixel =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z/"
    "AfAAQAAf8iCjrwAAAAAElFTkSuQmCC";

// The material of a triangle with texture coordinates; `images` pixels are there to be named.
struct Loaded {
  SceneDescription scene;
  Material material;
};

GltfBuilder with_material(json material, const std::vector<const char*>& extensions = {}) {
  GltfBuilder file;
  file.add_triangle();
  json& primitive = file.root["meshes"][0]["primitives"][0];
  for (int k = 0; k < 2; ++k)
    primitive["attributes"]["TEXCOORD_" + std::to_string(k)] = file.add_accessor<float>(std::vector<float>(6), "VEC2");
  primitive["material"] = 0;
  file.root["materials"] = json::array({std::move(material)});
  for (const char* name : extensions) file.use(name);
  return file;
}

void add_texture(GltfBuilder& file, json sampler = json()) {
  file.root["images"].push_back({{"uri", kPixel}});
  file.root["textures"].push_back({{"source", file.root["images"].size() - 1}});
  if (sampler.is_null()) return;
  file.root["samplers"].push_back(sampler);
  file.root["textures"].back()["sampler"] = file.root["samplers"].size() - 1;
}

Material load_material(json material, const std::vector<const char*>& extensions = {}) {
  const SceneDescription scene = with_material(std::move(material), extensions).must_load();
  return scene.materials.empty() ? Material{} : scene.materials[0];
}

TEST(GltfMaterial, Defaults) {
  const Material m = load_material(json::object());
  EXPECT_EQ(m.model, MaterialModel::metallic_roughness);
  EXPECT_EQ(m.base_color, Rgb(1));
  EXPECT_EQ(m.metallic, 1);
  EXPECT_EQ(m.roughness, 1);
  EXPECT_EQ(m.ior, 1.5f);
  EXPECT_EQ(m.alpha_mode, AlphaMode::opaque);
  EXPECT_FALSE(m.double_sided);
  EXPECT_TRUE(is_black(m.emission));
}

TEST(GltfMaterial, PrimitivesWithoutOneUseADefaultAppendedLast) {
  GltfBuilder file = with_material({{"name", "red"}});
  file.add_mesh({{"attributes", {{"POSITION", 0}}}});
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(scene.objects[0].meshes[0].material, 0);
  EXPECT_EQ(scene.objects[1].meshes[0].material, 1);
}

TEST(GltfMaterial, Core) {
  const Material m = load_material(json::parse(R"({
    "name": "m", "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5,
    "roughnessFactor": 0.6}, "emissiveFactor": [0.5, 0.25, 1], "alphaMode": "MASK", "alphaCutoff": 0.7,
    "doubleSided": true})"));
  EXPECT_EQ(m.name, "m");
  EXPECT_EQ(m.base_color, Rgb(.1f, .2f, .3f));
  EXPECT_EQ(m.base_alpha, .4f);
  EXPECT_EQ(m.metallic, .5f);
  EXPECT_EQ(m.roughness, .6f);
  EXPECT_EQ(m.emission, Rgb(.5f, .25f, 1));
  EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
  EXPECT_EQ(m.alpha_cutoff, .7f);
  EXPECT_TRUE(m.double_sided);
  EXPECT_EQ(load_material({{"alphaMode", "BLEND"}}).alpha_mode, AlphaMode::blend);
}

TEST(GltfMaterial, Extensions) {
  const Material m = load_material(json::parse(R"({"emissiveFactor": [1, 0.5, 0], "extensions": {
      "KHR_materials_emissive_strength": {"emissiveStrength": 8},
      "KHR_materials_ior": {"ior": 1.33},
      "KHR_materials_transmission": {"transmissionFactor": 0.9},
      "KHR_materials_volume": {"thicknessFactor": 2, "attenuationDistance": 3, "attenuationColor": [0.5, 0.6, 0.7]},
      "KHR_materials_specular": {"specularFactor": 0.25, "specularColorFactor": [1, 2, 3]}}})"),
                                   {"KHR_materials_emissive_strength", "KHR_materials_ior",
                                    "KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_specular"});
  EXPECT_EQ(m.emission, Rgb(8, 4, 0));
  EXPECT_EQ(m.ior, 1.33f);
  EXPECT_EQ(m.transmission, .9f);
  EXPECT_EQ(m.thickness, 2);
  EXPECT_EQ(m.attenuation_distance, 3);
  EXPECT_EQ(m.attenuation_color, Rgb(.5f, .6f, .7f));
  EXPECT_EQ(m.specular, .25f);
  EXPECT_EQ(m.specular_color, Rgb(1, 2, 3));
}

TEST(GltfMaterial, Layers) {
  GltfBuilder file = with_material(json::parse(R"({"extensions": {
      "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 0},
        "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": {"index": 0}},
      "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3], "sheenColorTexture": {"index": 0},
        "sheenRoughnessFactor": 0.4, "sheenRoughnessTexture": {"index": 0, "texCoord": 1}},
      "KHR_materials_anisotropy": {"anisotropyStrength": 0.6, "anisotropyRotation": 7,
        "anisotropyTexture": {"index": 0}},
      "KHR_materials_iridescence": {"iridescenceFactor": 0.7, "iridescenceIor": 1.8, "iridescenceThicknessMinimum": 50,
        "iridescenceThicknessMaximum": 900, "iridescenceThicknessTexture": {"index": 0}},
      "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.8,
        "diffuseTransmissionTexture": {"index": 0}, "diffuseTransmissionColorFactor": [0.9, 0.8, 0.7],
        "diffuseTransmissionColorTexture": {"index": 0}}}})"),
                                   {"KHR_materials_clearcoat", "KHR_materials_sheen", "KHR_materials_anisotropy",
                                    "KHR_materials_iridescence", "KHR_materials_diffuse_transmission"});
  add_texture(file);
  const SceneDescription scene = file.must_load();
  EXPECT_TRUE(scene.report.warnings.empty());
  EXPECT_TRUE(scene.report.unread.empty());
  const MaterialLayers& m = scene.materials.at(0).layers;
  EXPECT_TRUE(m.any());
  EXPECT_EQ(m.clearcoat, .5f);
  EXPECT_EQ(m.clearcoat_roughness, .25f);
  EXPECT_TRUE(m.clearcoat_texture.present() && m.clearcoat_roughness_texture.present());
  EXPECT_FALSE(m.clearcoat_normal_texture.present());
  EXPECT_EQ(m.sheen_color, Rgb(.1f, .2f, .3f));
  EXPECT_EQ(m.sheen_roughness, .4f);
  EXPECT_EQ(m.sheen_color_texture.encoding, TexelEncoding::srgb);
  EXPECT_EQ(m.sheen_roughness_texture.encoding, TexelEncoding::linear);
  EXPECT_EQ(m.sheen_roughness_texture.texcoord, 1);
  EXPECT_EQ(m.anisotropy, .6f);
  EXPECT_NEAR(m.anisotropy_rotation, 7 - 2 * std::numbers::pi, 1e-6);  // a whole turn taken out
  EXPECT_EQ(m.anisotropy_texture.encoding, TexelEncoding::linear);
  EXPECT_EQ(m.iridescence, .7f);
  EXPECT_EQ(m.iridescence_ior, 1.8f);
  EXPECT_EQ(m.iridescence_thickness_min, 50);
  EXPECT_EQ(m.iridescence_thickness_max, 900);
  EXPECT_FALSE(m.iridescence_texture.present());
  EXPECT_EQ(m.diffuse_transmission, .8f);
  EXPECT_EQ(m.diffuse_transmission_color, Rgb(.9f, .8f, .7f));
  EXPECT_EQ(m.diffuse_transmission_texture.encoding, TexelEncoding::linear);
  EXPECT_EQ(m.diffuse_transmission_color_texture.encoding, TexelEncoding::srgb);
  EXPECT_FALSE(load_material(json::object()).layers.any());
}

TEST(GltfMaterial, LayerRangesAreChecked) {
  const auto error = [](const char* extension, json value) {
    return with_material({{"extensions", {{extension, std::move(value)}}}}, {extension}).must_fail();
  };
  EXPECT_TRUE(contains(error("KHR_materials_clearcoat", {{"clearcoatFactor", 1.5}}),
                       "KHR_materials_clearcoat/clearcoatFactor: is 1.5, allowed: 0 to 1"));
  EXPECT_TRUE(contains(error("KHR_materials_sheen", {{"sheenColorFactor", {0, 0, 2}}}), "sheenColorFactor/2: is 2"));
  EXPECT_TRUE(
      contains(error("KHR_materials_anisotropy", {{"anisotropyStrength", -0.1}}), "anisotropyStrength: is -0.1"));
  EXPECT_TRUE(contains(error("KHR_materials_iridescence", {{"iridescenceIor", 0.5}}), "allowed: at least 1"));
  EXPECT_TRUE(contains(error("KHR_materials_diffuse_transmission", {{"diffuseTransmissionFactor", 2}}),
                       "diffuseTransmissionFactor: is 2"));
}

TEST(GltfMaterial, DispersionIsNamedAsIgnored) {
  const SceneDescription scene =
      with_material(json::parse(R"({"extensions": {"KHR_materials_dispersion": {"dispersion": 0.3}}})"),
                    {"KHR_materials_dispersion"})
          .must_load();
  EXPECT_TRUE(contains(scene.report.warnings, "optional extension KHR_materials_dispersion is ignored"));
}

TEST(GltfMaterial, OtherModels) {
  EXPECT_EQ(load_material({{"extensions", {{"KHR_materials_unlit", json::object()}}}}, {"KHR_materials_unlit"}).model,
            MaterialModel::unlit);
  const Material sg = load_material(json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
    "extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.1, 0.2, 0.3, 0.4],
      "specularFactor": [0.5, 0.6, 0.7], "glossinessFactor": 0.8}}})"),
                                    {"KHR_materials_pbrSpecularGlossiness"});
  EXPECT_EQ(sg.model, MaterialModel::specular_glossiness);
  EXPECT_EQ(sg.base_color, Rgb(.1f, .2f, .3f));
  EXPECT_EQ(sg.base_alpha, .4f);
  EXPECT_EQ(sg.specular_glossiness_f0, Rgb(.5f, .6f, .7f));
  EXPECT_EQ(sg.glossiness, .8f);
}

TEST(GltfMaterial, VariantsUseTheDefault) {
  GltfBuilder file = with_material({{"name", "default"}}, {"KHR_materials_variants"});
  file.root["materials"].push_back({{"name", "other"}});
  file.root["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "v"}}};
  file.root["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
      {{"material", 1}, {"variants", {0}}}};
  const SceneDescription scene = file.must_load();
  EXPECT_EQ(scene.materials[std::size_t(scene.objects.at(0).meshes.at(0).material)].name, "default");
}

TEST(GltfMaterial, RangesAreChecked) {
  const auto error = [](json material, const std::vector<const char*>& extensions = {}) {
    return with_material(std::move(material), extensions).must_fail();
  };
  EXPECT_TRUE(contains(error({{"pbrMetallicRoughness", {{"roughnessFactor", 1.5}}}}),
                       "/materials/0/pbrMetallicRoughness/roughnessFactor: is 1.5, allowed: 0 to 1"));
  EXPECT_TRUE(contains(error({{"emissiveFactor", {0, -2, 0}}}),
                       "/materials/0/emissiveFactor/1: is -2, allowed: at least 0"));
  EXPECT_TRUE(contains(error({{"alphaMode", "SOLID"}}), "is \"SOLID\", allowed: OPAQUE, MASK, BLEND"));
  EXPECT_TRUE(contains(error({{"extensions", {{"KHR_materials_ior", {{"ior", 0.5}}}}}}, {"KHR_materials_ior"}),
                       "KHR_materials_ior/ior"));
  EXPECT_TRUE(
      contains(error({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}), "there are 0 textures"));
}

TEST(GltfMaterial, TexturesAndSamplers) {
  GltfBuilder file = with_material(json::parse(R"({
    "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1, "texCoord": 1}},
    "normalTexture": {"index": 1, "scale": 0.5}, "emissiveTexture": {"index": 0}})"));
  add_texture(file, {{"magFilter", 9728}, {"wrapS", 33071}, {"wrapT", 33648}});
  add_texture(file);
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.images.size(), 2u);
  const Material& m = scene.materials[0];
  EXPECT_EQ(m.base_color_texture.image, 0);
  EXPECT_EQ(m.base_color_texture.wrap_u, WrapMode::clamp);
  EXPECT_EQ(m.base_color_texture.wrap_v, WrapMode::mirror);
  EXPECT_EQ(m.base_color_texture.filter, FilterMode::nearest);
  // Colours are sRGB-encoded, everything else is linear.
  EXPECT_EQ(m.base_color_texture.encoding, TexelEncoding::srgb);
  EXPECT_EQ(m.emission_texture.encoding, TexelEncoding::srgb);
  EXPECT_EQ(m.metallic_roughness_texture.encoding, TexelEncoding::linear);
  EXPECT_EQ(m.metallic_roughness_texture.texcoord, 1);
  EXPECT_EQ(m.metallic_roughness_texture.wrap_u, WrapMode::repeat);
  EXPECT_EQ(m.metallic_roughness_texture.filter, FilterMode::bilinear);
  EXPECT_EQ(m.normal_texture.encoding, TexelEncoding::linear);
  EXPECT_EQ(m.normal_scale, .5f);
  EXPECT_FALSE(m.transmission_texture.present());
}

TEST(GltfMaterial, OnlyImagesInUseAreKept) {
  GltfBuilder file = with_material(json::parse(R"({"emissiveTexture": {"index": 1}, "emissiveFactor": [1, 1, 1]})"));
  add_texture(file);
  add_texture(file);
  file.root["materials"].push_back(json::parse(R"({"emissiveTexture": {"index": 0}})"));  // used by nothing
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_EQ(scene.materials[0].emission_texture.image, 0);
  EXPECT_FALSE(scene.materials[1].emission_texture.present());
}

TEST(GltfMaterial, TextureTransform) {
  // Rotation by 90 degrees, as KHR_texture_transform's example: the lower left quadrant, (0 0) to (0 1), (1 0) to
  // (0 .5), (0 1) to (.5 1).
  GltfBuilder file = with_material(json::parse(R"({"emissiveTexture": {"index": 0, "texCoord": 0, "extensions": {
      "KHR_texture_transform": {"offset": [0, 1], "rotation": 1.57079632679, "scale": [0.5, 0.5], "texCoord": 1}}}})"),
                                   {"KHR_texture_transform"});
  add_texture(file);
  const TextureSlot slot = file.must_load().materials.at(0).emission_texture;
  EXPECT_EQ(slot.texcoord, 1);
  EXPECT_LT((transform_uv(slot, {0, 0}) - V2f(0, 1)).length(), 1e-6);
  EXPECT_LT((transform_uv(slot, {1, 0}) - V2f(0, .5f)).length(), 1e-6);
  EXPECT_LT((transform_uv(slot, {0, 1}) - V2f(.5f, 1)).length(), 1e-6);
}

TEST(GltfMaterial, TextureCoordinatesMustExist) {
  GltfBuilder file = with_material(json::parse(R"({"emissiveTexture": {"index": 0, "texCoord": 2}})"));
  add_texture(file);
  EXPECT_TRUE(contains(file.must_fail(), "has a texture that needs TEXCOORD_2"));
  // A gap below the highest set is a warning.
  GltfBuilder gap = with_material(json::parse(R"({"emissiveTexture": {"index": 0}})"));
  add_texture(gap);
  gap.root["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  EXPECT_TRUE(contains(gap.must_load().report.warnings, "needs TEXCOORD_0"));
}

TEST(GltfMaterial, BrokenImagesAreRefusedByName) {
  GltfBuilder file = with_material(json::parse(R"({"emissiveTexture": {"index": 0}})"));
  add_texture(file);
  const auto with_image = [&](json image) {
    file.root["images"][0] = std::move(image);
    return file.must_fail();
  };
  EXPECT_TRUE(contains(with_image({{"uri", "none.png"}}), "/images/0/uri: none.png: the bundle has no such file"));
  EXPECT_TRUE(contains(with_image({{"uri", "data:image/png;base64,iVBORw0KGgo="}}), "/images/0"));
  EXPECT_TRUE(contains(with_image({{"uri", "data:image/png;base64,AAAA"}}), "/images/0: is neither PNG nor JPEG"));
  EXPECT_TRUE(contains(with_image({{"bufferView", 0}}), "/images/0: is neither PNG nor JPEG"));
}

TEST(GltfMaterial, TexturesOfUnknownImageExtensionsFallBack) {
  GltfBuilder file = with_material(json::parse(R"({"emissiveTexture": {"index": 0}})"), {"KHR_texture_basisu"});
  file.root["images"] = {{{"uri", "x.ktx2"}, {"mimeType", "image/ktx2"}}, {{"uri", kPixel}}};
  file.root["textures"] = {{{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}, {"source", 1}}};
  const auto fallback = file.load({}, {{"x.ktx2", {1, 2, 3}}});
  ASSERT_TRUE(fallback.ok()) << fallback.error().to_string();
  EXPECT_EQ(fallback->images.size(), 1u);
  file.root["textures"][0].erase("source");
  const auto none = file.load({}, {{"x.ktx2", {1, 2, 3}}});
  ASSERT_TRUE(none.ok()) << none.error().to_string();
  EXPECT_FALSE(none->materials[0].emission_texture.present());
  EXPECT_TRUE(contains(none->report.warnings, "KHR_texture_basisu"));
}

// ---- extras.heliograph ---------------------------------------------------------------------------------------------

TEST(GltfExtras, Material) {
  const Material m = load_material(json::parse(R"({"extras": {"heliograph": {
      "conductor": {"eta": [0.2, 0.9, 1.1], "k": [3.9, 2.4, 2.1]}, "distribution": "beckmann", "alpha": 0.25}}})"));
  EXPECT_EQ(m.model, MaterialModel::conductor);
  EXPECT_EQ(m.conductor_eta, Rgb(.2f, .9f, 1.1f));
  EXPECT_EQ(m.conductor_k, Rgb(3.9f, 2.4f, 2.1f));
  EXPECT_EQ(m.distribution, MicrofacetDistribution::beckmann);
  EXPECT_EQ(m.roughness, .5f);  // alpha = roughness^2
}

TEST(GltfExtras, SphereCameraAndEnvironment) {
  GltfBuilder file;
  file.add_triangle();
  file.root["materials"] = {{{"name", "glass"}}};
  file.add_node(json::parse(R"({"translation": [1, 2, 3], "extras": {"heliograph": {
      "sphere": {"radius": 0.5, "center": [0, 1, 0], "material": 0}}}})"));
  file.root["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1},
      "extras": {"heliograph": {"lens_radius": 0.01, "focus_distance": 4}}}])");
  file.add_node({{"camera", 0}});
  file.root["scenes"][0]["extras"]["heliograph"]["environment"] = {{"radiance", {1, 2, 3}},
                                                                   {"rotation", 1.5707963267948966}};
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.instances.size(), 2u);
  const Object& ball = scene.objects.at(std::size_t(scene.instances[1].object));
  ASSERT_EQ(ball.spheres.size(), 1u);
  EXPECT_EQ(ball.spheres[0].radius, .5f);
  EXPECT_EQ(ball.spheres[0].center, V3f(0, 1, 0));
  EXPECT_EQ(scene.materials[std::size_t(ball.spheres[0].material)].name, "glass");
  EXPECT_EQ(scene.cameras.at(0).lens_radius, .01);
  EXPECT_EQ(scene.cameras.at(0).focus_distance, 4);
  ASSERT_TRUE(scene.environment);
  EXPECT_EQ(scene.environment->radiance, Rgb(1, 2, 3));
  // A quarter turn about +y, right-handed: +z to +x.
  EXPECT_LT(length(V3d(0, 0, 1) * scene.environment->to_world - V3d(1, 0, 0)), 1e-12);
}

TEST(GltfExtras, LightsLeftAsTextAreNamed) {
  GltfBuilder file;
  file.add_triangle();
  file.root["asset"]["extras"]["mitsuba_emitters"] = {"<background> <rgb name='radiance' value='0.4' /> </background>"};
  const SceneDescription scene = file.must_load();
  EXPECT_TRUE(contains(scene.report.warnings, "/asset/extras/mitsuba_emitters: names lights"))
      << scene.report.warnings.size();
  file.root["asset"]["extras"] = {{"source", "room.xml"}};
  EXPECT_TRUE(file.must_load().report.warnings.empty());
  file.root["asset"]["extras"] = "mitsuba_emitters";  // extras may be anything
  EXPECT_TRUE(file.must_load().report.warnings.empty());
}

TEST(GltfExtras, EnvironmentImages) {
  GltfBuilder file;
  file.add_triangle();
  file.root["images"] = {{{"uri", kPixel}}};
  file.root["scenes"][0]["extras"]["heliograph"]["environment"] = {{"image", 0}};
  const SceneDescription scene = file.must_load();
  ASSERT_TRUE(scene.environment);
  EXPECT_EQ(scene.environment->image, 0);
  EXPECT_EQ(scene.images.size(), 1u);
  // An override wins, and the file's own image is not even decoded.
  SceneLoadOptions options;
  options.environment = "2,3,4";
  const SceneDescription replaced = file.must_load(options);
  EXPECT_EQ(replaced.environment->radiance, Rgb(2, 3, 4));
  EXPECT_TRUE(replaced.images.empty());
  file.root["scenes"][0]["extras"]["heliograph"]["environment"]["image"] = "sky.exr";
  EXPECT_TRUE(contains(file.must_fail(), "sky.exr"));
}

TEST(GltfExtras, UnknownKeysAreReportedAndForeignExtrasLeftAlone) {
  GltfBuilder file = with_material(json::parse(R"({"extras": {"heliograph": {"alhpa": 0.2}, "vendor": 1}})"));
  file.root["asset"]["extras"] = json::parse(R"({"source": "x.xml", "emitters": ["<background/>"]})");
  file.root["nodes"][0]["extras"] = "any value may stand here";
  EXPECT_EQ(file.must_load().report.unread, std::vector<std::string>{"/materials/0/extras/heliograph/alhpa"});
}

}  // namespace
}  // namespace helio::test
