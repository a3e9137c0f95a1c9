#include "renderer/trace/camera/camera.h"

#include <gtest/gtest.h>

namespace helio {
namespace {

constexpr double kDegree = 3.14159265358979 / 180;

TEST(Camera, CentreLooksForwardAndEdgesSpanTheField) {
  const CameraPose pose = *look_at({1, 2, 3}, {1, 2, -7}, {0, 1, 0}, 60 * kDegree);
  const Camera camera(pose, 200, 100, {0, 0, 0});
  const CameraRay centre = camera.generate_ray(100, 50, {0, 0}, {0.5f, 0.5f});
  EXPECT_NEAR(centre.direction.z, -1, 1e-6);
  EXPECT_EQ(centre.origin, V3f(1, 2, 3));
  // Upper edge: half the vertical field above the axis. Right edge: twice its tangent, for an aspect of two.
  const CameraRay top = camera.generate_ray(100, 0, {0, 0}, {0.5f, 0.5f}),
                  right = camera.generate_ray(200, 50, {0, 0}, {0.5f, 0.5f});
  EXPECT_NEAR(top.direction.y / -top.direction.z, std::tan(30 * kDegree), 1e-6);
  EXPECT_NEAR(right.direction.x / -right.direction.z, 2 * std::tan(30 * kDegree), 1e-6);
}

TEST(Camera, IsRebasedWithTheScene) {
  const CameraPose pose = *look_at({1e7 + 0.25, 0, 0}, {1e7, 0, 0}, {0, 1, 0}, 1);
  EXPECT_EQ(Camera(pose, 8, 8, {1e7, 0, 0}).generate_ray(4, 4, {0, 0}, {0, 0}).origin, V3f(0.25f, 0, 0));
}

TEST(Camera, OrthographicRaysAreParallel) {
  CameraPose pose = *look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 1);
  pose.projection = Projection::orthographic;
  pose.half_height = 2;
  const Camera camera(pose, 64, 32, {0, 0, 0});
  const CameraRay corner = camera.generate_ray(0, 0, {0, 0}, {0.5f, 0.5f});
  EXPECT_EQ(corner.direction, V3f(0, 0, -1));
  EXPECT_NEAR(corner.origin.x, -4, 1e-6);
  EXPECT_NEAR(corner.origin.y, 2, 1e-6);
}

// All rays of one film position meet in the plane of focus, wherever they leave the lens.
TEST(Camera, LensRaysMeetInFocus) {
  CameraPose pose = *look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 50 * kDegree);
  pose.lens_radius = 0.1;
  pose.focus_distance = 4;
  const Camera camera(pose, 64, 64, {0, 0, 0});
  const auto at_focus = [&](const V2f& lens) {
    const CameraRay ray = camera.generate_ray(10, 20, {0, 0}, lens);
    EXPECT_LE(length(ray.origin), 0.1f * 1.0001f);
    return ray.origin + ray.direction * ((-4 - ray.origin.z) / ray.direction.z);
  };
  const V3f a = at_focus({0.1f, 0.9f}), b = at_focus({0.8f, 0.3f});
  EXPECT_LT(length(a - b), 1e-5f);
}

// Floats beyond 32,768 lie 1 / 256 apart. Just right of the middle of the widest film, where the direction itself has
// digits to spare, the place where a ray meets the plane of the film is the one asked for; farther out it is off by the
// rounding of the unit direction, relative to the distance from the middle.
TEST(Camera, KeepsPositionsInAPixelApartOnWideFilms) {
  constexpr int kWidth = 65536;
  CameraPose pose = *look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1);
  const double half_height = std::tan(0.5);
  const Camera camera(pose, kWidth, kWidth, {0, 0, 0});
  const auto column = [&](int x, float in_pixel) {
    const CameraRay ray = camera.generate_ray(x, kWidth / 2, {in_pixel, 0}, {0.5f, 0.5f});
    return (double(ray.direction.x) / -double(ray.direction.z) / half_height + 1) * 0.5 * kWidth;
  };
  for (const auto& [x, tolerance] : {std::pair(kWidth / 2, 1e-6), {kWidth / 2 + 3, 3e-6}, {kWidth - 1, 8e-3}}) {
    for (int i = 0; i < 1000; ++i) {
      const float in_pixel = (float(i) + 0.3f) / 1000;
      ASSERT_NEAR(column(x, in_pixel), x + double(in_pixel), tolerance);
    }
    EXPECT_LT(column(x, 0x1.fffffep-1f), x + 1 + tolerance);
  }
}

TEST(Camera, LookAtRefusesWhatHasNoOrientation) {
  EXPECT_NE(look_at({1, 1, 1}, {1, 1, 1}, {0, 1, 0}, 1).error().message.find("target"), std::string::npos);
  EXPECT_NE(look_at({0, 0, 0}, {0, 5, 0}, {0, 1, 0}, 1).error().message.find("up"), std::string::npos);
  EXPECT_FALSE(look_at({NAN, 0, 0}, {0, 0, 1}, {0, 1, 0}, 1).ok());
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 4).ok());
  const Error far = look_at({1e30, 0, 0}, {0, -2e15, 1}, {0, 1e300, 0}, 1).error();
  for (const char* part :
       {"position: (1e+30, 0, 0)", "target: (0, -2000000000000000, 1)", "up: (0, 1e+300, 0)", "[-1e12, 1e12]"})
    EXPECT_NE(far.message.find(part), std::string::npos) << far.message;
}

TEST(Camera, ValidationNamesEveryField) {
  CameraPose pose;
  pose.vertical_fov = 0;
  pose.lens_radius = -1;
  pose.focus_distance = INFINITY;
  pose.position.x = NAN;
  pose.right = V3d(0, 0, 0);
  Problems problems;
  validate(pose, "view.camera", problems);
  ASSERT_EQ(problems.size(), 5u);
  const std::string all = problems.to_error().message;
  for (const char* field : {"view.camera.position", "view.camera.rotation", "view.camera.vertical_fov",
                            "view.camera.lens_radius", "view.camera.focus_distance"}) {
    EXPECT_NE(all.find(field), std::string::npos) << field;
  }
}

TEST(Camera, ValidationGivesValueAndRange) {
  CameraPose pose;
  pose.projection = Projection::orthographic;
  pose.position = V3d(0, -1e16, 0);
  pose.half_height = 1e300;
  pose.lens_radius = 1e30;
  pose.focus_distance = 1e-300;
  Problems problems;
  validate(pose, "", problems);
  const std::string all = problems.to_error().message;
  for (const char* part : {"position: (0, -1e+16, 0); allowed: finite numbers in [-1e12, 1e12]",
                           "half_height: 1e+300; allowed: [1e-12, 1e12]", "lens_radius: 1e+30; allowed: [0, 1e12]",
                           "focus_distance: 1e-300; allowed: [1e-12, 1e12]"}) {
    EXPECT_NE(all.find(part), std::string::npos) << all;
  }
}

// A camera of aspect 2: in a picture as wide, 2 tan(30 degrees) is seen at either side. In narrower pictures too, and
// then more above and below; squares stay squares, for pixels are as wide as high.
TEST(Camera, PicturesOfAnotherAspectShowAllThatItFrames) {
  const double side = 2 * std::tan(30 * kDegree);
  for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
    CameraDescription description;
    description.projection = projection;
    description.vertical_fov = 60 * kDegree;
    description.half_height = side / 2;
    description.aspect = 2;
    const auto edge = [&](int width, int height) {  // how far is seen to the right, and upwards
      const Camera camera(fitted(camera_pose(description), width, height), width, height, {0, 0, 0});
      const auto at = [&](int x, int y) {
        const CameraRay ray = camera.generate_ray(x, y, {0, 0}, {0.5f, 0.5f});
        const V3f p = projection == Projection::perspective ? ray.direction / -ray.direction.z : ray.origin;
        return std::max(p.x, p.y);
      };
      return Imath::V2d(at(width, height / 2), at(width / 2, 0));
    };
    // As others have it, the vertical extent is the picture's.
    EXPECT_NEAR(edge(64, 64).x, side / 2, 1e-5);
    description.keeps_aspect = true;
    for (const auto& [width, height] : {std::pair(128, 64), std::pair(64, 64), std::pair(48, 96), std::pair(4, 200)}) {
      EXPECT_NEAR(edge(width, height).x, side, 1e-5 * side) << width << "x" << height;
      EXPECT_NEAR(edge(width, height).y, side * height / width, 1e-4 * side * height / width);
    }
    // Wider: the height stays.
    EXPECT_NEAR(edge(256, 64).y, side / 2, 1e-5);
    EXPECT_NEAR(edge(256, 64).x, 2 * side, 1e-5);
    const CameraPose pose = camera_pose(description);
    EXPECT_EQ(aspect_notice(pose, 128, 64), "");
    EXPECT_EQ(aspect_notice(pose, 64, 64),
              "the camera frames an aspect (width / height) of 2, the picture has 1: it shows more above and below");
    EXPECT_NE(aspect_notice(pose, 256, 64).find("at both sides"), std::string::npos);
    // Sizes that rounding to whole pixels explains are of the aspect: in bits.
    CameraPose odd = pose;
    odd.aspect = 1.7777;
    CameraPose plain = odd;
    plain.aspect = 0;
    EXPECT_EQ(fitted(odd, 1280, 720), plain);
    EXPECT_EQ(aspect_notice(odd, 1280, 720), "");
  }
}

// Whatever a description holds, its pose can be rendered.
TEST(Camera, PosesOfDescriptionsAreValid) {
  for (const double value : {0.0, -1.0, 1e-300, 1e19, 1e300, double(INFINITY), double(NAN)}) {
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
      CameraDescription description;
      description.projection = projection;
      description.vertical_fov = description.half_height = description.lens_radius = value;
      description.focus_distance = value;
      description.to_world[3][0] = value;
      description.aspect = value;
      description.keeps_aspect = true;
      Problems problems;
      validate(camera_pose(description), "", problems);
      validate(fitted(camera_pose(description), 1, 65536), "fitted", problems);
      EXPECT_TRUE(problems.empty()) << value << ": " << problems.to_error().message;
    }
  }
}

// At every corner of the allowed ranges rays are finite, of unit length, and far below what the tracer refuses.
TEST(Camera, RaysOfExtremePosesAreFinite) {
  for (int corner = 0; corner < 64; ++corner) {
    const auto pick = [&](int bit, double low, double high) { return corner >> bit & 1 ? high : low; };
    CameraPose pose;
    pose.projection = corner & 1 ? Projection::orthographic : Projection::perspective;
    pose.position = V3d(pick(1, 0, 1e12), pick(1, 0, -1e12), 1e12);
    pose.vertical_fov = pick(2, 0.0017, 3.1242);
    pose.half_height = pick(2, 1e-12, 1e12);
    pose.lens_radius = pick(3, 1e-12, 1e12);
    pose.focus_distance = pick(4, 1e-12, 1e12);
    Problems problems;
    validate(pose, "", problems);
    ASSERT_TRUE(problems.empty()) << problems.to_error().message;
    const bool wide = corner >> 5 & 1;
    const Camera camera(pose, wide ? 65536 : 1, wide ? 1 : 65536, {-1e12, 1e12, -1e12});
    for (const V2f& lens : {V2f(0.5f, 0.5f), V2f(0, 0), V2f(0.999f, 0.3f)}) {
      for (const float in_pixel : {0.0f, 0.5f, 1.0f}) {
        const int last = in_pixel == 1 ? 65535 : 0;
        const CameraRay ray = camera.generate_ray(wide ? last : 0, wide ? 0 : last, {in_pixel, in_pixel}, lens);
        for (int c = 0; c < 3; ++c) EXPECT_LT(std::abs(ray.origin[c]), 1e18f) << corner;
        EXPECT_NEAR(length(ray.direction), 1, 1e-5) << corner;
      }
    }
  }
}

// The lens is worked out about its own centre: a focus nearer than the rounding of the position still has a direction.
TEST(Camera, LensFarFromTheOriginKeepsItsFocus) {
  CameraPose pose = *look_at({1e9, 0, 0}, {1e9, 0, -1}, {0, 1, 0}, 50 * kDegree);
  pose.lens_radius = 1e-3;
  pose.focus_distance = 0.5;
  const CameraRay ray = Camera(pose, 64, 64, {0, 0, 0}).generate_ray(32, 32, {0, 0}, {0.5f, 0.5f});
  EXPECT_NEAR(ray.direction.z, -1, 1e-5);
}

}  // namespace
}  // namespace helio
