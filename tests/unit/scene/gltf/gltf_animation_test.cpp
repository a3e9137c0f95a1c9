// Node transforms, animations at a moment, skins.
#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

V3d origin_of(const Instance& instance) {
  return {instance.to_world[3][0], instance.to_world[3][1], instance.to_world[3][2]};
}

void expect_near(const V3d& actual, const V3d& expected, double tolerance = 1e-6) {
  EXPECT_LT(length(actual - expected), tolerance) << actual << " instead of " << expected;
}

TEST(GltfNodes, Hierarchy) {
  GltfBuilder file;
  file.add_triangle();
  // Parent: moved by (10 0 0), turned by 90 degrees about z, scaled by 2. Child: moved by (1 0 0) in the parent.
  // Child's origin: scale -> (2 0 0), turn -> (0 2 0), move -> (10 2 0).
  file.root["nodes"] = json::parse(R"([
    {"translation": [10, 0, 0], "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "scale": [2, 2, 2],
     "children": [1]},
    {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1]}])");
  file.root["scenes"][0]["nodes"] = {0};
  const SceneDescription scene = file.must_load();
  ASSERT_EQ(scene.instances.size(), 1u);
  expect_near(origin_of(scene.instances[0]), {10, 2, 0});
  // The child's point (0 1 0) -> (1 1 0) -> (2 2 0) -> (-2 2 0) -> (8 2 0).
  expect_near(V3d(0, 1, 0) * scene.instances[0].to_world, {8, 2, 0});
  EXPECT_EQ(scene.instances[0].name, "node 1");
}

// A triangle under an animated node: times 1, 2, 4, and the given outputs.
GltfBuilder animated(const char* path, const char* type, const std::vector<float>& output, const char* interpolation) {
  GltfBuilder file;
  file.add_triangle();
  const int input = file.add_accessor<float>({1, 2, 4}, "SCALAR", {{"min", {1}}, {"max", {4}}});
  file.root["animations"] = {
      {{"samplers",
        {{{"input", input}, {"output", file.add_accessor(output, type)}, {"interpolation", interpolation}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}}}}};
  return file;
}

V3d position_at(const GltfBuilder& file, double time) {
  SceneLoadOptions options;
  options.time_s = time;
  return origin_of(file.must_load(options).instances.at(0));
}

TEST(GltfAnimation, LinearAndStepClampAtTheEnds) {
  const std::vector<float> keys = {0, 0, 0, 10, 0, 0, 10, 20, 0};
  const GltfBuilder linear = animated("translation", "VEC3", keys, "LINEAR");
  expect_near(position_at(linear, -5), {0, 0, 0});
  expect_near(position_at(linear, 0), {0, 0, 0});
  expect_near(position_at(linear, 1.25), {2.5, 0, 0});  // a quarter from 1 to 2
  expect_near(position_at(linear, 2), {10, 0, 0});
  expect_near(position_at(linear, 3.5), {10, 15, 0});  // three quarters from 2 to 4
  expect_near(position_at(linear, 100), {10, 20, 0});
  const GltfBuilder step = animated("translation", "VEC3", keys, "STEP");
  expect_near(position_at(step, 1.99), {0, 0, 0});
  expect_near(position_at(step, 2), {10, 0, 0});
  expect_near(position_at(step, 3.99), {10, 0, 0});
  expect_near(position_at(step, 4), {10, 20, 0});
}

TEST(GltfAnimation, CubicSpline) {
  // Per key in-tangent, value, out-tangent. Between keys 2 s (value 1, out 3) and 4 s (value 5, in -1), at 3 s:
  // t = .5, td = 2: .5 * 1 + 2 * .125 * 3 + .5 * 5 + 2 * -.125 * -1 = .5 + .75 + 2.5 + .25 = 4.
  const GltfBuilder file = animated("translation", "VEC3", {0,  0, 0, 0, 0, 0, 0, 0, 0,  //
                                                            0,  0, 0, 1, 0, 0, 3, 0, 0,  //
                                                            -1, 0, 0, 5, 0, 0, 0, 0, 0},
                                    "CUBICSPLINE");
  expect_near(position_at(file, 3), {4, 0, 0});
  expect_near(position_at(file, 2), {1, 0, 0});
  expect_near(position_at(file, 9), {5, 0, 0});
}

TEST(GltfAnimation, RotationsTakeTheShortArc) {
  // From 0 to 90 degrees about z, given with the opposite sign (the same rotation): halfway is 45 degrees, not 225.
  const float h = std::sqrt(0.5f);
  GltfBuilder file = animated("rotation", "VEC4", {0, 0, 0, 1, 0, 0, -h, -h, 0, 0, h, h}, "LINEAR");
  SceneLoadOptions options;
  options.time_s = 1.5;
  const SceneDescription scene = file.must_load(options);
  expect_near(V3d(1, 0, 0) * scene.instances.at(0).to_world, {std::sqrt(0.5), std::sqrt(0.5), 0});
}

TEST(GltfAnimation, ScaleAndMorphWeights) {
  GltfBuilder scale = animated("scale", "VEC3", {1, 1, 1, 3, 3, 3, 3, 3, 3}, "LINEAR");
  SceneLoadOptions options;
  options.time_s = 1.5;
  expect_near(V3d(1, 0, 0) * scale.must_load(options).instances.at(0).to_world, {2, 0, 0});

  GltfBuilder morph = animated("weights", "SCALAR", {0, 1, 1}, "LINEAR");
  morph.root["meshes"][0]["primitives"][0]["targets"] = {
      {{"POSITION", morph.add_positions({0, 0, 8, 0, 0, 8, 0, 0, 8})}}};
  EXPECT_EQ(morph.must_load(options).objects.at(0).meshes.at(0).positions[0], V3f(0, 0, 4));
}

// Clips are alternatives. "Walk" moves the node to x = 1, "Jump" to y = 9 and makes it 3 times as large.
GltfBuilder two_clips() {
  GltfBuilder file = animated("translation", "VEC3", {1, 0, 0, 1, 0, 0, 1, 0, 0}, "LINEAR");
  json jump = file.root["animations"][0];
  jump["samplers"][0]["output"] = file.add_accessor<float>({0, 9, 0, 0, 9, 0, 0, 9, 0}, "VEC3");
  jump["samplers"].push_back(jump["samplers"][0]);
  jump["samplers"][1]["output"] = file.add_accessor<float>({3, 3, 3, 3, 3, 3, 3, 3, 3}, "VEC3");
  jump["channels"].push_back({{"sampler", 1}, {"target", {{"node", 0}, {"path", "scale"}}}});
  file.root["animations"][0]["name"] = "Walk";
  jump["name"] = "Jump";
  file.root["animations"].push_back(jump);
  return file;
}

TEST(GltfAnimation, OneOfSeveralClipsPlays) {
  const GltfBuilder file = two_clips();
  const auto play = [&](const std::string& animation) {
    SceneLoadOptions options;
    options.time_s = 1;
    options.animation = animation;
    return file.must_load(options);
  };
  for (const char* walk : {"", "Walk", "0"}) {
    const SceneDescription scene = play(walk);
    expect_near(V3d(1, 0, 0) * scene.instances.at(0).to_world, {2, 0, 0});
    EXPECT_EQ(scene.animation, "Walk") << walk;
    EXPECT_EQ(scene.animations, (std::vector<std::string>{"Walk", "Jump"}));
    EXPECT_TRUE(contains(scene.report.notices, "\"Walk\" is played; the others, not played: \"Jump\""));
  }
  for (const char* jump : {"Jump", "1"}) {
    const SceneDescription scene = play(jump);
    expect_near(V3d(1, 0, 0) * scene.instances.at(0).to_world, {3, 9, 0});
    EXPECT_EQ(scene.animation, "Jump");
  }
}

TEST(GltfAnimation, UnknownClipsAreRefused) {
  GltfBuilder file = two_clips();
  SceneLoadOptions options;
  options.animation = "Run";
  EXPECT_TRUE(contains(file.must_fail(options), "test.glb/animations: there is no animation \"Run\", allowed: \"Walk\", "
                                                "\"Jump\", or a number from 0 to 1"))
      << file.must_fail(options);
  for (int i = 0; i < 40; ++i) file.root["animations"].push_back(file.root["animations"][0]);
  EXPECT_TRUE(contains(file.must_fail(options), " and 26 more"));
  file.root.erase("animations");
  EXPECT_TRUE(contains(file.must_fail(options), "the file has none"));
}

TEST(GltfAnimation, ClipsThatMoveNothingAreNotTheFirst) {
  GltfBuilder file = two_clips();
  file.root["animations"].insert(file.root["animations"].begin(),
                                 json{{"name", "Take 001"}, {"channels", json::array()}, {"samplers", json::array()}});
  SceneDescription scene = file.must_load();
  EXPECT_EQ(scene.animation, "Walk");
  EXPECT_TRUE(contains(scene.report.notices, "not played: \"Take 001\", \"Jump\""));
  SceneLoadOptions options;
  options.animation = "Take 001";  // the pose at rest
  expect_near(origin_of(file.must_load(options).instances.at(0)), {0, 0, 0});
  file.root["animations"] = json::array({file.root["animations"][0]});
  scene = file.must_load();
  EXPECT_EQ(scene.animation, "");
  // Those without a name get one.
  GltfBuilder nameless = two_clips();
  nameless.root["animations"][1].erase("name");
  options.animation = "animation 1";
  EXPECT_EQ(nameless.must_load(options).animation, "animation 1");
}

// glTF#1314: a scale of 0 hides. What looks somewhere goes on doing so: scale does not change it.
TEST(GltfNodes, LightsAndCamerasUnderScalesOfZeroKeepTheirDirection) {
  const float h = std::sqrt(0.5f);
  for (const json& scale : {json{0, 0, 0}, json{1, 1, 0}, json{0, 1, 1}}) {
    GltfBuilder file;
    file.use("KHR_lights_punctual");
    file.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "directional"}}};
    file.root["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}])");
    // The parent turns -z to -x; the child moves in it, where there is no room.
    file.add_node({{"scale", scale}, {"rotation", {0, h, 0, h}}, {"translation", {5, 6, 7}}, {"children", {1}}});
    file.root["nodes"].push_back(
        {{"camera", 0}, {"scale", {0, 0, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    const SceneDescription scene = file.must_load();
    ASSERT_EQ(scene.lights.size(), 1u) << scale;
    expect_near(V3d(scene.lights[0].direction), {-1, 0, 0});
    ASSERT_EQ(scene.cameras.size(), 1u);
    const M44d& m = scene.cameras[0].to_world;
    expect_near(V3d(-m[2][0], -m[2][1], -m[2][2]), {-1, 0, 0});
    expect_near(V3d(m[3][0], m[3][1], m[3][2]), {5, 6, 7});
  }
}

TEST(GltfNodes, ScalesTellWhetherAFlatPlacementMirrors) {
  GltfBuilder file;
  file.add_triangle();
  const auto mirrored = [&](json parent, json child) {
    file.root["nodes"] = {{{"scale", std::move(parent)}, {"children", {1}}}, {{"mesh", 0}, {"scale", std::move(child)}}};
    return file.must_load().instances.at(0).flat_mirrored;
  };
  EXPECT_FALSE(mirrored({1, 1, 0}, {1, 1, 1}));
  EXPECT_TRUE(mirrored({-1, 1, 0}, {1, 1, 1}));
  EXPECT_FALSE(mirrored({-1, 1, 0}, {1, -2, 0}));
  EXPECT_TRUE(mirrored({-1, -1, -1}, {1, 1, 0}));
}

TEST(GltfAnimation, NodesTimesTargetsAreHeldToTheMemoryLimit) {
  // 30,000 nodes of a mesh with 6,000 targets would be 720 MB of weights, for a file of 0.5 MB.
  GltfBuilder file;
  file.add_triangle();
  json& primitive = file.root["meshes"][0]["primitives"][0];
  for (int i = 0; i < 6000; ++i) primitive["targets"].push_back({{"POSITION", 0}});
  for (int i = 0; i < 30000; ++i) file.add_node({{"mesh", 0}});
  const auto scene = file.load();
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::resource_exhausted) << scene.error().to_string();
}

TEST(GltfAnimation, BrokenOnesAreRefused) {
  GltfBuilder order = animated("translation", "VEC3", std::vector<float>(9), "LINEAR");
  order.root["animations"][0]["samplers"][0]["input"] = order.add_accessor<float>({1, 3, 2}, "SCALAR");
  EXPECT_TRUE(contains(order.must_fail(), "key 2 is at 2.000000 s"));
  GltfBuilder count = animated("translation", "VEC3", std::vector<float>(6), "LINEAR");
  EXPECT_TRUE(contains(count.must_fail(), "has 2 output elements for 3 keys, expected 3"));
  GltfBuilder cubic = animated("translation", "VEC3", std::vector<float>(9), "CUBICSPLINE");
  EXPECT_TRUE(contains(cubic.must_fail(), "expected 9"));
  GltfBuilder unit = animated("rotation", "VEC4", std::vector<float>(12, 1.0f), "LINEAR");
  EXPECT_TRUE(contains(unit.must_fail(), "rotation 0 has length 2.0"));
  GltfBuilder matrix = animated("translation", "VEC3", std::vector<float>(9), "LINEAR");
  matrix.root["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_TRUE(contains(matrix.must_fail(), "which cannot be animated"));
}

// A triangle bound to two joints: nodes 1 (at the origin) and 2 (its child, moved by (0 2 0)).
GltfBuilder skinned() {
  GltfBuilder file;
  file.add_triangle();
  json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
  attributes["NORMAL"] = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  attributes["JOINTS_0"] = file.add_accessor<std::uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}, "VEC4");
  // First vertex: joint 0. Second: both halves, given unnormalised. Third: joint 1.
  attributes["WEIGHTS_0"] = file.add_accessor<float>({1, 0, 0, 0, 2, 2, 0, 0, 1, 0, 0, 0}, "VEC4");
  // Bind pose: joint 1 at (0 2 0), so that its inverse moves by (0 -2 0).
  file.root["skins"] = {
      {{"joints", {1, 2}},
       {"inverseBindMatrices", file.add_accessor<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1,
                                                         1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -2, 0, 1},
                                                        "MAT4")}}};
  file.root["nodes"][0]["skin"] = 0;
  file.add_node({{"children", {2}}});
  file.root["nodes"].push_back({{"translation", {0, 2, 0}}});
  return file;
}

std::vector<V3d> world_positions(const SceneDescription& scene) {
  std::vector<V3d> result;
  const Instance& instance = scene.instances.at(0);
  for (const V3f& p : scene.objects.at(std::size_t(instance.object)).meshes.at(0).positions)
    result.push_back(V3d(p) * instance.to_world);
  return result;
}

TEST(GltfSkin, BlendsJoints) {
  GltfBuilder file = skinned();
  // In the bind pose nothing moves, wherever the mesh's own node stands.
  file.root["nodes"][0]["translation"] = {100, 100, 100};
  std::vector<V3d> rest = world_positions(file.must_load());
  expect_near(rest[0], {0, 0, 0});
  expect_near(rest[1], {1, 0, 0});
  expect_near(rest[2], {0, 1, 0});
  // Joint 1 moves on by (0 0 4): the third vertex follows, the second by half.
  file.root["nodes"][2]["translation"] = {0, 2, 4};
  std::vector<V3d> moved = world_positions(file.must_load());
  expect_near(moved[0], {0, 0, 0});
  expect_near(moved[1], {1, 0, 2});
  expect_near(moved[2], {0, 1, 4});
  // The root joint turned by 90 degrees about y: x -> -z, and normals z -> x.
  file.root["nodes"][2]["translation"] = {0, 2, 0};
  file.root["nodes"][1]["rotation"] = {0, std::sqrt(0.5), 0, std::sqrt(0.5)};
  const SceneDescription turned = file.must_load();
  expect_near(world_positions(turned)[1], {0, 0, -1});
  expect_near(V3d(turned.objects.at(0).meshes.at(0).normals[0]), {1, 0, 0});
}

TEST(GltfSkin, FarFromTheOriginKeepsItsShape) {
  // At 1e7 a float's step is 1; the object keeps its positions relative to the first joint.
  GltfBuilder file = skinned();
  file.root["nodes"][1]["translation"] = {1e7, 0, 0};
  const std::vector<V3d> p = world_positions(file.must_load());
  expect_near(p[1] - p[0], {1, 0, 0});
  expect_near(p[2] - p[0], {0, 1, 0});
}

TEST(GltfSkin, MirroringJointsTurnTriangles) {
  GltfBuilder file = skinned();
  file.root["nodes"][1]["scale"] = {-1, 1, 1};
  const SceneDescription scene = file.must_load();
  const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
  const V3f a = mesh.positions[mesh.indices[0]], b = mesh.positions[mesh.indices[1]],
            c = mesh.positions[mesh.indices[2]];
  EXPECT_GT(cross(b - a, c - a).z, 0);  // still counter-clockwise around +z, where the normals point
  for (const V3f& normal : mesh.normals) EXPECT_EQ(normal, V3f(0, 0, 1));
}

// Joints that press the mesh flat: along its normals nothing changes; along x the normals, turned there, lose their
// direction and are those of the triangle that is left.
TEST(GltfSkin, JointsMayPressFlat) {
  for (const json& scale : {json{1, 1, 0}, json{0, 1, 1}}) {
    GltfBuilder file = skinned();
    file.root["nodes"][1]["scale"] = scale;
    json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
    if (scale[0] == 0) {
      attributes["POSITION"] = file.add_positions({0, 0, 0, 1, 0, 2, 0, 1, 0});
      attributes["NORMAL"] = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    }
    const SceneDescription scene = file.must_load();
    const TriangleMesh& mesh = scene.objects.at(0).meshes.at(0);
    const V3f a = mesh.positions[mesh.indices[0]], b = mesh.positions[mesh.indices[1]],
              c = mesh.positions[mesh.indices[2]];
    const V3f normal = cross(b - a, c - a);
    for (const V3f& n : mesh.normals) expect_near(V3d(n), V3d(normal / length(normal)));
  }
}

TEST(GltfSkin, JointsOutsideTheSkinAreRefused) {
  GltfBuilder file = skinned();
  file.root["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] =
      file.add_accessor<std::uint8_t>({0, 1, 0, 0, 0, 2, 0, 0, 1, 0, 0, 0}, "VEC4");
  EXPECT_TRUE(contains(file.must_fail(), "vertex 1 names joint 2 of 2"));
}

}  // namespace
}  // namespace helio::test
