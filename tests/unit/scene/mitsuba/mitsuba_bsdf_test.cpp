// Mitsuba's bsdf plugins: what each becomes, and what is said about what it cannot be.
#include <gtest/gtest.h>

#include "renderer/scene/load/scene_loader.h"

namespace helio {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

Result<SceneDescription> load(const std::string& body, std::vector<NamedFile> others = {}) {
  others.push_back({"s.xml", bytes_of("<scene version=\"3.0.0\">\n" + body + "\n</scene>")});
  return load_scene(*make_memory_source(std::move(others)), "s.xml", {});
}

// A cube of the bsdf: the material it wears is the last one.
SceneDescription wearing(const std::string& bsdf, std::vector<NamedFile> others = {}) {
  Result<SceneDescription> result = load("<shape type='cube'>" + bsdf + "</shape>", std::move(others));
  EXPECT_TRUE(result.ok()) << result.error().to_string();
  if (!result.ok()) return {};
  EXPECT_TRUE(result->report.unread.empty()) << result->report.unread.front();
  return *result;
}

Material material_of(const std::string& bsdf) {
  const SceneDescription s = wearing(bsdf);
  return s.objects.empty() ? Material{} : s.materials[std::size_t(s.objects[0].meshes[0].material)];
}

void expect_refused(const std::string& bsdf, ErrorCode code, const std::string& part) {
  const Result<SceneDescription> result = load("<shape type='cube'>" + bsdf + "</shape>");
  ASSERT_FALSE(result.ok()) << bsdf;
  EXPECT_EQ(result.error().code, code) << bsdf;
  EXPECT_EQ(result.error().where, "s.xml:2");
  EXPECT_NE(result.error().message.find(part), std::string::npos) << result.error().to_string();
}

TEST(MitsubaBsdf, RoughnessAlongAndAcross) {
  const Material m = material_of(
      "<bsdf type='roughconductor'><float name='alpha_u' value='0.09'/><float name='alpha_v' value='0.25'/></bsdf>");
  EXPECT_EQ(m.model, MaterialModel::conductor);
  EXPECT_EQ(m.distribution, MicrofacetDistribution::beckmann);
  EXPECT_FLOAT_EQ(m.roughness, 0.3f);  // perceptual: the root of alpha
  EXPECT_FLOAT_EQ(m.roughness_across, 0.5f);
  EXPECT_LT(material_of("<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf>").roughness_across, 0);
}

// Mitsuba 3: material "none", eta 0, k 1, each of which may be given alone; a material beside them is an error there
// too.
TEST(MitsubaBsdf, ConductorsAreMirrorsUnlessTheySayOtherwise) {
  const auto index = [](const std::string& inner) {
    const Material smooth = material_of("<bsdf type='conductor'>" + inner + "</bsdf>");
    const Material rough = material_of("<bsdf type='roughconductor'>" + inner + "</bsdf>");
    EXPECT_EQ(smooth.conductor_eta, rough.conductor_eta);
    EXPECT_EQ(smooth.conductor_k, rough.conductor_k);
    return std::pair(smooth.conductor_eta, smooth.conductor_k);
  };
  EXPECT_EQ(index(""), std::pair(Rgb(0), Rgb(1)));
  EXPECT_EQ(index("<string name='material' value='none'/>"), std::pair(Rgb(0), Rgb(1)));
  EXPECT_EQ(index("<float name='eta' value='2'/>"), std::pair(Rgb(2), Rgb(1)));
  EXPECT_EQ(index("<float name='k' value='3'/>"), std::pair(Rgb(0), Rgb(3)));
  EXPECT_EQ(index("<string name='material' value='Cu'/>").first, Rgb(0.20101f, 0.92375f, 1.1022f));
  for (const char* property : {"eta", "k"})
    expect_refused("<bsdf type='conductor'><string name='material' value='Cu'/><float name='" + std::string(property) +
                       "' value='3'/></bsdf>",
                   ErrorCode::invalid_argument, "has material and eta or k");
}

// As in Mitsuba 3: of distributions and of the names of dielectrics, but not of metals.
TEST(MitsubaBsdf, SomeNamesMayBeCapitals) {
  const auto rough = [](const std::string& type, const std::string& distribution) {
    return material_of("<bsdf type='" + type + "'><string name='distribution' value='" + distribution + "'/></bsdf>")
        .distribution;
  };
  for (const char* type : {"roughconductor", "roughdielectric", "roughplastic"}) {
    EXPECT_EQ(rough(type, "GGX"), MicrofacetDistribution::ggx) << type;
    EXPECT_EQ(rough(type, "Beckmann"), MicrofacetDistribution::beckmann) << type;
  }
  EXPECT_NEAR(material_of("<bsdf type='dielectric'><string name='int_ior' value='BK7'/></bsdf>").ior, 1.50418, 1e-5);
  expect_refused("<bsdf type='conductor'><string name='material' value='cu'/></bsdf>", ErrorCode::unimplemented,
                 "material \"cu\"");
}

TEST(MitsubaBsdf, PlasticHasItsDefaults) {
  const Material m = material_of("<bsdf type='plastic'/>");
  EXPECT_EQ(m.model, MaterialModel::plastic);
  EXPECT_TRUE(m.one_sided);
  EXPECT_EQ(m.roughness, 0);
  EXPECT_NEAR(m.ior, 1.49 / 1.000277, 1e-6);
  EXPECT_EQ(m.base_color, Rgb(0.5f, 0.5f, 0.5f));
  const Material rough = material_of(
      "<bsdf type='roughplastic'><float name='alpha' value='0.04'/><boolean name='nonlinear' value='true'/>"
      "<rgb name='specular_reflectance' value='0.1, 0.2, 0.3'/></bsdf>");
  EXPECT_FLOAT_EQ(rough.roughness, 0.2f);
  EXPECT_TRUE(rough.nonlinear);
  EXPECT_EQ(rough.specular_color, Rgb(0.1f, 0.2f, 0.3f));
  expect_refused("<bsdf type='plastic'><float name='int_ior' value='1'/></bsdf>", ErrorCode::invalid_argument,
                 "allowed: above 1");
}

TEST(MitsubaBsdf, PaneIsThinAndPassesLight) {
  const Material m = material_of("<bsdf type='thindielectric'><rgb name='specular_transmittance' value='0.5'/></bsdf>");
  EXPECT_EQ(m.model, MaterialModel::pane);
  EXPECT_FALSE(bounds_volume(m));
  EXPECT_FALSE(m.one_sided);
  EXPECT_EQ(m.transmission, 1);
  EXPECT_EQ(m.base_color, Rgb(0.5f, 0.5f, 0.5f));
}

TEST(MitsubaBsdf, PrincipledSpecularIsAnIor) {
  // 0.08 x 0.5 = 0.04 = ((n - 1) / (n + 1))^2: n = 1.5.
  const Material m = material_of("<bsdf type='principled'><float name='clearcoat' value='0.3'/></bsdf>");
  EXPECT_EQ(m.model, MaterialModel::principled);
  EXPECT_NEAR(m.ior, 1.5, 1e-6);
  EXPECT_FLOAT_EQ(m.principled.clearcoat, 0.3f);
  EXPECT_TRUE(m.one_sided);
  const Material clear = material_of(
      "<bsdf type='principled'><float name='spec_trans' value='0.5'/><float name='eta' value='1.3'/></bsdf>");
  EXPECT_TRUE(bounds_volume(clear));
  EXPECT_FALSE(clear.one_sided);
  EXPECT_FLOAT_EQ(clear.ior, 1.3f);
  expect_refused("<bsdf type='principled'><float name='roughness' value='1.5'/></bsdf>", ErrorCode::invalid_argument,
                 "from 0 to 1");
  expect_refused("<bsdf type='principled'><float name='eta' value='1.3'/><float name='specular' value='0.4'/></bsdf>",
                 ErrorCode::invalid_argument, "one of the two");
}

// Every number that Mitsuba takes a texture for: the texture's luminance times 1.
TEST(MitsubaBsdf, NumbersMayBeTextures) {
  const auto slot_of = [](const std::string& type, const std::string& name, TextureSlot NumberTextures::*slot) {
    const Material m =
        material_of("<bsdf type='" + type + "'><texture name='" + name + "' type='checkerboard'/></bsdf>");
    EXPECT_TRUE((m.numbers.*slot).present()) << type << " " << name;
    return m;
  };
  using N = NumberTextures;
  for (const char* type : {"roughconductor", "roughdielectric"})
    EXPECT_EQ(slot_of(type, "alpha", &N::roughness).roughness, 1);
  EXPECT_EQ(slot_of("principled", "roughness", &N::roughness).roughness, 1);
  EXPECT_EQ(slot_of("principled", "metallic", &N::metallic).metallic, 1);
  EXPECT_TRUE(bounds_volume(slot_of("principled", "spec_trans", &N::transmission)));
  EXPECT_EQ(slot_of("principled", "anisotropic", &N::anisotropic).principled.anisotropic, 1);
  EXPECT_EQ(slot_of("principled", "spec_tint", &N::spec_tint).principled.spec_tint, 1);
  EXPECT_EQ(slot_of("principled", "sheen", &N::sheen).principled.sheen, 1);
  EXPECT_EQ(slot_of("principled", "sheen_tint", &N::sheen_tint).principled.sheen_tint, 1);
  EXPECT_EQ(slot_of("principled", "flatness", &N::flatness).principled.flatness, 1);
  EXPECT_EQ(slot_of("principled", "clearcoat", &N::clearcoat).principled.clearcoat, 1);
  EXPECT_EQ(slot_of("principled", "clearcoat_gloss", &N::clearcoat_gloss).principled.clearcoat_gloss, 1);

  const Material brushed = material_of(
      "<bsdf type='roughconductor'><float name='alpha_u' value='0.04'/><texture name='alpha_v' type='checkerboard'/>"
      "</bsdf>");
  EXPECT_FLOAT_EQ(brushed.roughness, 0.2f);
  EXPECT_TRUE(brushed.numbers.roughness_across.present());
  EXPECT_FALSE(brushed.numbers.roughness.present());

  expect_refused("<bsdf type='roughplastic'><texture name='alpha' type='checkerboard'/></bsdf>",
                 ErrorCode::invalid_argument, "allowed: a number");
  expect_refused("<bsdf type='roughconductor'><float name='alpha_u' value='0.04'/></bsdf>", ErrorCode::invalid_argument,
                 "alpha_u without alpha_v");
  expect_refused("<bsdf type='principled'><texture name='roughness' type='volume'/></bsdf>", ErrorCode::unimplemented,
                 "texture \"volume\" is not supported");
}

TEST(MitsubaBsdf, GlassMayTintWhatItReflects) {
  const Material m =
      material_of("<bsdf type='dielectric'><rgb name='specular_reflectance' value='0.1, 0.2, 0.3'/></bsdf>");
  EXPECT_TRUE(m.tinted_reflection);
  EXPECT_EQ(m.specular_color, Rgb(0.1f, 0.2f, 0.3f));
}

// 0.25 of a bsdf that is there to 0.4, 0.75 of one that is there everywhere: 0.1 + 0.75, of which 0.75 the second.
TEST(MitsubaBsdf, BlendOfAMaskIsAMaskOfABlend) {
  const Material m = material_of(
      "<bsdf type='blendbsdf'><float name='weight' value='0.75'/><bsdf type='mask'><float name='opacity' value='0.4'/>"
      "<bsdf type='diffuse'/></bsdf><bsdf type='diffuse'/></bsdf>");
  EXPECT_EQ(m.alpha_mode, AlphaMode::blend);
  EXPECT_FLOAT_EQ(m.base_alpha, 0.85f);
  EXPECT_FLOAT_EQ(m.blend.weight, 0.75f / 0.85f);
  const Material twice = material_of(
      "<bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='mask'><float name='opacity' value='0.5'/>"
      "<bsdf type='diffuse'/></bsdf></bsdf>");
  EXPECT_FLOAT_EQ(twice.base_alpha, 0.25f);
}

TEST(MitsubaBsdf, BlendKeepsItsPartsInOrder) {
  const SceneDescription s = wearing(
      "<bsdf type='blendbsdf'><float name='weight' value='0.25'/><bsdf type='diffuse'/><bsdf type='plastic'/></bsdf>");
  const Material& m = s.materials[std::size_t(s.objects[0].meshes[0].material)];
  ASSERT_EQ(m.model, MaterialModel::blend);
  EXPECT_FLOAT_EQ(m.blend.weight, 0.25f);
  EXPECT_EQ(s.materials[std::size_t(m.blend.first)].model, MaterialModel::metallic_roughness);
  EXPECT_EQ(s.materials[std::size_t(m.blend.second)].model, MaterialModel::plastic);
  EXPECT_TRUE(m.one_sided);
  expect_refused("<bsdf type='blendbsdf'><bsdf type='diffuse'/></bsdf>", ErrorCode::invalid_argument, "holds 1 bsdfs");
}

TEST(MitsubaBsdf, TwosidedReachesTheParts) {
  const SceneDescription s = wearing(
      "<bsdf type='twosided'><bsdf type='blendbsdf'><bsdf type='diffuse'/><bsdf type='plastic'/></bsdf></bsdf>");
  const Material& m = s.materials[std::size_t(s.objects[0].meshes[0].material)];
  EXPECT_FALSE(m.one_sided);
  EXPECT_FALSE(s.materials[std::size_t(m.blend.first)].one_sided);
  EXPECT_FALSE(s.materials[std::size_t(m.blend.second)].one_sided);
}

TEST(MitsubaBsdf, TwosidedOfTwoHasAFrontAndABack) {
  const SceneDescription s = wearing(
      "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0.1'/></bsdf>"
      "<bsdf type='diffuse'><rgb name='reflectance' value='0.9'/></bsdf></bsdf>");
  const Material& m = s.materials[std::size_t(s.objects[0].meshes[0].material)];
  ASSERT_EQ(m.model, MaterialModel::blend);
  EXPECT_TRUE(m.blend.by_side);
  EXPECT_FLOAT_EQ(s.materials[std::size_t(m.blend.first)].base_color.x, 0.1f);
  EXPECT_FLOAT_EQ(s.materials[std::size_t(m.blend.second)].base_color.x, 0.9f);
  expect_refused("<bsdf type='twosided'><bsdf type='thindielectric'/></bsdf>", ErrorCode::invalid_argument,
                 "transmits");
}

TEST(MitsubaBsdf, BlendsAreLimited) {
  std::string nest = "<bsdf type='diffuse'/>";
  for (int i = 0; i < 8; ++i) nest = "<bsdf type='blendbsdf'><bsdf type='diffuse'/>" + nest + "</bsdf>";
  EXPECT_EQ(material_of(nest).model, MaterialModel::blend);
  expect_refused("<bsdf type='blendbsdf'><bsdf type='diffuse'/>" + nest + "</bsdf>", ErrorCode::invalid_argument,
                 "more than 8 blends");
}

TEST(MitsubaBsdf, NullLetsEverythingPass) {
  const Material m = material_of("<bsdf type='null'/>");
  EXPECT_EQ(m.alpha_mode, AlphaMode::blend);
  EXPECT_EQ(m.base_alpha, 0);
}

TEST(MitsubaBsdf, MapsHaveShadowingUnlessSwitchedOff) {
  const std::string map =
      "<texture type='checkerboard'/><bsdf type='diffuse'/><float name='scale' value='0.5'/>";
  const Material m = material_of("<bsdf type='bumpmap'>" + map + "</bsdf>");
  EXPECT_TRUE(m.bump_texture.present());
  EXPECT_FLOAT_EQ(m.bump_scale, 0.5f);
  EXPECT_TRUE(m.map_shadowing);
  EXPECT_FALSE(material_of("<bsdf type='bumpmap'><boolean name='use_shadowing_function' value='false'/>" + map +
                           "</bsdf>")
                   .map_shadowing);
  expect_refused(
      "<bsdf type='bumpmap'><texture type='checkerboard'/><bsdf type='blendbsdf'><bsdf type='diffuse'/>"
      "<bsdf type='bumpmap'>" +
          map + "</bsdf></bsdf></bsdf>",
      ErrorCode::unimplemented, "normal or bump map already");
  expect_refused("<bsdf type='bumpmap'><bsdf type='diffuse'/></bsdf>", ErrorCode::invalid_argument,
                 "holds 0 textures");
}

// A mask's opacity is a texture of its own: the bsdf keeps its colours.
TEST(MitsubaBsdf, MaskOfATexturedBsdfKeepsBothTextures) {
  const Material m = material_of(
      "<bsdf type='mask'><texture name='opacity' type='checkerboard'><rgb name='color0' value='1'/>"
      "<rgb name='color1' value='0'/></texture><bsdf type='diffuse'><texture name='reflectance' type='checkerboard'/>"
      "</bsdf></bsdf>");
  EXPECT_TRUE(m.base_color_texture.present());
  ASSERT_TRUE(m.opacity_texture.present());
  EXPECT_NE(m.opacity_texture.image, m.base_color_texture.image);
  EXPECT_EQ(m.alpha_mode, AlphaMode::blend);
}

}  // namespace
}  // namespace helio
