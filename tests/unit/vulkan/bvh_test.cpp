// The trees that our own tracer walks, as they are uploaded: every triangle once, in boxes that hold it, within what a
// traversal's stack holds.
#include "renderer/vulkan/scene/bvh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

#include "tests/support/edited_scenes.h"
#include "tests/unit/vulkan/traced_scenes.h"

namespace helio::test {
namespace {

using namespace vulkan;

// Box of a node's child, exactly as the shader has it.
void child_box(const BvhNode& node, int child, V3d& lower, V3d& upper) {
  for (int axis = 0; axis < 3; ++axis) {
    const double unit = std::ldexp(1.0, int(node.exponents >> 8 * axis & 255) - 127);
    lower[axis] = double(node.origin[axis]) + unit * (node.lower[axis] >> 8 * child & 255);
    upper[axis] = double(node.origin[axis]) + unit * (node.upper[axis] >> 8 * child & 255);
  }
}

class Walk {
 public:
  Walk(const SceneBvh& bvh, const SceneGeometry& geometry) : bvh_(bvh), geometry_(geometry) {}

  // How often each (part, primitive) and each instance was found.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> primitives;
  std::map<std::uint32_t, int> instances;

  // The most references that a traversal below keeps on its stack.
  std::uint32_t visit(std::uint32_t reference, const V3d& lower, const V3d& upper) {
    if ((reference & kBvhLeaf) == 0) {
      const BvhNode& node = bvh_.nodes.at(reference);
      std::uint32_t children = 0, deepest = 0;
      for (int i = 0; i < 4; ++i) {
        if (node.children[i] == kBvhEmpty) continue;
        ++children;
        V3d low, high;
        child_box(node, i, low, high);
        deepest = std::max(deepest, visit(node.children[i], low, high));
      }
      EXPECT_GE(children, 2u);
      return deepest + children - 1;
    }
    if ((reference & kBvhInstance) == kBvhInstance) {
      const std::uint32_t number = reference & kBvhInstanceMask;
      ++instances[number];
      const V3d everything(1e30, 1e30, 1e30);
      return Walk(bvh_, geometry_).visit(geometry_.instances.at(number).bvh_root, -everything, everything);
    }
    for (std::uint32_t i = 0; i < (reference >> kBvhCountShift & kBvhCountMask); ++i) {
      const BvhTriangle& triangle = bvh_.triangles.at((reference & kBvhFirstMask) + i);
      ++primitives[{triangle.part & kBvhPartMask, triangle.primitive}];
      if (triangle.part & kBvhSphere) {
        expect_inside(triangle.a - V3f(triangle.b.x), lower, upper);
        expect_inside(triangle.a + V3f(triangle.b.x), lower, upper);
      } else {
        for (const V3f& corner : {triangle.a, triangle.b, triangle.c}) expect_inside(corner, lower, upper);
      }
    }
    return 0;
  }

 private:
  static void expect_inside(const V3f& point, const V3d& lower, const V3d& upper) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(double(point[axis]), lower[axis]);
      EXPECT_LE(double(point[axis]), upper[axis]);
    }
  }

  const SceneBvh& bvh_;
  const SceneGeometry& geometry_;
};

std::size_t primitive_count(const SceneGeometry& geometry, std::uint32_t first, std::uint32_t count) {
  std::size_t primitives = 0;
  for (std::uint32_t part = first; part < first + count; ++part) {
    if (geometry.traced[part]) primitives += geometry.meshes[part] ? geometry.meshes[part]->triangle_count() : 1;
  }
  return primitives;
}

void expect_sound(const SceneData& scene) {
  SceneGeometry geometry = make_geometry(scene);
  const auto bvh = build_bvh(geometry);
  ASSERT_TRUE(bvh.ok()) << bvh.error().to_string();
  const V3d everything(1e30, 1e30, 1e30);
  Walk walk(*bvh, geometry);
  EXPECT_LE(walk.visit(geometry.tables.bvh_root, -everything, everything), kBvhStackSize);
  EXPECT_EQ(walk.primitives.size(), primitive_count(geometry, 0, geometry.flat_count));
  EXPECT_EQ(walk.instances.size(), geometry.instances.size());
  for (const auto& [primitive, times] : walk.primitives) EXPECT_EQ(times, 1);
  for (const auto& [instance, times] : walk.instances) EXPECT_EQ(times, 1);
  for (std::size_t i = 0; i < geometry.instances.size(); ++i) {
    const InstanceTable& instance = geometry.instances[i];
    Walk below(*bvh, geometry);
    below.visit(instance.bvh_root, -everything, everything);
    EXPECT_EQ(below.primitives.size(), primitive_count(geometry, instance.first_part, geometry.part_counts[i]));
    for (const auto& [primitive, times] : below.primitives) EXPECT_EQ(times, 1);
  }
}

TEST(VulkanBvh, HoldsEverythingOnce) {
  for (const float scale : {1.0f, 1e-4f, 1e6f}) expect_sound(build(mixed_scene(scale))->impl());
}

TEST(VulkanBvh, LeavesOutWhatAnEditHasMoved) {
  const auto scene = edited(build(mixed_scene(1)), {SceneEdit(moved_by(1, V3d(-1, 0.5, 0.3)))});
  const SceneGeometry geometry = make_geometry(scene->impl());
  EXPECT_EQ(std::count(geometry.traced.begin(), geometry.traced.end(), false), 1);
  expect_sound(scene->impl());
}

TEST(VulkanBvh, HoldsOneTriangleAndNone) {
  SceneDescription description;
  description.materials = {lambert(Rgb(1, 1, 1))};
  {
    const auto scene = build(description);
    SceneGeometry geometry = make_geometry(scene->impl());
    ASSERT_TRUE(build_bvh(geometry).ok());
    EXPECT_EQ(geometry.tables.bvh_root, kBvhEmpty);
  }
  TriangleMesh mesh = quad(V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0), 0);
  mesh.indices.resize(3);
  add_mesh(description, mesh);
  const auto scene = build(description);
  SceneGeometry geometry = make_geometry(scene->impl());
  ASSERT_TRUE(build_bvh(geometry).ok());
  EXPECT_EQ(geometry.tables.bvh_root, kBvhLeaf | 1u << kBvhCountShift);
}

TEST(VulkanBvh, StopsWhenCancelled) {
  CancelToken cancel;
  cancel.cancel();
  const auto scene = build(mixed_scene(1));
  SceneGeometry geometry = make_geometry(scene->impl());
  const auto bvh = build_bvh(geometry, {.cancel = &cancel});
  ASSERT_FALSE(bvh.ok());
  EXPECT_EQ(bvh.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace helio::test
