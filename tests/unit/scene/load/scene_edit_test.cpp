// What a list of edits comes to, and what is refused.
#include "renderer/scene/load/scene_edit.h"

#include <gtest/gtest.h>

#include <limits>

namespace helio {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

SceneDescription room() {
  SceneDescription scene;
  for (const char* name : {"Floor", "Lamp", "Glass pane", "twin", "twin"}) {
    scene.materials.emplace_back().name = name;
  }
  scene.materials[2].model = MaterialModel::pane;
  scene.objects.resize(1);
  for (const char* name : {"Table", "Chair"}) {
    scene.instances.emplace_back().name = name;
    scene.instances.back().object = 0;
  }
  scene.lights.emplace_back().name = "Sun";
  scene.lights[0].intensity = Rgb(1, 2, 4);
  scene.environment = Environment{};
  return scene;
}

MaterialEdit colour(EditTarget target, const Rgb& color) {
  MaterialEdit edit;
  edit.target = std::move(target);
  edit.base_color = color;
  return edit;
}

std::string refusal(const std::vector<SceneEdit>& edits, const SceneDescription& scene = room()) {
  const auto changes = resolve_edits(scene, edits);
  if (changes) return "accepted";
  EXPECT_EQ(changes.error().code, ErrorCode::invalid_argument);
  return changes.error().to_string();
}

void expect_refusal(const SceneEdit& edit, const std::vector<std::string>& parts) {
  const std::string text = refusal({edit});
  for (const std::string& part : parts) EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks " << part;
}

TEST(SceneEdit, FindsByNameAndByNumber) {
  const SceneDescription scene = room();
  for (const EditTarget& target : {EditTarget("Lamp"), EditTarget(1u)}) {
    const auto changes = resolve_edits(scene, std::vector<SceneEdit>{colour(target, Rgb(0.5f, 0.25f, 0))});
    ASSERT_TRUE(changes.ok()) << changes.error().to_string();
    ASSERT_EQ(changes->materials.size(), 1u);
    EXPECT_EQ(changes->materials.at(1).to.base_color, Rgb(0.5f, 0.25f, 0));
    EXPECT_EQ(changes->materials.at(1).from.base_color, Rgb(1, 1, 1));
    EXPECT_EQ(changes->materials.at(1).to.roughness, scene.materials[1].roughness);
  }
}

TEST(SceneEdit, EditsApplyInOrder) {
  M44d up, twice;
  up[3][1] = 2;
  twice[0][0] = twice[1][1] = twice[2][2] = 2;
  const std::vector<SceneEdit> edits = {LightEdit{"Sun", std::nullopt, 3}, LightEdit{0u, std::nullopt, 2},
                                        EnvironmentEdit{Rgb(1, 2, 3), 0.5}, ObjectEdit{"Table", up, false},
                                        ObjectEdit{"Table", twice, true}};
  const auto changes = resolve_edits(room(), edits);
  ASSERT_TRUE(changes.ok()) << changes.error().to_string();
  EXPECT_EQ(changes->lights.at(0).to, Rgb(6, 12, 24));  // 3 and then 2 times (1, 2, 4)
  EXPECT_EQ(changes->environment->to, Rgb(0.5f, 1, 1.5f));
  // Up by 2, and then everything twice as far from the origin.
  EXPECT_EQ(changes->transforms.at(0).to[3][1], 4);
  EXPECT_EQ(changes->transforms.at(0).to[0][0], 2);
}

TEST(SceneEdit, WhatChangesNothingIsLeftOut) {
  const auto changes =
      resolve_edits(room(), std::vector<SceneEdit>{colour("Floor", Rgb(1, 1, 1)), LightEdit{"Sun", Rgb(1, 2, 4), 1}});
  ASSERT_TRUE(changes.ok());
  EXPECT_TRUE(changes->empty());
}

TEST(SceneEdit, GlossinessKeepsItsBitsUnlessEdited) {
  SceneDescription scene = room();
  Material& m = scene.materials[0];
  m.model = MaterialModel::specular_glossiness;
  m.glossiness = 1e-9f;  // 1 - (1 - 1e-9) is 0 in float
  auto changes = resolve_edits(scene, std::vector<SceneEdit>{colour("Floor", Rgb(0, 0, 0))});
  set_material_values(changes->materials.at(0).to, m);
  EXPECT_EQ(m.glossiness, 1e-9f);
  MaterialEdit rough;
  rough.target = "Floor";
  rough.roughness = 0.25f;
  changes = resolve_edits(scene, std::vector<SceneEdit>{rough});
  set_material_values(changes->materials.at(0).to, m);
  EXPECT_EQ(m.glossiness, 0.75f);
}

TEST(SceneEdit, UnknownNamesListNearOnes) {
  expect_refusal(colour("lamp", Rgb(0, 0, 0)), {"edits[0].material.name", "no material 'lamp'", "'Lamp'"});
  const std::string text = refusal({colour("Flor", Rgb(0, 0, 0))});
  EXPECT_LT(text.find("'Floor'"), text.find("'Lamp'")) << text;  // the nearest first
  expect_refusal(colour("twin", Rgb(0, 0, 0)), {"2 materials are called 'twin'", "3, 4"});
  expect_refusal(colour(5u, Rgb(0, 0, 0)), {"edits[0].material.index", "5", "[0, 4]"});
  expect_refusal(LightEdit{"Moon", std::nullopt, 2}, {"edits[0].light.name", "'Sun'"});
  expect_refusal(ObjectEdit{"chair", M44d(), false}, {"edits[0].object.name", "'Chair'"});
  SceneDescription empty = room();
  empty.lights.clear();
  empty.environment.reset();
  EXPECT_NE(refusal({LightEdit{0u, std::nullopt, 2}}, empty).find("has no point, spot or directional lights"),
            std::string::npos);
  EXPECT_NE(refusal({EnvironmentEdit{std::nullopt, 2}}, empty).find("environment"), std::string::npos);
}

TEST(SceneEdit, ValuesOutOfRangeAreRefused) {
  for (const float bad : {-1e-30f, 1.0001f, kNan, kInf, 1e9f}) {
    expect_refusal(colour("Floor", Rgb(0, bad, 0)), {"edits[0].material.base_color", "[0, 1]"});
    MaterialEdit rough;
    rough.target = "Floor";
    rough.roughness = bad;
    expect_refusal(rough, {"edits[0].material.roughness", "[0, 1]"});
  }
  for (const float bad : {-1e-30f, kNan, kInf}) {
    MaterialEdit shine;
    shine.target = "Floor";
    shine.emission = Rgb(1, 1, bad);
    expect_refusal(shine, {"edits[0].material.emission", "finite and at least 0"});
    expect_refusal(LightEdit{"Sun", Rgb(bad, 0, 0), 1}, {"edits[0].light.intensity"});
    expect_refusal(LightEdit{"Sun", std::nullopt, double(bad)}, {"edits[0].light.scale"});
    expect_refusal(EnvironmentEdit{Rgb(bad, 0, 0), 1}, {"edits[0].environment.radiance"});
  }
  expect_refusal(LightEdit{"Sun", std::nullopt, 1e38}, {"edits[0].light.scale", "too large"});
  M44d broken;
  broken[3][1] = double(kNan);
  expect_refusal(ObjectEdit{"Table", broken, false}, {"edits[0].object.transform", "row 1, column 3"});
  // What floats hold is allowed, zero and denormals included.
  EXPECT_EQ(refusal({colour("Floor", Rgb(0, 1e-42f, 1)), LightEdit{"Sun", Rgb(0, 1e-42f, 3e38f), 1}}), "accepted");
}

TEST(SceneEdit, WhatAMaterialHasNotCannotBeEdited) {
  MaterialEdit rough;
  rough.target = "Glass pane";
  rough.roughness = 0.5f;
  expect_refusal(rough, {"edits[0].material.roughness", "model pane"});
  MaterialEdit nothing;
  nothing.target = "Floor";
  expect_refusal(nothing, {"edits[0].material", "changes nothing"});
  expect_refusal(LightEdit{"Sun", std::nullopt, 1}, {"edits[0].light", "changes nothing"});
}

TEST(SceneEdit, EveryProblemIsToldAtOnce) {
  const std::string text = refusal({colour("Nobody", Rgb(2, 0, 0)), LightEdit{7u, std::nullopt, -1}});
  for (const char* part :
       {"edits[0].material.name", "edits[0].material.base_color", "edits[1].light.index", "edits[1].light.scale"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  EXPECT_NE(refusal({}).find("[1, 1024]"), std::string::npos);
  EXPECT_NE(refusal(std::vector<SceneEdit>(1025, colour(0u, Rgb(0, 0, 0)))).find("1025 edits"), std::string::npos);
}

TEST(SceneEdit, ChangesMergeAndCancelOut) {
  SceneDescription scene = room();
  const auto edited = [&](const SceneEdit& edit) {
    auto changes = resolve_edits(scene, std::vector<SceneEdit>{edit});
    for (const auto& [i, change] : changes->materials) set_material_values(change.to, scene.materials[i]);
    for (const auto& [i, change] : changes->lights) scene.lights[i].intensity = change.to;
    for (const auto& [i, change] : changes->transforms) scene.instances[i].to_world = change.to;
    return *changes;
  };
  M44d up;
  up[3][1] = 1;
  SceneChanges all = edited(colour(0u, Rgb(0, 0, 0)));
  all = merge_changes(all, edited(LightEdit{0u, std::nullopt, 2}));
  all = merge_changes(all, edited(colour(0u, Rgb(0.5f, 0, 0))));
  all = merge_changes(all, edited(ObjectEdit{0u, up, false}));
  EXPECT_EQ(all.materials.at(0).from.base_color, Rgb(1, 1, 1));
  EXPECT_EQ(all.materials.at(0).to.base_color, Rgb(0.5f, 0, 0));
  EXPECT_EQ(all.lights.at(0).to, Rgb(2, 4, 8));
  // Back to what was loaded: only the object that moved is still told of.
  all = merge_changes(all, edited(colour(0u, Rgb(1, 1, 1))));
  all = merge_changes(all, edited(LightEdit{0u, Rgb(1, 2, 4), 1}));
  all = merge_changes(all, edited(ObjectEdit{0u, M44d(), false}));
  EXPECT_TRUE(all.materials.empty());
  EXPECT_TRUE(all.lights.empty());
  ASSERT_EQ(all.transforms.size(), 1u);
  EXPECT_EQ(all.transforms.at(0).to, all.transforms.at(0).from);
}

}  // namespace
}  // namespace helio
