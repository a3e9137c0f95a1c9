// The projector of Mitsuba scenes: where its picture lands, how bright it is, and what is refused.
#include <gtest/gtest.h>

#include <cmath>

#include "renderer/scene/load/scene_loader.h"

namespace helio {
namespace {

Result<SceneDescription> load(const std::string& body) {
  const std::string xml = "<scene version='3.0.0'>\n" + body + "\n</scene>";
  return load_scene(*make_memory_source({{"s.xml", {xml.begin(), xml.end()}}}), "s.xml", {});
}

PunctualLight projector(const std::string& properties) {
  Result<SceneDescription> scene = load("<emitter type='projector'>" + properties + "</emitter>");
  EXPECT_TRUE(scene.ok()) << scene.error().to_string();
  if (!scene.ok() || scene->lights.size() != 1) return {};
  EXPECT_TRUE(scene->report.unread.empty());
  return scene->lights[0];
}

struct Seen {
  double u = 0, v = 0;
  double radiance = 0;  // of a white picture, red
};

Seen look(const PunctualLight& light, const V3d& point) {
  const PictureProjection& p = light.projection;
  const V3d d = point - light.position;
  const double depth = dot(p.depth, d);
  return {0.5 + dot(p.across, d) / depth, 0.5 + dot(p.down, d) / depth,
          light.intensity.x / (depth * depth * dot(light.direction, d) / length(d))};
}

std::string matrix(const std::string& rows) {
  return "<transform name='to_world'><matrix value='" + rows + "'/></transform>";
}

// What Projector::sample_direction of Mitsuba 3.9.1 gives for the same values (scalar_rgb): uv and radiance.
TEST(MitsubaProjector, PlacesItsPictureAsMitsubaDoes) {
  const std::string fov = "<float name='fov' value='40'/>";
  struct Case {
    const char* name;
    std::string properties;
    V3d point;
    double u, v, radiance;
  };
  const Case cases[] = {
      {"on the axis", fov, {0, 0, 1}, 0.5, 0.5, 3.14159265},
      {"beside it", fov, {0.2, 0.1, 1}, 0.22525224, 0.36262612, 3.2191744},
      {"farther", fov, {0.4, 0.2, 2}, 0.22525224, 0.36262612, 0.8047936},
      {"scaled", fov + matrix("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"), {0.4, 0.2, 2}, 0.22525224, 0.36262612, 1.6095872},
      {"mirrored", fov + matrix("-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), {0.2, 0.1, 1}, 0.7747477, 0.36262612, 3.2191744},
      {"sheared", fov + matrix("1 0 0.3 0 0 1 0 0 0 0 1 0 0 0 0 1"), {0.2, 0.1, 1}, 0.6373739, 0.36262612, 3.0369573},
      {"focal length", "<string name='focal_length' value='30mm'/>", {0.1, 0.05, 1}, 0.401942, 0.450971, 3.1611667},
      {"scale", fov + "<float name='scale' value='2.5'/>", {0.1, 0.05, 1}, 0.36262614, 0.43131307, 7.9029172},
  };
  for (const Case& c : cases) {
    const Seen seen = look(projector(c.properties), c.point);
    EXPECT_NEAR(seen.u, c.u, 1e-6) << c.name;
    EXPECT_NEAR(seen.v, c.v, 1e-6) << c.name;
    EXPECT_NEAR(seen.radiance, c.radiance, 1e-6 * c.radiance) << c.name;
  }
}

TEST(MitsubaProjector, ReadsColoursAndTextures) {
  const float pi = kPi;
  EXPECT_EQ(projector("<float name='irradiance' value='2'/>").intensity, Rgb(2 * pi));
  const Rgb color = projector("<rgb name='irradiance' value='1, 2, 3'/>").intensity;
  EXPECT_NEAR(color.z, 3 * pi, 1e-5);
  EXPECT_NEAR(color.x, pi, 1e-5);
  const PunctualLight light = projector("<texture name='irradiance' type='checkerboard'/>");
  EXPECT_EQ(light.kind, PunctualKind::projector);
  EXPECT_TRUE(light.projection.picture.present());
}

TEST(MitsubaProjector, BadValuesAreRefusedWithTheirPlace) {
  const struct {
    std::string properties;
    const char* part;
  } cases[] = {
      {"<float name='fov' value='0'/>", "allowed"},
      {"<float name='fov' value='180'/>", "allowed"},
      {"<float name='fov' value='nan'/>", "a <float>"},
      {"<float name='fov' value='40'/><string name='fov_axis' value='z'/>", "allowed: x, y, diagonal, smaller, larger"},
      {"<string name='focal_length' value='-3mm'/>", "a length above 0"},
      {"<float name='scale' value='-1'/>", "allowed"},
      {"<float name='scale' value='1e30'/><float name='irradiance' value='1e30'/>", "brighter than a float can say"},
      {"<transform name='to_world'><scale x='0'/></transform>", "flattens it"},
      {"<transform name='to_world'><scale value='1e-25'/></transform>", "scales it by more than 1e20"},
      {"<transform name='to_world'><scale value='1e25'/></transform>", "scales it by more than 1e20"},
      {"<texture name='irradiance' type='volume'/>", "is not supported"},
  };
  for (const auto& c : cases) {
    const Result<SceneDescription> scene = load("<emitter type='projector'>" + c.properties + "</emitter>");
    ASSERT_FALSE(scene.ok()) << c.properties;
    EXPECT_EQ(scene.error().where, "s.xml:2") << c.properties;
    EXPECT_NE(scene.error().message.find(c.part), std::string::npos) << scene.error().to_string();
  }
}

}  // namespace
}  // namespace helio
