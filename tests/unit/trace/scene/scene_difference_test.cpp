// What edits come to, from values before and after.
#include "renderer/trace/scene/scene_difference.h"

#include <gtest/gtest.h>

#include "tests/support/edited_scenes.h"

namespace helio::test {
namespace {

using enum SurfaceChange;

class SceneDifferenceTest : public testing::Test {
 protected:
  // A lamp besides (material and instance 3), and an object of two materials (4: the lamp's and the floor's).
  static SceneDescription description() {
    SceneDescription scene = yard();
    scene.materials.push_back(lambert(Rgb(0, 0, 0), Rgb(4, 5, 0)));
    add_mesh(scene, quad({0, 3, 0}, {1, 0, 0}, {0, 0, 1}, 3));
    Object two;
    two.meshes = {quad({0, 0, -3}, {1, 0, 0}, {0, 1, 0}, 3), quad({1, 0, -3}, {1, 0, 0}, {0, 1, 0}, 0)};
    add_instance(scene, add_object(scene, two));
    return scene;
  }
  SceneDifference of(const std::vector<SceneEdit>& edits) {
    const auto difference = scene_difference(*base, *edited(base, edits));
    EXPECT_TRUE(difference.has_value());
    return difference.value_or(SceneDifference{});
  }

  std::shared_ptr<const RenderScene> base = build(description());
};

TEST_F(SceneDifferenceTest, NothingIsNothing) {
  EXPECT_TRUE(scene_difference(*base, *base)->empty());
  EXPECT_TRUE(of({}).empty());
  EXPECT_TRUE(of({moved_by(1, {0, 0, 0})}).empty());
  EXPECT_TRUE(of({painted(1, base->description().materials[1].base_color)}).empty());
  const auto there = edited(base, {moved_by(1, {1, 0, 0}), painted(2, Rgb(1, 1, 1))});
  const auto back = edited(there, {ObjectEdit{1u, base->description().instances[1].to_world, false},
                                   painted(2, base->description().materials[2].base_color)});
  EXPECT_TRUE(scene_difference(*base, *back)->empty());
  EXPECT_FALSE(scene_difference(*there, *back)->empty());
}

TEST_F(SceneDifferenceTest, MovesAreOfOneInstance) {
  const SceneDifference d = of({moved_by(1, {0, 0, 0.5})});
  EXPECT_EQ(d.surfaces, (std::vector<SurfaceChange>{none, all, none, none, none}));
  EXPECT_TRUE(d.materials.empty());
  EXPECT_FALSE(d.environment || d.lights || d.brightness);
  EXPECT_TRUE(d.edits_what_shows());
}

TEST_F(SceneDifferenceTest, MaterialsAreOfAllThatShowThem) {
  EXPECT_EQ(of({painted(0, Rgb(1, 0, 0))}).surfaces, (std::vector<SurfaceChange>{all, none, none, none, some}));
  const SceneDifference d = of({shining(3, Rgb(4, 5, 1))});
  EXPECT_EQ(d.surfaces, (std::vector<SurfaceChange>{none, none, none, all, some}));
  EXPECT_EQ(d.materials, (std::vector<bool>{false, false, false, true}));
  EXPECT_FALSE(d.brightness);
}

TEST_F(SceneDifferenceTest, ABlendChangesWithWhatItMixes) {
  SceneDescription scene = yard();
  Material blend;
  blend.model = MaterialModel::blend;
  blend.blend.first = 1;
  blend.blend.second = 2;
  scene.materials.push_back(blend);
  scene.objects[0].meshes[0].material = 3;
  const auto mixed = build(scene);
  const auto d = scene_difference(*mixed, *edited(mixed, {painted(2, Rgb(1, 0, 0))}));
  EXPECT_EQ(d->surfaces, (std::vector<SurfaceChange>{all, none, all}));
}

TEST_F(SceneDifferenceTest, LightsAndEnvironment) {
  const SceneDifference sun = of({LightEdit{0u, std::nullopt, 2}});
  EXPECT_TRUE(sun.lights && sun.surfaces.empty() && !sun.environment && !sun.brightness);
  EXPECT_FALSE(sun.edits_what_shows());
  const SceneDifference sky = of({EnvironmentEdit{std::nullopt, 2}});
  EXPECT_TRUE(sky.environment && sky.surfaces.empty() && !sky.lights && !sky.brightness);
  EXPECT_TRUE(sky.edits_what_shows());
}

TEST_F(SceneDifferenceTest, AllLightsScaledAlikeScaleThePicture) {
  const Rgb factor(2, 0.5f, 3), sky = base->description().environment->radiance * factor;
  const std::vector<SceneEdit> alike = {LightEdit{0u, Rgb(4, 1, 6), 1}, EnvironmentEdit{sky, 1},
                                        shining(3, Rgb(8, 2.5f, 0))};
  const SceneDifference d = of(alike);
  ASSERT_TRUE(d.brightness.has_value());
  EXPECT_FALSE(d.edits_what_shows()) << "scaled exactly";
  for (int c = 0; c < 3; ++c) EXPECT_NEAR((*d.brightness)[c], factor[c], 1e-6f);
  // And nothing else may change, nor one of them otherwise or to nothing.
  auto also = alike;
  also.push_back(painted(1, Rgb(1, 1, 1)));
  EXPECT_FALSE(of(also).brightness);
  also.back() = moved_by(1, {1, 0, 0});
  EXPECT_FALSE(of(also).brightness);
  also = alike;
  also[1] = EnvironmentEdit{sky * 1.001f, 1};
  EXPECT_FALSE(of(also).brightness);
  also[1] = EnvironmentEdit{Rgb(0, 0, 0), 1};
  EXPECT_FALSE(of(also).brightness);
  EXPECT_FALSE(
      of({LightEdit{0u, std::nullopt, 0}, EnvironmentEdit{std::nullopt, 0}, shining(3, Rgb(0, 0, 0))}).brightness);
}

TEST_F(SceneDifferenceTest, LoadsDoNotCompare) {
  EXPECT_FALSE(scene_difference(*base, *build(description())).has_value());
}

}  // namespace
}  // namespace helio::test
