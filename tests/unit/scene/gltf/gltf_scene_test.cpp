// What a scene is made of: instances, lights, cameras, and what load_scene adds where a file has none.
#include "renderer/scene/description/default_camera.h"
#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

TEST(GltfScene, NodesOfOneMeshShareAnObject) {
  GltfBuilder file;
  file.add_triangle();
  file.add_node({{"mesh", 0}, {"name", "second"}, {"translation", {5, 0, 0}}});
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.objects.size(), 1u);
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[1].name, "second");
  EXPECT_EQ(scene.instances[1].to_world[3][0], 5);
}

TEST(GltfScene, OnlyTheChosenSceneIsLoaded) {
  GltfBuilder file;
  file.add_triangle();
  file.root["nodes"].push_back({{"mesh", 0}, {"name", "other"}});
  file.root["scenes"].push_back({{"nodes", {1}}, {"name", "second"}});
  file.root["scene"] = 1;
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances[0].name, "other");
  EXPECT_EQ(scene.name, "second");
  file.root.erase("scenes");
  file.root.erase("scene");
  EXPECT_EQ(file.must_load().instances.size(), 2u);
}

TEST(GltfScene, LoopsAndSharedChildrenAreRefused) {
  GltfBuilder file;
  file.add_triangle();
  file.root["nodes"] = json::parse(R"([{"children": [1]}, {"children": [2]}, {"children": [0]}])");
  file.root["scenes"][0]["nodes"] = {0};
  EXPECT_TRUE(contains(file.must_fail(), "is its own ancestor"));
  file.root["nodes"] = json::parse(R"([{"children": [1]}, {}, {"children": [1]}])");
  EXPECT_TRUE(contains(file.must_fail(), "/nodes/2/children/0: names node 1, which is already a child of node 0"));
}

TEST(GltfScene, DeepHierarchiesNeedNoStack) {
  GltfBuilder file;
  file.add_triangle();
  constexpr int kDepth = 100000;
  file.root["nodes"] = json::array();
  for (int i = 0; i + 1 < kDepth; ++i)
    file.root["nodes"].push_back({{"children", {i + 1}}, {"translation", {1, 0, 0}}});
  file.root["nodes"].push_back({{"mesh", 0}});
  const SceneDescription scene = file.must_load();
  EXPECT_EQ(scene.instances.at(0).to_world[3][0], kDepth - 1);
}

TEST(GltfScene, TransformsThatOverflowAreRefused) {
  GltfBuilder file;
  file.add_triangle();
  file.root["nodes"][0]["scale"] = {1e200, 1, 1};
  EXPECT_TRUE(contains(file.must_fail(), "/nodes/0: its world transform has a number beyond 1e12"));
}

TEST(GltfScene, GpuInstancing) {
  GltfBuilder file;
  file.use("EXT_mesh_gpu_instancing");
  file.add_triangle();
  const float h = std::sqrt(0.5f);
  file.root["nodes"][0]["translation"] = {100, 0, 0};
  file.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", file.add_accessor<float>({1, 0, 0, 2, 0, 0}, "VEC3")},
      {"ROTATION", file.add_accessor<float>({0, 0, 0, 1, 0, 0, h, h}, "VEC4")},
      {"SCALE", file.add_accessor<float>({1, 1, 1, 3, 3, 3}, "VEC3")},
      {"_ID", file.add_accessor<float>({0, 1}, "SCALAR")}};
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.objects.size(), 1u);
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_LT(length(V3d(1, 0, 0) * scene.instances[0].to_world - V3d(102, 0, 0)), 1e-5);
  // Scaled by 3, turned by 90 degrees about z, moved by 2, then the node's 100: (1 0 0) -> (0 3 0) -> (102 3 0).
  EXPECT_LT(length(V3d(1, 0, 0) * scene.instances[1].to_world - V3d(102, 3, 0)), 1e-5);

  // A count that no bytes back is held to the memory limit: 4e8 instances of some 200 bytes.
  for (auto& accessor : file.root["accessors"]) {
    if (accessor["count"] != 2) continue;
    accessor["count"] = 400000000;
    accessor.erase("bufferView");
  }
  const auto huge = file.load();
  ASSERT_FALSE(huge.ok());
  EXPECT_EQ(huge.error().code, ErrorCode::resource_exhausted) << huge.error().to_string();
}

TEST(GltfScene, PunctualLights) {
  GltfBuilder file;
  file.use("KHR_lights_punctual");
  file.root["extensions"]["KHR_lights_punctual"]["lights"] = json::parse(R"([
    {"type": "point", "color": [1, 0.5, 0], "intensity": 10, "range": 7},
    {"type": "spot", "name": "lamp", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.4}},
    {"type": "directional", "range": 3}])");
  for (int light = 0; light < 3; ++light)
    file.add_node({{"extensions", {{"KHR_lights_punctual", {{"light", light}}}}},
                   {"translation", {1, 2, 3}},
                   {"scale", {5, 5, 5}},
                   {"rotation", {0, std::sqrt(0.5), 0, std::sqrt(0.5)}}});
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.lights.size(), 3u);
  EXPECT_EQ(scene.lights[0].kind, PunctualKind::point);
  EXPECT_EQ(scene.lights[0].position, V3d(1, 2, 3));
  EXPECT_EQ(scene.lights[0].intensity, Rgb(10, 5, 0));  // a node's scale does not change it
  EXPECT_EQ(scene.lights[0].range, 7);
  EXPECT_EQ(scene.lights[1].name, "lamp");
  EXPECT_EQ(scene.lights[1].inner_cone_angle, .1f);
  EXPECT_EQ(scene.lights[1].outer_cone_angle, .4f);
  // -z, turned by 90 degrees about y, is -x.
  EXPECT_LT(length(scene.lights[1].direction - V3f(-1, 0, 0)), 1e-6);
  EXPECT_LT(length(scene.lights[2].direction - V3f(-1, 0, 0)), 1e-6);
  EXPECT_TRUE(std::isinf(scene.lights[2].range));
  EXPECT_FALSE(scene.environment);
}

TEST(GltfScene, Cameras) {
  GltfBuilder file;
  file.add_triangle();
  file.root["cameras"] = json::parse(R"([
    {"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 2, "znear": 0.1}},
    {"type": "orthographic", "name": "ortho", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 10}}])");
  file.add_node({{"camera", 0}, {"name", "view"}, {"translation", {0, 0, 9}}});
  file.add_node({{"camera", 1}});
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.cameras.size(), 2u);
  EXPECT_EQ(scene.cameras[0].name, "view");
  EXPECT_EQ(scene.cameras[0].vertical_fov, .5);
  EXPECT_EQ(scene.cameras[0].aspect, 2);
  EXPECT_EQ(scene.cameras[0].to_world[3][2], 9);
  EXPECT_EQ(scene.cameras[0].lens_radius, 0);
  EXPECT_EQ(scene.cameras[1].name, "ortho");
  EXPECT_EQ(scene.cameras[1].projection, Projection::orthographic);
  EXPECT_EQ(scene.cameras[1].half_height, 2);
  EXPECT_EQ(scene.cameras[1].aspect, 1.5);
}

// Rays of such cameras could not be traced in float.
TEST(GltfScene, CamerasBeyondTheirRangesAreRefusedByName) {
  GltfBuilder file;
  file.add_triangle();
  file.root["cameras"] = json::parse(R"([
    {"type": "orthographic", "orthographic": {"xmag": 1e30, "ymag": -1e-13, "zfar": 1, "znear": 0}},
    {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1},
     "extras": {"heliograph": {"lens_radius": 1e30, "focus_distance": 1e-300}}}])");
  const std::string problems = file.must_fail();
  for (const char* part : {"/cameras/0/orthographic/xmag", "/cameras/0/orthographic/ymag", "1e+30", "[1e-12, 1e12]",
                           "/cameras/1/extras/heliograph/lens_radius", "/cameras/1/extras/heliograph/focus_distance"}) {
    EXPECT_TRUE(contains(problems, part)) << part << ": " << problems;
  }
  GltfBuilder far;
  far.root["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}])");
  far.add_node({{"camera", 0}, {"translation", {1e19, 0, 0}}});
  EXPECT_TRUE(contains(far.must_fail(), "/nodes/0: its world transform has a number beyond 1e12"));
}

TEST(SceneLoader, AddsWhatIsMissing) {
  GltfBuilder file;
  file.add_triangle();
  const SceneDescription scene = file.must_load();
  ASSERT_TRUE(scene.environment);
  EXPECT_EQ(scene.environment->radiance, Rgb(1));
  EXPECT_LT(scene.environment->image, 0);
  EXPECT_TRUE(contains(scene.report.notices, "constant environment of radiance 1"));
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_TRUE(contains(scene.report.notices, "bounding box is framed"));

  // Anything that emits is a light.
  file.root["materials"] = {{{"emissiveFactor", {0, 0, 1}}}};
  file.root["meshes"][0]["primitives"][0]["material"] = 0;
  EXPECT_FALSE(file.must_load().environment);
  SceneLoadOptions options;
  options.environment = "0.5,0.25,0";
  EXPECT_EQ(file.must_load(options).environment->radiance, Rgb(.5f, .25f, 0));
  options.environment = "0.5,nan,0";
  EXPECT_FALSE(file.load(options).ok());
}

// Every corner of the box is inside the square picture, and one comes within the margin of its edge.
TEST(DefaultCamera, FramesTheBox) {
  for (const Box3d& box :
       {Box3d(V3d(-1), V3d(1)), Box3d(V3d(100, 0, 0), V3d(101, 30, 2)), Box3d(V3d(5, 0, 5), V3d(9, 0, 6))}) {
    const CameraDescription camera = frame_bounds(box);
    const M44d to_camera = camera.to_world.inverse();
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const V3d p = V3d(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                        corner & 4 ? box.max.z : box.min.z) *
                    to_camera;
      ASSERT_LT(p.z, 0);
      most = std::max({most, std::abs(p.x / p.z), std::abs(p.y / p.z)});
    }
    const double edge = std::tan(camera.vertical_fov / 2);
    EXPECT_LE(most, edge);
    EXPECT_GT(most, 0.9 * edge);
  }
  EXPECT_GT(length(V3d(0, 0, 0) * frame_bounds(Box3d(V3d(3), V3d(3))).to_world - V3d(3)), 0.5);  // a point
}

}  // namespace
}  // namespace helio::test
