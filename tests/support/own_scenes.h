// The scenes that the project ships, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <string>

#include "renderer/scene/load/scene_loader.h"
#include "tests/support/test_scenes.h"

namespace helio::test {

// A scene's name as part of a test's: letters, digits and underscores.
inline std::string test_name_of(std::string scene) {
  std::replace_if(scene.begin(), scene.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return scene;
}

// Null, with a failure of the test, where scenes/NAME/NAME.gltf cannot be loaded or is complained about.
inline std::shared_ptr<const RenderScene> load_own_scene(const std::string& name) {
  const std::unique_ptr<FileSource> source = make_directory_source(HELIO_SOURCE_DIR "/scenes/" + name);
  Result<SceneDescription> scene = load_scene(*source, name + ".gltf", {});
  if (!scene) {
    ADD_FAILURE() << scene.error().to_string();
    return nullptr;
  }
  EXPECT_TRUE(scene->report.warnings.empty() && scene->report.notices.empty() && scene->report.unread.empty()) << name;
  return build(std::move(*scene));
}

}  // namespace helio::test
