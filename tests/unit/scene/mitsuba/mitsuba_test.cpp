// The Mitsuba loader on small files: what each construct becomes, and what is said about what it cannot read.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "renderer/scene/images/texture.h"
#include "renderer/scene/load/scene_loader.h"
#include "renderer/scene/mitsuba/meshes.h"
#include "tests/unit/scene/images/image_encode.h"

namespace helio {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

Result<SceneDescription> load(const std::string& xml, std::vector<NamedFile> others = {}) {
  others.push_back({"s.xml", bytes_of(xml)});
  return load_scene(*make_memory_source(std::move(others)), "s.xml", {});
}

std::string scene(const std::string& body, const std::string& version = "3.0.0") {
  return "<scene version=\"" + version + "\">\n" + body + "\n</scene>";
}

SceneDescription loaded(const std::string& body, const std::string& version = "3.0.0",
                        std::vector<NamedFile> others = {}) {
  Result<SceneDescription> result = load(scene(body, version), std::move(others));
  EXPECT_TRUE(result.ok()) << result.error().to_string();
  return result.ok() ? *result : SceneDescription{};
}

void expect_error(const std::string& body, ErrorCode code, const std::string& where, const std::string& part) {
  Result<SceneDescription> result = load(scene(body));
  ASSERT_FALSE(result.ok()) << body;
  EXPECT_EQ(result.error().code, code);
  EXPECT_EQ(result.error().where, where);
  EXPECT_NE(result.error().message.find(part), std::string::npos) << result.error().to_string();
}

bool mentions(const std::vector<std::string>& messages, const std::string& part) {
  return std::any_of(messages.begin(), messages.end(),
                     [&](const std::string& message) { return message.find(part) != std::string::npos; });
}

TEST(MitsubaLoader, AreaLightsMayBeDefinedForShapesToReferTo) {
  const SceneDescription s = loaded(
      "<emitter type='area' id='lamp'><rgb name='radiance' value='3'/></emitter>"
      "<shape type='cube'><ref id='lamp'/></shape>");
  EXPECT_EQ(s.materials[0].emission, Rgb(3, 3, 3));
}

// Mitsuba 3 gives a shape that shines a diffuse of reflectance 0 where it names no bsdf, others one of 0.5.
TEST(MitsubaLoader, LampsWithoutABsdfReflectNothing) {
  const auto material = [](const std::string& inner) {
    return loaded("<shape type='sphere'>" + inner + "</shape>").materials[0];
  };
  const std::string emitter = "<emitter type='area'/>";
  EXPECT_EQ(material(emitter).base_color, Rgb(0, 0, 0));
  EXPECT_EQ(material(emitter).specular, 0);
  EXPECT_EQ(material("").base_color, Rgb(0.5f, 0.5f, 0.5f));
  EXPECT_EQ(material(emitter + "<bsdf type='diffuse'/>").base_color, Rgb(0.5f, 0.5f, 0.5f));
}

// Alpha counts as cover here, whatever the bsdf; Mitsuba 3.9.1 shows the emission in full, that of null too.
TEST(MitsubaLoader, LampsThatLetLightPassAreWarnedAbout) {
  const auto warnings = [](const std::string& bsdf) {
    return loaded("<shape type='rectangle'>\n" + bsdf + "<emitter type='area'/></shape>").report.warnings;
  };
  const auto mask = [](const std::string& opacity) {
    return "<bsdf type='mask'>" + opacity + "<bsdf type='diffuse'/></bsdf>";
  };
  const std::string by_opacity = "s.xml:2: shape \"rectangle\" shines by the opacity of its bsdf";
  EXPECT_TRUE(mentions(warnings(mask("<float name='opacity' value='0.25'/>")), by_opacity));
  EXPECT_TRUE(mentions(warnings(mask("<texture name='opacity' type='checkerboard'/>")), by_opacity));
  EXPECT_TRUE(
      mentions(warnings("<bsdf type='blendbsdf'><bsdf type='null'/><bsdf type='diffuse'/></bsdf>"), by_opacity));
  EXPECT_TRUE(mentions(warnings("<bsdf type='null'/>"), "s.xml:2: shape \"rectangle\" does not shine"));
  EXPECT_TRUE(warnings("<bsdf type='diffuse'/>").empty());
  EXPECT_TRUE(warnings(mask("<float name='opacity' value='1'/>")).empty());
  EXPECT_TRUE(loaded("<shape type='rectangle'><bsdf type='null'/></shape>").report.warnings.empty());
}

TEST(MitsubaLoader, TransformsApplyInTheOrderWritten) {
  // (1, 0, 0) scaled to (2, 0, 0), turned about z to (0, 2, 0), moved to (0, 2, 5).
  const SceneDescription s = loaded(
      "<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate z='1' angle='90'/>"
      "<translate z='5'/></transform></shape>");
  ASSERT_EQ(s.instances.size(), 1u);
  const V3d p = V3d(1, 0, 0) * s.instances[0].to_world;
  EXPECT_LT(length(p - V3d(0, 2, 5)), 1e-12);
}

TEST(MitsubaLoader, MatrixIsInRows) {
  const SceneDescription s = loaded(
      "<shape type='cube'><transform name='to_world'><matrix value='0 -1 0 7  1 0 0 8  0 0 1 9  0 0 0 1'/></transform>"
      "</shape>");
  ASSERT_EQ(s.instances.size(), 1u);
  EXPECT_LT(length(V3d(1, 0, 0) * s.instances[0].to_world - V3d(7, 9, 9)), 1e-12);
}

TEST(MitsubaLoader, CameraLooksWhereLookatPointsAndXIsToTheRight) {
  const SceneDescription s = loaded(
      "<sensor type='perspective'><float name='fov' value='60'/><film type='hdrfilm'><integer name='width' value='200'/>"
      "<integer name='height' value='100'/></film><transform name='to_world'>"
      "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform></sensor>");
  ASSERT_EQ(s.cameras.size(), 1u);
  const CameraDescription& c = s.cameras[0];
  EXPECT_EQ(c.aspect, 2);
  // 60 degrees across a film twice as wide as high: tan(v / 2) = tan(30) / 2.
  EXPECT_NEAR(std::tan(c.vertical_fov / 2), 0.28867513, 1e-7);
  V3d forward, right;
  c.to_world.multDirMatrix(V3d(0, 0, -1), forward);
  c.to_world.multDirMatrix(V3d(1, 0, 0), right);
  EXPECT_LT(length(forward - V3d(0, 0, -1)), 1e-12);
  EXPECT_LT(length(right - V3d(1, 0, 0)), 1e-12);
}

TEST(MitsubaLoader, FilmAndDepthsAreDefaultsOfWhoRenders) {
  const SceneDescription s = loaded(
      "<integrator type='path'><integer name='max_depth' value='7'/><integer name='rr_depth' value='4'/></integrator>"
      "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='200'/><integer name='height' "
      "value='100'/><integer name='crop_offset_x' value='10'/><integer name='crop_width' value='60'/></film></sensor>");
  EXPECT_EQ(s.hints.max_segments, 7);
  EXPECT_EQ(s.hints.roulette_from, 4);
  EXPECT_EQ(s.cameras[0].width, 200);
  EXPECT_EQ(s.cameras[0].height, 100);
  EXPECT_EQ(s.cameras[0].crop, (PixelRect{10, 0, 70, 100}));
  EXPECT_EQ(s.cameras[0].filter, (PixelFilter{PixelFilterKind::gaussian, 0.5}));  // Mitsuba's own default
  const auto filter = [](const std::string& text) {
    return *loaded("<sensor type='perspective'><film type='hdrfilm'><rfilter " + text + "</film></sensor>")
                .cameras[0]
                .filter;
  };
  EXPECT_EQ(filter("type='box'/>"), PixelFilter{});
  EXPECT_EQ(filter("type='tent'><float name='radius' value='2'/></rfilter>"), (PixelFilter{PixelFilterKind::tent, 2}));
  EXPECT_EQ(filter("type='gaussian'><float name='stddev' value='0.7'/></rfilter>"),
            (PixelFilter{PixelFilterKind::gaussian, 0.7}));
  EXPECT_EQ(filter("type='mitchell'/>"), PixelFilter{});
  EXPECT_EQ(loaded("<sensor type='perspective'/>").cameras[0].filter, (PixelFilter{PixelFilterKind::gaussian, 0.5}));
  const SceneDescription endless =
      loaded("<integrator type='path'><integer name='max_depth' value='-1'/></integrator>");
  EXPECT_EQ(endless.hints.max_segments, 65535);
  EXPECT_EQ(endless.hints.roulette_from, 0);
  EXPECT_TRUE(loaded("<sensor type='perspective'/>").cameras[0].crop.empty());
}

// Mitsuba 3 has one box, half a pixel on each side.
TEST(MitsubaLoader, BoxesOfOtherSizesAreUnread) {
  const auto unread = [](const std::string& inner) {
    const SceneDescription s = loaded(
        "<sensor type='perspective'><film type='hdrfilm'><rfilter type='box'>" + inner + "</rfilter></film></sensor>",
        "0.6.0");
    EXPECT_EQ(s.cameras[0].filter, PixelFilter{});
    return s.report.unread;
  };
  EXPECT_TRUE(unread("<float name='radius' value='0.5'/>").empty());
  EXPECT_EQ(unread("<float name='radius' value='2'/>"), std::vector<std::string>{"s.xml:2: <float> radius"});
  EXPECT_EQ(unread("<float name='B' value='0.3'/>"), std::vector<std::string>{"s.xml:2: <float> B"});
}

// As Mitsuba 3.9.1 prints it.
TEST(MitsubaLoader, LensesFocusOnTheFarPlaneUnlessTheySayWhere) {
  const auto focus = [](const std::string& inner) {
    return loaded("<sensor type='thinlens'><float name='aperture_radius' value='0.1'/>" + inner + "</sensor>")
        .cameras[0]
        .focus_distance;
  };
  EXPECT_EQ(focus(""), 1e4);
  EXPECT_EQ(focus("<float name='far_clip' value='50'/>"), 50);
  EXPECT_EQ(focus("<float name='far_clip' value='1e30'/>"), 1e12);  // the farthest of ours
  EXPECT_EQ(focus("<float name='far_clip' value='50'/><float name='focus_distance' value='3'/>"), 3);
}

// Mitsuba's max_depth is -1 by default, in those that trace whole paths.
TEST(MitsubaLoader, IntegratorsHaveNoLongestPathUnlessTheySaySo) {
  for (const char* type : {"path", "volpath", "volpathmis"}) {
    const SceneDescription s = loaded("<integrator type='" + std::string(type) + "'/>");
    EXPECT_EQ(s.hints.max_segments, 65535) << type;
    EXPECT_TRUE(mentions(s.report.notices, "no longest path")) << type;
  }
  EXPECT_EQ(loaded("<integrator type='moment'><integrator type='path'/></integrator>").hints.max_segments, 65535);
  EXPECT_EQ(loaded("<integrator type='direct'/>").hints.max_segments, 0);
  EXPECT_EQ(loaded("").hints.max_segments, 0);
  const SceneDescription black = loaded("<integrator type='path'><integer name='max_depth' value='0'/></integrator>");
  EXPECT_EQ(black.hints.max_segments, 1);
  EXPECT_TRUE(mentions(black.report.warnings, "ends paths before they begin"));
}

// Cameras see at all depths here: said where shapes lie nearer or farther than the sensor would see.
TEST(MitsubaLoader, ClippingThatMayHideShapesIsNoticed) {
  const auto notices = [](const std::string& type, const std::string& clip, const std::string& shape) {
    return loaded("<sensor type='" + type + "'>" + clip + "</sensor>" + shape).report.notices;
  };
  const std::string ball = "<shape type='sphere'><point name='center' x='0' y='0' z='5'/></shape>";  // depths 4 to 6
  const std::string behind = "<shape type='sphere'><point name='center' x='0' y='0' z='-500'/></shape>";
  // Below a camera that looks along +z: some of it has the depth 0, but what is seen has 2 at least.
  const std::string floor =
      "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='100'/>"
      "<translate y='-2'/></transform></shape>";
  const auto near_clip = [](const char* value) {
    return "<float name='near_clip' value='" + std::string(value) + "'/>";
  };
  const auto far_clip = [](const char* value) { return "<float name='far_clip' value='" + std::string(value) + "'/>"; };
  for (const char* type : {"perspective", "orthographic"}) {
    EXPECT_TRUE(mentions(notices(type, near_clip("4.5"), ball), "has near_clip 4.5")) << type;
    EXPECT_FALSE(mentions(notices(type, near_clip("3"), ball), "near_clip")) << type;
    EXPECT_TRUE(mentions(notices(type, far_clip("5.5"), ball), "has far_clip 5.5")) << type;
    EXPECT_FALSE(mentions(notices(type, far_clip("6.5"), ball), "far_clip")) << type;
    EXPECT_FALSE(mentions(notices(type, near_clip("4.5") + far_clip("5"), behind), "_clip")) << type;
  }
  EXPECT_FALSE(mentions(notices("perspective", near_clip("1"), floor), "near_clip"));
  EXPECT_TRUE(mentions(notices("perspective", near_clip("3"), floor), "near_clip"));
  // Mitsuba's own far_clip.
  EXPECT_TRUE(
      mentions(notices("perspective", "", "<shape type='sphere'><point name='center' x='0' y='0' z='20000'/></shape>"),
               "has far_clip 10000"));
}

TEST(MitsubaLoader, SamplesBeyondTheBorderAreNoticed) {
  const auto notices = [](const std::string& filter, const char* border) {
    return loaded("<sensor type='perspective'><film type='hdrfilm'><boolean name='sample_border' value='" +
                  std::string(border) + "'/><rfilter type='" + filter + "'/></film></sensor>")
        .report.notices;
  };
  EXPECT_TRUE(mentions(notices("gaussian", "true"), "sample_border"));
  EXPECT_FALSE(mentions(notices("gaussian", "false"), "sample_border"));
  EXPECT_FALSE(mentions(notices("box", "true"), "sample_border"));
}

TEST(MitsubaLoader, DefaultsIncludesAndReferencesAreFollowed) {
  const SceneDescription s = loaded(
      "<default name='radius' value='3'/><default name='r' value='9'/><include filename='part.xml'/>"
      "<shape type='sphere'><float name='radius' value='$radius'/><ref id='red'/></shape>",
      "3.0.0",
      {{"part.xml", bytes_of("<scene version='3.0.0'><bsdf type='twosided' id='red'><bsdf type='diffuse'>"
                             "<rgb name='reflectance' value='0.5, 0.1, 0.2'/></bsdf></bsdf></scene>")}});
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(s.objects[0].spheres[0].radius, 3);
  const Material& m = s.materials[std::size_t(s.objects[0].spheres[0].material)];
  EXPECT_EQ(m.base_color, Rgb(0.5f, 0.1f, 0.2f));
  EXPECT_FALSE(m.one_sided);
}

TEST(MitsubaLoader, OldNamesBecomeNewOnes) {
  const SceneDescription s = loaded(
      "<shape type='sphere'><transform name='toWorld'><translate x='2'/></transform>"
      "<bsdf type='dielectric'><float name='intIOR' value='1.5'/><float name='extIOR' value='1'/></bsdf></shape>",
      "0.6.0");
  EXPECT_EQ(s.instances[0].to_world[3][0], 2);
  EXPECT_FLOAT_EQ(s.materials[0].ior, 1.5f);
  EXPECT_TRUE(s.report.unread.empty());
}

TEST(MitsubaLoader, OldTextureParametersBecomeATransformThatOffsetsFirst) {
  const std::string plain = "<texture type='checkerboard' name='reflectance'>", end = "</texture>";
  const auto rows = [&](const std::string& parameters, const std::string& version = "0.6.0") {
    const SceneDescription s =
        loaded("<shape type='rectangle'><bsdf type='diffuse'>" + plain + parameters + end + "</bsdf></shape>", version);
    EXPECT_TRUE(s.report.unread.empty()) << s.report.unread.front();
    return s.materials[0].base_color_texture.uv_transform;
  };
  using Rows = std::array<float, 6>;
  // (u + 0.25) 2 and (v + 0.5) 3, as Mitsuba 3.9.1 shows them by traverse().
  EXPECT_EQ(rows("<float name='uscale' value='2'/><float name='vscale' value='3'/><float name='uoffset' value='0.25'/>"
                 "<float name='voffset' value='0.5'/>"),
            (Rows{2, 0, 0.5f, 0, 3, 1.5f}));
  EXPECT_EQ(rows("<float name='uscale' value='2'/>"), (Rows{2, 0, 0, 0, 1, 0}));
  EXPECT_EQ(rows("<float name='vscale' value='2'/>"), (Rows{1, 0, 0, 0, 2, 0}));
  EXPECT_EQ(rows("<float name='uoffset' value='0.25'/>"), (Rows{1, 0, 0.25f, 0, 1, 0}));
  EXPECT_EQ(rows("<float name='voffset' value='0.25'/>", "0.5.0"), (Rows{1, 0, 0, 0, 1, 0.25f}));
  EXPECT_EQ(rows(""), (Rows{1, 0, 0, 0, 1, 0}));
  // Later files have no such parameters.
  const SceneDescription s = loaded("<shape type='rectangle'><bsdf type='diffuse'>" + plain +
                                    "<float name='uscale' value='2'/>" + end + "</bsdf></shape>");
  ASSERT_EQ(s.report.unread.size(), 1u);
  EXPECT_NE(s.report.unread[0].find("uscale"), std::string::npos);
}

TEST(MitsubaLoader, OldDiffuseReflectanceIsTheReflectanceOfDiffuseAlone) {
  const std::string color = "<rgb name='diffuseReflectance' value='0.1, 0.2, 0.3'/>";
  const auto colored = [&](const std::string& type, const std::string& version) {
    return loaded("<shape type='cube'><bsdf type='" + type + "'>" + color + "</bsdf></shape>", version);
  };
  for (const char* type : {"diffuse", "plastic"}) {
    const SceneDescription s = colored(type, "0.5.0");
    EXPECT_EQ(s.materials[0].base_color, Rgb(0.1f, 0.2f, 0.3f)) << type;
    EXPECT_TRUE(s.report.unread.empty()) << type;
  }
  EXPECT_EQ(colored("diffuse", "3.0.0").report.unread.size(), 1u);
}

TEST(MitsubaLoader, OldConductorsWithoutAMetalAreMirrorsAsMitsuba3HasThem) {
  const auto warnings = [](const std::string& inner, const std::string& version) {
    return loaded("<shape type='cube'><bsdf type='roughconductor'>" + inner + "</bsdf></shape>", version)
        .report.warnings;
  };
  EXPECT_TRUE(mentions(warnings("", "0.6.0"), "names no material"));
  EXPECT_TRUE(warnings("<string name='material' value='Cu'/>", "0.6.0").empty());
  EXPECT_TRUE(warnings("", "3.0.0").empty());
}

TEST(MitsubaLoader, OldNamesKeepCapitalsThatFollowNoSmallLetter) {
  const SceneDescription s = loaded(
      "<sensor type='perspective'><float name='nearClip' value='0.1'/><film type='hdrfilm'><rfilter type='mitchell'>"
      "<float name='B' value='0.3'/><float name='C' value='0.3'/></rfilter></film></sensor>",
      "0.6.0");
  EXPECT_TRUE(s.report.unread.empty()) << s.report.unread.front();
}

// Each file is read by its own version, whoever includes it.
TEST(MitsubaLoader, IncludedFilesAreUpgradedByTheirOwnVersion) {
  const auto shape = [](const std::string& version, const std::string& name) {
    return bytes_of("<scene version='" + version + "'><shape type='cube'><transform name='" + name +
                    "'><translate x='2'/></transform></shape></scene>");
  };
  const SceneDescription s = loaded("<include filename='old.xml'/><include filename='new.xml'/>", "0.6.0",
                                    {{"old.xml", shape("0.5.0", "toWorld")}, {"new.xml", shape("3.0.0", "to_world")}});
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.instances[0].to_world[3][0], 2);
  EXPECT_EQ(s.instances[1].to_world[3][0], 2);
  const SceneDescription t = loaded(
      "<include filename='old.xml'/><shape type='cube'><transform name='to_world'>"
      "<translate x='3'/></transform></shape>",
      "3.0.0", {{"old.xml", shape("0.5.0", "toWorld")}});
  ASSERT_EQ(t.instances.size(), 2u);
  EXPECT_EQ(t.instances[0].to_world[3][0], 2);
  EXPECT_EQ(t.instances[1].to_world[3][0], 3);
}

TEST(MitsubaLoader, GroupsAreInstancedMemberByMember) {
  const SceneDescription s = loaded(
      "<shape type='shapegroup' id='g'><shape type='cube'/><shape type='disk'><transform name='to_world'>"
      "<translate z='1'/></transform></shape></shape>"
      "<shape type='instance'><ref id='g'/></shape><shape type='instance'><ref id='g'/><transform name='to_world'>"
      "<translate x='5'/></transform></shape>");
  EXPECT_EQ(s.objects.size(), 2u);
  ASSERT_EQ(s.instances.size(), 4u);
  EXPECT_LT(length(V3d(0, 0, 0) * s.instances[3].to_world - V3d(5, 0, 1)), 1e-12);
}

TEST(MitsubaLoader, UnreadPropertiesAreListed) {
  const SceneDescription s = loaded("<shape type='cube'>\n<float name='fuzziness' value='2'/></shape>");
  ASSERT_EQ(s.report.unread.size(), 1u);
  EXPECT_EQ(s.report.unread[0], "s.xml:3: <float> fuzziness");
}

// What the scene defines may be left alone; inside of others an id does not hide what nobody reads.
TEST(MitsubaLoader, OnlyDefinitionsMayGoUnread) {
  EXPECT_TRUE(loaded("<bsdf type='diffuse' id='a'/><texture type='checkerboard' id='b'/>").report.unread.empty());
  const SceneDescription s = loaded(
      "<shape type='cube'><bsdf type='diffuse'>\n<texture name='reflectance' type='checkerboard' id='read'/>\n"
      "<texture name='colour' type='checkerboard' id='typo'/></bsdf>\n<texture name='other' type='checkerboard' "
      "id='t'/></shape>");
  EXPECT_EQ(s.report.unread, (std::vector<std::string>{"s.xml:4: <texture> colour", "s.xml:5: <texture> other"}));
}

TEST(MitsubaLoader, BadInputIsRefusedWithItsPlace) {
  const ErrorCode bad = ErrorCode::invalid_argument, unknown = ErrorCode::unimplemented;
  expect_error("<shape type='teapot'/>", unknown, "s.xml:2", "shape \"teapot\" is not supported");
  expect_error("<shape type='cube'>\n<bsdf type='hair'/></shape>", unknown, "s.xml:3", "bsdf \"hair\"");
  expect_error("<emitter type='sunsky'/>", unknown, "s.xml:2", "emitter \"sunsky\"");
  expect_error("<shape type='cube'><ref id='none'/></shape>", bad, "s.xml:2", "\"none\"");
  expect_error("<shape type='sphere'><float name='radius' value='-1'/></shape>", bad, "s.xml:2", "allowed: above 0");
  expect_error("<shape type='sphere'><float name='radius' value='nan'/></shape>", bad, "s.xml:2", "a <float>");
  expect_error("<shape type='sphere'><float name='radius' value='$r'/></shape>", bad, "s.xml:2", "$r");
  expect_error("<shape type='cube'><transform name='to_world'><rotate angle='3'/></transform></shape>", bad, "s.xml:2",
               "an axis that is not 0");
  expect_error("<shape type='cube'><bsdf type='diffuse'><rgb name='reflectance' value='1.5'/></bsdf></shape>", bad,
               "s.xml:2", "[0, 1]");
  expect_error("<shape type='obj'><string name='filename' value='gone.obj'/></shape>", ErrorCode::not_found, "s.xml:2", "gone.obj");
  expect_error("<shape type='cube'><bsdf type='mask'/></shape>", bad, "s.xml:2", "holds 0 bsdfs");
  expect_error("<shape type='sphere'><boolean name='flip_normals' value='1'/></shape>", bad, "s.xml:2",
               "true or false");
  expect_error("<include filename='s.xml'/>", bad, "s.xml:2", "includes deeper than 8");
}

TEST(MitsubaLoader, PropertiesThatAreNotSupportedAreRefusedByName) {
  const auto refused = [](const std::string& body, const std::string& part) {
    expect_error(body, ErrorCode::unimplemented, "s.xml:2", part);
  };
  refused("<emitter type='spot'><texture name='texture' type='checkerboard'/></emitter>", "has a texture");
  refused("<sensor type='perspective'><float name='principal_point_offset_x' value='0.1'/></sensor>",
          "principal_point_offset_x");
  refused("<sensor type='orthographic'><transform name='to_world'><scale x='2' y='3' z='1'/></transform></sensor>",
          "scales x by 2 and y by 3, allowed: both alike");
  refused(
      "<shape type='cube'><bsdf type='diffuse'><texture name='reflectance' type='checkerboard'>"
      "<texture name='color1' type='checkerboard'/></texture></bsdf></shape>",
      "has a texture as color1");
}

TEST(MitsubaLoader, BrokenXmlNamesTheLine) {
  Result<SceneDescription> result = load("<scene version='3.0.0'>\n\n<shape type='cube'>\n</scene>");
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().where, "s.xml:4");
}

TEST(MitsubaLoader, ReferencedFilesAreNamedOnce) {
  const std::string xml = scene(
      "<default name='mesh' value='a'/><include filename='part.xml'/><shape type='ply'>"
      "<string name='filename' value='$mesh.ply'/></shape><shape type='ply'><string name='filename' value='a.ply'/>"
      "</shape>");
  const auto bytes = bytes_of(xml);
  const Result<std::vector<std::string>> files = referenced_files(bytes, "s.xml");
  ASSERT_TRUE(files.ok()) << files.error().to_string();
  EXPECT_EQ(*files, (std::vector<std::string>{"part.xml", "a.ply"}));
}

TEST(MitsubaLoader, SpectraOfOneValueAreGrey) {
  const SceneDescription s = loaded(
      "<shape type='cube'><bsdf type='diffuse'><spectrum name='reflectance' value='360:0.4, 830:0.4'/></bsdf></shape>");
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.materials[0].base_color[c], 0.4, 1e-6);
}

// ---- what pictures of others hold too, here by number ----------------------------------------------------------------

// The film is 2 wide in the sensor's space: a film twice as wide as high shows a height of 1, times the scale along x.
TEST(MitsubaLoader, OrthographicFilmIsTwoWide) {
  const SceneDescription s = loaded(
      "<sensor type='orthographic'><film type='hdrfilm'><integer name='width' value='200'/>"
      "<integer name='height' value='100'/></film><transform name='to_world'><scale x='3' y='3' z='1'/>"
      "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform></sensor>");
  ASSERT_EQ(s.cameras.size(), 1u);
  EXPECT_EQ(s.cameras[0].projection, Projection::orthographic);
  EXPECT_NEAR(s.cameras[0].half_height, 3.0 / 2, 1e-9);
}

// 60 degrees along one side of the film, or its diagonal.
TEST(MitsubaLoader, FieldOfViewIsAlongItsAxis) {
  const auto slope = [](const std::string& axis, int width, int height) {
    const SceneDescription s = loaded(
        "<sensor type='perspective'><float name='fov' value='60'/><string name='fov_axis' "
        "value='" +
        axis + "'/><film type='hdrfilm'><integer name='width' value='" + std::to_string(width) +
        "'/><integer name='height' value='" + std::to_string(height) + "'/></film></sensor>");
    return std::tan(s.cameras[0].vertical_fov / 2) / std::tan(std::numbers::pi / 6);
  };
  EXPECT_NEAR(slope("x", 200, 100), 0.5, 1e-9);
  EXPECT_NEAR(slope("y", 200, 100), 1, 1e-9);
  EXPECT_NEAR(slope("diagonal", 200, 100), 1 / std::sqrt(5.0), 1e-9);
  EXPECT_NEAR(slope("smaller", 200, 100), 1, 1e-9);
  EXPECT_NEAR(slope("larger", 200, 100), 0.5, 1e-9);
  EXPECT_NEAR(slope("smaller", 100, 200), 2, 1e-9);
  EXPECT_NEAR(slope("larger", 100, 200), 1, 1e-9);
  // In capitals too, as in Mitsuba 3.9.1.
  EXPECT_NEAR(slope("X", 200, 100), 0.5, 1e-9);
  EXPECT_NEAR(slope("Larger", 200, 100), 0.5, 1e-9);
}

// As in Mitsuba 3.9.1, which takes neither 1 nor yes.
TEST(MitsubaLoader, SwitchesMayBeCapitals) {
  const auto flipped = [](const std::string& value) {
    return loaded("<shape type='rectangle'><boolean name='flip_normals' value='" + value + "'/></shape>")
               .objects[0]
               .meshes[0]
               .indices != loaded("<shape type='rectangle'/>").objects[0].meshes[0].indices;
  };
  EXPECT_TRUE(flipped("True"));
  EXPECT_TRUE(flipped("TRUE"));
  EXPECT_FALSE(flipped("False"));
}

TEST(MitsubaLoader, SpotsHaveDegrees) {
  const auto spot = [](const std::string& inner) {
    return loaded("<emitter type='spot'>" + inner + "</emitter>").lights.at(0);
  };
  const PunctualLight narrow = spot("<float name='cutoff_angle' value='40'/><float name='beam_width' value='10'/>");
  EXPECT_NEAR(narrow.outer_cone_angle, 40 * std::numbers::pi / 180, 1e-6);
  EXPECT_NEAR(narrow.inner_cone_angle, 10 * std::numbers::pi / 180, 1e-6);
  EXPECT_NEAR(spot("").outer_cone_angle, 20 * std::numbers::pi / 180, 1e-6);
  EXPECT_NEAR(spot("").inner_cone_angle, 15 * std::numbers::pi / 180, 1e-6);
}

// IEC 61966-2-1: 0.5 is 0.21404, 128 of 255 is 0.21586.
TEST(MitsubaLoader, ColoursMayBeSrgb) {
  const auto reflectance = [](const std::string& color) {
    return loaded("<shape type='cube'><bsdf type='diffuse'>" + color + "</bsdf></shape>").materials[0].base_color;
  };
  EXPECT_NEAR(reflectance("<srgb name='reflectance' value='0.5, 0.5, 0.5'/>").y, 0.21404, 1e-5);
  EXPECT_NEAR(reflectance("<rgb name='reflectance' value='0.5, 0.5, 0.5'/>").y, 0.5, 1e-6);
  const Rgb hex = reflectance("<rgb name='reflectance' value='#ff8000'/>");
  EXPECT_NEAR(hex.x, 1, 1e-6);
  EXPECT_NEAR(hex.y, 0.21586, 1e-5);
  EXPECT_EQ(hex.z, 0);
}

// Mitsuba 3.9.1 swaps the colours where it asks for a number.
TEST(MitsubaLoader, CheckerboardsBeginWithTheirFirstColour) {
  const std::string board =
      "type='checkerboard'><float name='color0' value='0.25'/><float name='color1' value='0.75'/></texture>";
  const auto first = [&](const std::string& bsdf, const std::string& name) {
    const SceneDescription s = loaded("<shape type='rectangle'><bsdf type='" + bsdf + "'><texture name='" + name +
                                      "' " + board + "</bsdf></shape>");
    float value = 0;
    std::memcpy(&value, s.images.at(0).texels.data(), sizeof value);
    return value;
  };
  EXPECT_EQ(first("diffuse", "reflectance"), 0.25f);
  EXPECT_EQ(first("roughconductor", "alpha"), 0.75f);
}

// A rectangle that wears a bitmap of one texel as its first material.
SceneDescription with_bitmap(const std::string& inner) {
  const std::uint8_t texel[3] = {128, 128, 128};
  return loaded(
      "<shape type='rectangle'><bsdf type='diffuse'><texture name='reflectance' type='bitmap'>"
      "<string name='filename' value='t.png'/>" +
          inner + "</texture></bsdf></shape>",
      "0.6.0", {{"t.png", test::encode_image("png", OIIO::ImageSpec(1, 1, 3, OIIO::TypeDesc::UINT8), texel)}});
}

TEST(MitsubaLoader, BitmapsAreSrgbUnlessTheyAreRaw) {
  const auto encoding = [](const std::string& inner) {
    return with_bitmap(inner).materials[0].base_color_texture.encoding;
  };
  EXPECT_EQ(encoding(""), TexelEncoding::srgb);
  EXPECT_EQ(encoding("<boolean name='raw' value='true'/>"), TexelEncoding::linear);
  EXPECT_EQ(encoding("<float name='gamma' value='1'/>"), TexelEncoding::linear);
  EXPECT_EQ(encoding("<float name='gamma' value='-1'/>"), TexelEncoding::srgb);
  EXPECT_EQ(encoding("<float name='gamma' value='2.2'/>"), TexelEncoding::srgb);
}

// What 0.5 and 0.6 could and Mitsuba 3 cannot.
TEST(MitsubaLoader, OldLookupsOfBitmapsAreWarnedAbout) {
  const auto warnings = [](const std::string& inner) { return with_bitmap(inner).report.warnings; };
  EXPECT_TRUE(mentions(warnings("<float name='gamma' value='2.2'/>"), "s.xml:2: texture \"bitmap\" has gamma 2.2"));
  for (const char* taken : {"1", "-1"})
    EXPECT_TRUE(warnings("<float name='gamma' value='" + std::string(taken) + "'/>").empty()) << taken;
  for (const char* filter : {"trilinear", "ewa"})
    EXPECT_TRUE(mentions(warnings("<string name='filter_type' value='" + std::string(filter) + "'/>"),
                         "filter_type \"" + std::string(filter) + "\": lookups are bilinear"));
  EXPECT_TRUE(warnings("<string name='filter_type' value='bilinear'/>").empty());
}

// Mitsuba 3 does not bring the axis of a rotation to unit length: its matrix for 40 degrees about (1, 1, 0).
TEST(MitsubaLoader, RotationsTakeTheAxisAsItIs) {
  const SceneDescription s =
      loaded("<shape type='cube'><transform name='to_world'><rotate x='1' y='1' angle='40'/></transform></shape>");
  const M44d& m = s.instances[0].to_world;
  constexpr double kExpected[3][3] = {
      {1, 0.233956, 0.642788}, {0.233956, 1, -0.642788}, {-0.642788, 0.642788, 0.766044}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) EXPECT_NEAR(m[column][row], kExpected[row][column], 1e-6);
  ASSERT_EQ(s.report.warnings.size(), 1u);
  EXPECT_NE(s.report.warnings[0].find("unit length"), std::string::npos);
}

// As Mitsuba 3.9.1 reads them: reflectances and indices under the illuminant D65, in which white is (1, 1, 1), emission
// as light itself, in which equal energy is pink. Its own white reflects 0.9989 of ours.
TEST(MitsubaLoader, SpectraAreTheColoursOfMitsuba) {
  constexpr const char* kRamp = "400:0.1, 700:0.9";
  const auto expect_color = [](const Rgb& found, const Rgb& expected) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 2e-3 * expected[c]);
  };
  const auto material = [](const std::string& inner) {
    return loaded("<shape type='cube'>" + inner + "</shape>").materials[0];
  };
  const auto spectrum = [](const std::string& name, const std::string& value) {
    return "<spectrum name='" + name + "' value='" + value + "'/>";
  };
  const Rgb under_d65(0.742853f, 0.48114f, 0.208325f);
  expect_color(material("<bsdf type='diffuse'>" + spectrum("reflectance", kRamp) + "</bsdf>").base_color, under_d65);
  const Material metal =
      material("<bsdf type='conductor'>" + spectrum("eta", kRamp) + spectrum("k", kRamp) + "</bsdf>");
  expect_color(metal.conductor_eta, under_d65);
  expect_color(metal.conductor_k, under_d65);
  const auto radiance = [&](const std::string& value) {
    return material("<emitter type='area'>" + spectrum("radiance", value) + "</emitter>").emission;
  };
  expect_color(radiance(kRamp), Rgb(0.872215f, 0.458728f, 0.181301f));
  expect_color(radiance("2"), Rgb(2.40959f, 1.89658f, 1.81783f));
  EXPECT_EQ(material("<emitter type='area'><float name='radiance' value='2'/></emitter>").emission, Rgb(2, 2, 2));
}

// Light of one narrow band has that band's hue; equal energy has luminance 1.
TEST(MitsubaLoader, SpectraGoThroughTheObserver) {
  const auto radiance = [](const std::string& values) {
    return loaded("<shape type='cube'><emitter type='area'><spectrum name='radiance' value='" + values +
                  "'/></emitter></shape>")
        .materials[0]
        .emission;
  };
  const Rgb white = radiance("300:1, 900:1");
  EXPECT_NEAR(luminance(white), 1, 2e-3);
  const Rgb red = radiance("620:0, 625:1, 630:1, 635:0"), blue = radiance("450:0, 455:1, 460:1, 465:0");
  EXPECT_GT(red.x, 10 * std::max(red.y, red.z));
  EXPECT_GT(blue.z, 10 * std::max(blue.x, blue.y));
}

// A sphere that faces inwards is a mesh: ours as such face outwards.
TEST(MitsubaLoader, FlippedSpheresFaceInwards) {
  const SceneDescription s = loaded(
      "<shape type='sphere'><boolean name='flip_normals' value='true'/><float name='radius' value='2'/>"
      "<point name='center' x='1' y='0' z='0'/></shape>");
  ASSERT_TRUE(s.objects[0].spheres.empty());
  const TriangleMesh& mesh = s.objects[0].meshes.at(0);
  double area = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    V3d p[3];
    for (int k = 0; k < 3; ++k) p[k] = V3d(mesh.positions[mesh.indices[i + std::size_t(k)]]);
    const V3d normal = cross(p[1] - p[0], p[2] - p[0]), middle = (p[0] + p[1] + p[2]) / 3 - V3d(1, 0, 0);
    ASSERT_LT(dot(normal, middle), 0) << i;
    area += length(normal) / 2;
  }
  EXPECT_NEAR(area, 16 * std::numbers::pi, 16 * std::numbers::pi * 1e-4);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const V3f out = (mesh.positions[i] - V3f(1, 0, 0)) / 2;
    ASSERT_LT(length(mesh.normals[i] + out), 1e-5f) << i;
    const V2f uv = mesh.texcoords[0][i];
    ASSERT_NEAR(std::cos(uv.y * std::numbers::pi), out.z, 1e-5) << i;
    const double around = std::hypot(out.x, out.y);
    ASSERT_NEAR(around * std::cos(2 * std::numbers::pi * uv.x), out.x, 1e-5) << i;
    ASSERT_NEAR(around * std::sin(2 * std::numbers::pi * uv.x), out.y, 1e-5) << i;
  }
}

// Which side Mitsuba 3.9.1 shows as the front: a mirroring transform turns it where triangles alone tell it. Ours keep
// theirs under the transform.
TEST(MitsubaLoader, MirroredMeshesFaceAsInMitsuba) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::vector<NamedFile> files = {{"flat.obj", bytes_of(corners + "f 1 2 3\n")},
                                        {"smooth.obj", bytes_of(corners + "vn 0 0 1\nf 1//1 2//1 3//1\n")}};
  const auto up = [&](const std::string& file, const std::string& inner) {
    const SceneDescription s =
        loaded("<shape type='obj'><string name='filename' value='" + file + "'/>" + inner + "</shape>", "3.0.0", files);
    const TriangleMesh& mesh = s.objects.at(0).meshes.at(0);
    const V3f a = mesh.positions[mesh.indices[0]];
    const float z = cross(mesh.positions[mesh.indices[1]] - a, mesh.positions[mesh.indices[2]] - a).z;
    for (const V3f& n : mesh.normals) EXPECT_GT(n.z * z, 0) << file << inner;
    return z > 0;
  };
  const std::string mirrored = "<transform name='to_world'><scale x='-1'/></transform>";
  const std::string face_normals = "<boolean name='face_normals' value='true'/>";
  const std::string flipped = "<boolean name='flip_normals' value='true'/>";
  EXPECT_TRUE(up("flat.obj", ""));
  EXPECT_FALSE(up("flat.obj", mirrored));
  EXPECT_FALSE(up("flat.obj", mirrored + face_normals));
  EXPECT_TRUE(up("flat.obj", mirrored + flipped));
  EXPECT_TRUE(up("smooth.obj", mirrored));
  EXPECT_FALSE(up("smooth.obj", mirrored + face_normals));
  EXPECT_FALSE(up("smooth.obj", mirrored + flipped));
  // Of a sphere, the inside is the front; ours as such face outwards.
  const auto is_mesh = [](const std::string& inner) {
    return loaded("<shape type='sphere'>" + inner + "</shape>").objects.at(0).spheres.empty();
  };
  EXPECT_TRUE(is_mesh(mirrored));
  EXPECT_FALSE(is_mesh(mirrored + flipped));
}

// The texture is of whichever part of a bsdf; spheres and shapes of the loader's own have coordinates.
TEST(MitsubaLoader, TexturesOnMeshesWithoutCoordinatesAreWarnedAbout) {
  const std::vector<NamedFile> files = {
      {"bare.obj", bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")},
      {"full.obj", bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")}};
  const auto warns = [&](const std::string& shape, const std::string& bsdf) {
    return mentions(loaded("<shape " + shape + bsdf + "</shape>", "3.0.0", files).report.warnings,
                    "has textures but no texture coordinates");
  };
  const auto obj = [](const std::string& file) { return "type='obj'><string name='filename' value='" + file + "'/>"; };
  const std::string board = "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'/></bsdf>";
  EXPECT_TRUE(warns(obj("bare.obj"), board));
  EXPECT_TRUE(warns(obj("bare.obj"), "<bsdf type='blendbsdf'>" + board + "<bsdf type='diffuse'/></bsdf>"));
  EXPECT_FALSE(warns(obj("bare.obj"), ""));
  EXPECT_FALSE(warns(obj("full.obj"), board));
  EXPECT_FALSE(warns("type='sphere'>", board));
}

// Rows of images go down, texture coordinates of rectangles go up from the lower left corner: to_uv is applied to the
// latter, and a lookup at (u, v) finds row v x height from the top.
TEST(MitsubaLoader, RectangleCoordinatesGrowRightAndUp) {
  const SceneDescription s = loaded("<shape type='rectangle'/>");
  const TriangleMesh& mesh = s.objects[0].meshes[0];
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_FLOAT_EQ(mesh.texcoords[0][i].x, (mesh.positions[i].x + 1) / 2);
    EXPECT_FLOAT_EQ(mesh.texcoords[0][i].y, (mesh.positions[i].y + 1) / 2);
  }
}

constexpr const char* kColoredPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "property float r\nproperty float g\nproperty float b\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0\n1 0 0 0 0.5 0\n0 1 0 0 0 0.25\n3 0 1 2\n";

TEST(MitsubaLoader, VertexColoursShowOnlyWhereABsdfAsksForThem) {
  const std::string shape = "<shape type='ply'><string name='filename' value='m.ply'/>";
  const std::string attribute =
      "<bsdf type='twosided'><bsdf type='diffuse'><texture name='reflectance' type='mesh_attribute'>"
      "<string name='name' value='vertex_color'/></texture></bsdf></bsdf>";
  const SceneDescription plain = loaded(shape + "</shape>", "3.0.0", {{"m.ply", bytes_of(kColoredPly)}});
  EXPECT_TRUE(plain.objects[0].meshes[0].colors.empty());
  const SceneDescription s = loaded(shape + attribute + "</shape>", "3.0.0", {{"m.ply", bytes_of(kColoredPly)}});
  ASSERT_EQ(s.objects[0].meshes[0].colors.size(), 3u);
  EXPECT_EQ(s.objects[0].meshes[0].colors[1], V4f(0, 0.5f, 0, 1));
  EXPECT_EQ(s.materials[0].base_color, Rgb(1, 1, 1));
  expect_error("<shape type='cube'>" + attribute + "</shape>", ErrorCode::invalid_argument, "s.xml:2",
               "no attribute vertex_color");
}

// Names as Mitsuba 3.9.1 lists them by traverse().
TEST(MitsubaMeshes, PlyAttributesAreNamedAsInMitsuba) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property float dirt_r\nproperty float dirt_g\nproperty float dirt_b\nproperty float worn_0\n"
      "property float two_0\nproperty float two_1\nelement face 2\nproperty list uchar int vertex_indices\n"
      "property uchar b\nproperty uchar g\nproperty uchar r\nproperty float worn_x\nend_header\n"
      "0 0 0 0.1 0.2 0.3 0.7 0 0\n1 0 0 0.4 0.5 0.6 0.8 0 0\n1 1 0 0.1 0.1 0.1 0.9 0 0\n0 1 0 0 0 0 1 0 0\n"
      "3 0 1 2 51 102 153 0.25\n3 0 2 3 255 0 0 0.5\n";
  const auto colors = [&](const std::string& attribute) {
    MemoryBudget budget(1 << 20);
    std::vector<V4f> of_faces;
    Result<TriangleMesh> mesh = mitsuba::parse_ply(bytes_of(text), budget, attribute, &of_faces);
    EXPECT_TRUE(mesh.ok());
    EXPECT_TRUE(mesh->colors.empty() || of_faces.empty());
    return mesh->colors.empty() ? of_faces : mesh->colors;
  };
  EXPECT_EQ(colors("vertex_dirt_color").at(1), V4f(0.4f, 0.5f, 0.6f, 1));
  EXPECT_EQ(colors("vertex_worn").at(2), V4f(0.9f, 0.9f, 0.9f, 1));
  // By name, whatever their order.
  EXPECT_EQ(colors("face_color").at(0), V4f(srgb_to_linear(0.6f), srgb_to_linear(0.4f), srgb_to_linear(0.2f), 1));
  EXPECT_EQ(colors("face_worn").at(1), V4f(0.5f, 0.5f, 0.5f, 1));
  for (const char* absent : {"vertex_color", "vertex_two", "vertex_dirt", "face_dirt_color", "vertex_", "face_", ""})
    EXPECT_TRUE(colors(absent).empty()) << absent;
}

// What traverse() of Mitsuba 3.9.1 lists; bytes alone it takes as they are.
TEST(MitsubaMeshes, PlyAttributesOfIntegersAreSrgb) {
  struct Case {
    const char* type;
    const char* values;
    Rgb color;
  };
  for (const Case& c :
       {Case{"char", "127 64 0", {1, 0.21770316f, 0}}, Case{"short", "32767 10000 5", {1, 0.07583262f, 1.181057e-5f}},
        Case{"ushort", "65535 39321 13107", {1, 0.31854674f, 0.033104725f}},
        Case{"int", "2147483647 1000000000 0", {1, 0.18362284f, 0}},
        Case{"uint", "4294967295 2147483648 0", {1, 0.21404107f, 0}},
        Case{"uchar", "255 153 51", {1, 0.31854674f, 0.033104725f}}, Case{"float", "1 0.6 0.2", {1, 0.6f, 0.2f}}}) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    for (const char* channel : {"r", "g", "b"}) text += "property " + std::string(c.type) + " " + channel + "\n";
    text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 " + std::string(c.values) +
            "\n3 0 0 0\n";
    MemoryBudget budget(1 << 20);
    const Result<TriangleMesh> mesh = mitsuba::parse_ply(bytes_of(text), budget, "vertex_color");
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    ASSERT_EQ(mesh->colors.size(), 1u) << c.type;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(mesh->colors[0][k], c.color[k], 1e-6f) << c.type;
  }
  // One of three is no colour.
  const std::string one =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property float g\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0.5\n3 0 0 0\n";
  MemoryBudget budget(1 << 20);
  const Result<TriangleMesh> mesh = mitsuba::parse_ply(bytes_of(one), budget, "vertex_color");
  ASSERT_TRUE(mesh.ok());
  EXPECT_TRUE(mesh->colors.empty());
}

TEST(MitsubaLoader, ColoursOfSomeFacesAreRefused) {
  const std::string vertices =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string ply = vertices + faces + "property float r\nproperty float g\nproperty float b\n" + faces +
                          "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 1 0 0\n3 0 2 1\n";
  const std::string body =
      "<shape type='ply'><string name='filename' value='m.ply'/><bsdf type='diffuse'><texture name='reflectance' "
      "type='mesh_attribute'><string name='name' value='face_color'/></texture></bsdf></shape>";
  const Result<SceneDescription> made = load(scene(body, "3.0.0"), {{"m.ply", bytes_of(ply)}});
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(made.error().message.find("colours for 1 of its 2 triangles"), std::string::npos) << made.error().message;
}

// A short file names many spheres that are meshes here: 131,841 vertices each.
TEST(MitsubaLoader, PrimitivesCountAgainstTheMemoryOfALoad) {
  std::string shapes;
  for (int i = 0; i < 60; ++i) shapes += "<shape type='sphere'><boolean name='flip_normals' value='true'/></shape>\n";
  const Result<SceneDescription> made = load(scene(shapes, "3.0.0"));
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(made.error().where.starts_with("s.xml:")) << made.error().where;
}

TEST(MitsubaLoader, ClippingOfVeryManySensorsIsNotLookedAt) {
  std::string text;
  for (int i = 0; i < 3500; ++i) {
    text +=
        "<sensor type='perspective'><float name='far_clip' value='1'/></sensor>\n"
        "<shape type='sphere'><point name='center' x='0' y='0' z='5'/></shape>\n";
  }
  const SceneDescription scene = loaded(text);
  EXPECT_TRUE(mentions(scene.report.notices, "of 643 sensors beyond the first 2857 are not looked at"));
}

// Triangles in colours of their own stay smoothly shaded and keep their place in the texture.
TEST(MitsubaLoader, ColoursOfFacesGiveEveryTriangleItsOwnVertices) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\n"
      "property float r\nproperty float g\nproperty float b\nend_header\n"
      "0 0 0 0 0\n1 0 0 1 0\n1 1 1 1 1\n0 1 0 0 1\n3 0 1 2 1 0 0\n3 0 2 3 0 1 0.5\n";
  const SceneDescription s = loaded(
      "<shape type='ply'><string name='filename' value='m.ply'/><bsdf type='diffuse'><texture name='reflectance' "
      "type='mesh_attribute'><string name='name' value='face_color'/></texture></bsdf></shape>",
      "3.0.0", {{"m.ply", bytes_of(ply)}});
  ASSERT_EQ(s.objects.size(), 1u);
  const TriangleMesh& mesh = s.objects[0].meshes[0];
  ASSERT_EQ(mesh.positions.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(mesh.colors[i], i < 3 ? V4f(1, 0, 0, 1) : V4f(0, 1, 0.5f, 1)) << i;
  EXPECT_EQ(mesh.positions[mesh.indices[4]], V3f(1, 1, 1));
  EXPECT_EQ(mesh.texcoords[0][mesh.indices[5]], V2f(0, 1));
  EXPECT_EQ(mesh.normals[0], mesh.normals[3]);  // of the vertex that both share
  EXPECT_NE(mesh.normals[0], mesh.normals[1]);
}

TEST(MitsubaMeshes, PlyColoursMustBeShares) {
  std::string text = kColoredPly;
  text.replace(text.find("0.25"), 4, "2.25");
  MemoryBudget budget(1 << 20);
  Result<TriangleMesh> mesh = mitsuba::parse_ply(bytes_of(text), budget, "vertex_color");
  ASSERT_TRUE(mesh.ok());
  const Status status = mitsuba::check_mesh(*mesh, budget);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("allowed: [0, 1]"), std::string::npos);
}

// ---- mesh files ------------------------------------------------------------------------------------------------------

TEST(MitsubaMeshes, ObjMakesFansAndSharesCorners) {
  MemoryBudget budget(1 << 20);
  const Result<TriangleMesh> mesh = mitsuba::parse_obj(
      bytes_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\n# a quad\nf 1/1 2/1 3/1 4/1\nf -4 -3 -2\n"), budget);
  ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
  EXPECT_EQ(mesh->triangle_count(), 3u);
  EXPECT_EQ(mesh->positions.size(), 7u);  // four with texture coordinates, three without
  EXPECT_EQ(mitsuba::parse_obj(bytes_of("v 0 0 0\nf 1 2 3\n"), budget).error().message,
            "line 2: a face's index is outside of what came before it");
}

// Two triangles at a right angle; of the first one corner has a normal, of the second none. Those without are as flat
// as their triangle, also where both share a vertex.
TEST(MitsubaMeshes, CornersWithoutANormalHaveThatOfTheirTriangle) {
  MemoryBudget budget(1 << 20);
  Result<TriangleMesh> mesh =
      mitsuba::parse_obj(bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0.6 0 0.8\nf 1//1 2 3\nf 1 3 4\n"), budget);
  ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
  ASSERT_TRUE(mitsuba::check_mesh(*mesh, budget).ok());
  ASSERT_EQ(mesh->indices.size(), 6u);
  const V3f expected[6] = {{0.6f, 0, 0.8f}, {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  const V3f corners[6] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t i = 0; i < 6; ++i) {
    ASSERT_LT(mesh->indices[i], mesh->normals.size());
    EXPECT_LT(length(mesh->normals[mesh->indices[i]] - expected[i]), 1e-6f) << i;
    EXPECT_EQ(mesh->positions[mesh->indices[i]], corners[i]) << i;
  }
  for (const V3f& n : mesh->normals) EXPECT_NEAR(length(n), 1, 1e-6);
}

TEST(MitsubaMeshes, PlyReadsBothByteOrdersAndText) {
  const std::string head =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  const float xyz[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::int32_t face[3] = {0, 1, 2};
  std::string little = "ply\nformat binary_little_endian 1.0\n" + head, big = "ply\nformat binary_big_endian 1.0\n" + head;
  const auto append = [&](const void* word) {
    char raw[4];
    std::memcpy(raw, word, 4);
    little.append(raw, 4);
    std::reverse(raw, raw + 4);
    big.append(raw, 4);
  };
  for (const float& f : xyz) append(&f);
  little += '\3';
  big += '\3';
  for (const std::int32_t& i : face) append(&i);
  for (const std::string& file :
       {little, big, "ply\nformat ascii 1.0\n" + head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"}) {
    MemoryBudget budget(1 << 20);
    const Result<TriangleMesh> mesh = mitsuba::parse_ply(bytes_of(file), budget);
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_EQ(mesh->positions[1], V3f(1, 0, 0));
    EXPECT_EQ(mesh->indices, (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_FALSE(mitsuba::parse_ply(bytes_of(file.substr(0, file.size() - 5)), budget).ok());
  }
  MemoryBudget budget(1 << 20);
  std::string huge = "ply\nformat ascii 1.0\n" + head;
  huge.replace(huge.find("vertex 3"), 8, "vertex 3000000000");
  EXPECT_FALSE(mitsuba::parse_ply(bytes_of(huge), budget).ok());
}

// A face of a hundred thousand corners is a byte for each in the file, and far more in memory.
TEST(MitsubaMeshes, PlyPolygonsCountAgainstTheBudget) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nelement face 1\n"
      "property list uint uchar vertex_indices\nend_header\n";
  const std::uint32_t corners = 100000;
  std::string file = head + '\0';
  file.append(reinterpret_cast<const char*>(&corners), sizeof corners);
  file.append(corners, '\0');
  MemoryBudget small(1 << 20), large(1 << 24);
  const Result<TriangleMesh> refused = mitsuba::parse_ply(bytes_of(file), small);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(mitsuba::parse_ply(bytes_of(file), large).ok());
}

TEST(MitsubaMeshes, SerializedIsInflatedAndChecked) {
  std::vector<std::uint8_t> plain;
  const auto put = [](std::vector<std::uint8_t>& out, auto value) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    out.insert(out.end(), raw, raw + sizeof value);
  };
  put(plain, std::uint32_t(0x1000));
  plain.insert(plain.end(), {'m', 0});
  put(plain, std::uint64_t(3));
  put(plain, std::uint64_t(1));
  for (const float f : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(plain, f);
  for (const std::uint32_t i : {0u, 1u, 2u}) put(plain, i);
  std::vector<std::uint8_t> packed(compressBound(uLong(plain.size())));
  uLongf size = uLongf(packed.size());
  ASSERT_EQ(compress(packed.data(), &size, plain.data(), uLong(plain.size())), Z_OK);
  std::vector<std::uint8_t> file;
  put(file, std::uint16_t(0x041C));
  put(file, std::uint16_t(4));
  file.insert(file.end(), packed.begin(), packed.begin() + std::ptrdiff_t(size));
  put(file, std::uint64_t(0));
  put(file, std::uint32_t(1));
  MemoryBudget budget(1 << 20);
  const Result<TriangleMesh> mesh = mitsuba::parse_serialized(file, 0, budget);
  ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
  EXPECT_EQ(mesh->positions[2], V3f(0, 1, 0));
  EXPECT_FALSE(mitsuba::parse_serialized(file, 1, budget).ok());
  for (std::size_t cut = 0; cut < file.size(); ++cut)
    EXPECT_FALSE(mitsuba::parse_serialized(std::span(file).first(cut), 0, budget).ok()) << cut;
}

}  // namespace
}  // namespace helio
