#include "renderer/scene/description/default_camera.h"

namespace helio {

namespace {

void extend_by_box(Box3d& bounds, const Box3d& box, const M44d& to_world) {
  for (int corner = 0; corner < 8; ++corner) {
    const V3d p(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                corner & 4 ? box.max.z : box.min.z);
    bounds.extendBy(p * to_world);
  }
}

Box3d object_bounds(const Object& object) {
  Box3d box;
  for (const TriangleMesh& mesh : object.meshes)
    for (const V3f& p : mesh.positions) box.extendBy(V3d(p));
  for (const Sphere& sphere : object.spheres) {
    box.extendBy(V3d(sphere.center) - V3d(double(sphere.radius)));
    box.extendBy(V3d(sphere.center) + V3d(double(sphere.radius)));
  }
  return box;
}

}  // namespace

std::vector<Box3d> instance_bounds(const SceneDescription& scene) {
  std::vector<Box3d> boxes;
  boxes.reserve(scene.objects.size());
  for (const Object& object : scene.objects) boxes.push_back(object_bounds(object));
  std::vector<Box3d> bounds;
  bounds.reserve(scene.instances.size());
  for (const Instance& instance : scene.instances) {
    const Box3d& box = boxes[std::size_t(instance.object)];
    bounds.emplace_back();
    if (!box.isEmpty()) extend_by_box(bounds.back(), box, instance.to_world);
  }
  return bounds;
}

Box3d scene_bounds(const SceneDescription& scene) {
  Box3d bounds;
  for (const Box3d& box : instance_bounds(scene)) bounds.extendBy(box);
  return bounds;
}

CameraDescription frame_bounds(const Box3d& given) {
  const Box3d bounds = given.isEmpty() ? Box3d(V3d(-0.5), V3d(0.5)) : given;
  const V3d center = bounds.center();
  const V3d back = normalize(V3d(0.5, 0.4, 1.0));
  const V3d right = normalize(cross(V3d(0, 1, 0), back));
  const V3d up = cross(back, right);

  CameraDescription camera;
  camera.name = "default";
  camera.vertical_fov = 0.7;
  const double slope = std::tan(camera.vertical_fov / 2) / 1.05;
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const V3d p = V3d(corner & 1 ? bounds.max.x : bounds.min.x, corner & 2 ? bounds.max.y : bounds.min.y,
                      corner & 4 ? bounds.max.z : bounds.min.z) -
                  center;
    // In view when |offset| <= slope * (distance - dot(p, back)).
    const double offset = std::max(std::abs(dot(p, right)), std::abs(dot(p, up)));
    distance = std::max(distance, dot(p, back) + offset / slope);
  }
  if (!(distance > 0)) distance = 1;  // a single point
  const V3d eye = center + back * distance;
  camera.focus_distance = distance;
  for (int c = 0; c < 3; ++c) {
    camera.to_world[0][c] = right[c];
    camera.to_world[1][c] = up[c];
    camera.to_world[2][c] = back[c];
    camera.to_world[3][c] = eye[c];
  }
  return camera;
}

}  // namespace helio
