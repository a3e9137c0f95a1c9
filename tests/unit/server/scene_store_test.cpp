#include "server/state/scene_store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "scene_files.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPlenty = 1 << 30;

// So many bytes have the two files of triangle_bundle().
std::uint64_t bundle_bytes() {
  return triangle_gltf().size() + triangle_bin().size();
}

class SceneStoreTest : public testing::Test {
 protected:
  SceneStoreTest() { open({}); }

  // As a daemon that starts does.
  void open(const std::vector<SceneStore::Held>& jobs, std::uint64_t max_bytes = kPlenty) {
    store_ = std::make_unique<SceneStore>(path_, max_bytes);
    const Status opened = store_->open(jobs);
    ASSERT_TRUE(opened.ok()) << opened.error().to_string();
  }
  std::shared_ptr<const LoadedScene> upload(SceneLoads& loads, int glow = 1) {
    const Status kept = store_->keep_upload(triangle_bundle(glow));
    EXPECT_TRUE(kept.ok()) << kept.error().to_string();
    return loads.load(triangle_bundle(glow));
  }
  void hold(const LoadedScene& scene, const std::string& job) {
    const Status held = store_->hold(scene, job);
    EXPECT_TRUE(held.ok()) << held.error().to_string();
  }
  // Loads the scene by its recipe in a daemon that has nothing yet.
  void expect_loads_again(const std::string& scene_id, const std::vector<std::string>& roots = {}) {
    SceneLoads fresh(roots);
    auto recipe = store_->recipe(scene_id, fresh.memory);
    ASSERT_TRUE(recipe) << recipe.error().to_string();
    const auto loaded = fresh.load(std::move(recipe->request));
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->id, recipe->loaded_id);
    if (recipe->changes.empty()) {
      EXPECT_EQ(loaded->id, scene_id);
      return;
    }
    auto lease = fresh.scenes.acquire(loaded->id, "");
    ASSERT_TRUE(lease);
    const auto changed = fresh.scenes.change(*lease, recipe->changes, fresh.never);
    ASSERT_TRUE(changed) << changed.error().to_string();
    EXPECT_EQ(changed->scene->id, scene_id);
  }
  Error error_of(const std::string& scene_id) {
    SceneLoads fresh;
    const auto recipe = store_->recipe(scene_id, fresh.memory);
    EXPECT_FALSE(recipe);
    EXPECT_EQ(fresh.memory.used(), 0u);
    return recipe ? Error() : recipe.error();
  }
  std::size_t files(const std::string& folder) const {
    return std::size_t(std::distance(fs::directory_iterator(path_ + "/" + folder), fs::directory_iterator()));
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "scenes";
  std::unique_ptr<SceneStore> store_;
};

TEST_F(SceneStoreTest, AnUploadIsLoadedAgainAfterARestart) {
  SceneLoads loads;
  const auto scene = upload(loads);
  EXPECT_EQ(store_->bytes(), bundle_bytes());
  hold(*scene, "job");
  open({{"job", scene->id}});
  EXPECT_EQ(store_->bytes(), bundle_bytes());
  SceneLoads fresh;
  {
    const auto recipe = store_->recipe(scene->id, fresh.memory);
    ASSERT_TRUE(recipe);
    EXPECT_EQ(fresh.memory.used(), bundle_bytes());
  }
  EXPECT_EQ(fresh.memory.used(), 0u);
  expect_loads_again(scene->id);
}

TEST_F(SceneStoreTest, FilesWithTheSameBytesAreKeptOnce) {
  ASSERT_TRUE(store_->keep_upload(triangle_bundle(1)).ok());
  ASSERT_TRUE(store_->keep_upload(triangle_bundle(2)).ok());
  ASSERT_TRUE(store_->keep_upload(triangle_bundle(1)).ok());
  EXPECT_EQ(files("blobs"), 3u);
  EXPECT_EQ(store_->bytes(), 2 * triangle_gltf().size() + triangle_bin().size());
}

// Two edits, one after the other, are loaded again as what they came to together.
TEST_F(SceneStoreTest, AnEditedSceneIsEditedAgain) {
  SceneLoads loads;
  const auto scene = upload(loads);
  M44d place;
  place[3][0] = 1.0 / 3;
  MaterialEdit material;
  material.target = "light";
  material.emission = Rgb(0.1f, 5, 0.7f);
  const auto moved = loads.edit(scene->id, {ObjectEdit{"tri", place, false}});
  const auto edited = loads.edit(moved->id, {material});
  ASSERT_TRUE(edited);
  hold(*edited, "job");
  open({{"job", edited->id}});
  expect_loads_again(edited->id);
  SceneLoads fresh;
  const auto recipe = store_->recipe(edited->id, fresh.memory);
  EXPECT_EQ(recipe->loaded_id, scene->id);
  EXPECT_EQ(recipe->changes.transforms.at(0).to, place);
  EXPECT_EQ(recipe->changes.materials.at(0).to.emission, Rgb(0.1f, 5, 0.7f));
}

TEST_F(SceneStoreTest, AnEditedSceneFromDiskIsEditedAgain) {
  write_file(folder_ / "triangle.gltf", triangle_gltf());
  write_file(folder_ / "triangle.bin", triangle_bin());
  SceneLoads loads({folder_.path()});
  SceneRequest request;
  request.files = std::string("triangle.gltf");
  request.environment = "0.5,0.25,1";
  const auto scene = loads.load(std::move(request));
  ASSERT_TRUE(scene);
  EnvironmentEdit sky;
  sky.scale = 3;
  const auto edited = loads.edit(scene->id, {sky});
  hold(*edited, "job");
  EXPECT_EQ(store_->bytes(), 0u);
  open({{"job", edited->id}});
  expect_loads_again(edited->id, {folder_.path()});
  // The scene as it was loaded has its own recipe.
  EXPECT_EQ(int(error_of(scene->id).code), int(ErrorCode::not_found));
}

TEST_F(SceneStoreTest, AFileFromDiskThatChangedIsNamed) {
  write_file(folder_ / "triangle.gltf", triangle_gltf());
  write_file(folder_ / "triangle.bin", triangle_bin());
  SceneLoads loads({folder_.path()});
  const auto scene = loads.load("triangle.gltf");
  ASSERT_TRUE(scene);
  hold(*scene, "job");
  expect_loads_again(scene->id, {folder_.path()});

  std::string changed = triangle_bin();
  changed[0] = 1;
  write_file(folder_ / "triangle.bin", changed);
  Error error = error_of(scene->id);
  EXPECT_EQ(int(error.code), int(ErrorCode::failed_precondition));
  EXPECT_EQ(error.where, fs::canonical(folder_ / "triangle.bin").string());
  EXPECT_NE(error.message.find("has changed since the job was submitted"), std::string::npos) << error.message;
  fs::remove(folder_ / "triangle.bin");
  error = error_of(scene->id);
  EXPECT_EQ(error.where, fs::canonical(folder_.path()).string() + "/triangle.bin");
  EXPECT_NE(error.message.find("gone"), std::string::npos) << error.message;
  write_file(folder_ / "triangle.bin", triangle_bin());
  expect_loads_again(scene->id, {folder_.path()});
}

TEST_F(SceneStoreTest, ABlobThatChangedOrIsGoneIsNamedAndHealed) {
  SceneLoads loads;
  const auto scene = upload(loads);
  hold(*scene, "job");
  const std::string blob = path_ + "/blobs/" + to_hex(scene->manifest.files.at("triangle.bin"));
  std::string damaged = read_file(blob);
  damaged[5] = char(damaged[5] ^ 4);
  write_file(blob, damaged);
  Error error = error_of(scene->id);
  EXPECT_EQ(int(error.code), int(ErrorCode::failed_precondition));
  EXPECT_NE(error.message.find("'triangle.bin' of the scene's upload is damaged"), std::string::npos) << error.message;
  // The next upload writes it anew.
  ASSERT_TRUE(store_->keep_upload(triangle_bundle()).ok());
  expect_loads_again(scene->id);

  fs::remove(blob);
  error = error_of(scene->id);
  EXPECT_NE(error.message.find("'triangle.bin' of the scene's upload is gone"), std::string::npos) << error.message;
  ASSERT_TRUE(store_->keep_upload(triangle_bundle()).ok());
  expect_loads_again(scene->id);

  // The same when it goes while no daemon runs.
  fs::remove(blob);
  open({{"job", scene->id}});
  EXPECT_EQ(store_->bytes(), triangle_gltf().size());
  ASSERT_TRUE(store_->keep_upload(triangle_bundle()).ok());
  EXPECT_EQ(store_->bytes(), bundle_bytes());
  expect_loads_again(scene->id);
  store_->release("job");
  open({}, bundle_bytes());
  EXPECT_TRUE(store_->keep_upload(triangle_bundle(3)).ok()) << "the released files are still needed";
}

TEST_F(SceneStoreTest, ADamagedRecipeIsTold) {
  SceneLoads loads;
  const auto scene = upload(loads);
  hold(*scene, "job");
  const std::string file = path_ + "/recipes/" + scene->id, bytes = read_file(file);
  write_file(file, bytes.substr(0, bytes.size() / 2));
  Error error = error_of(scene->id);
  EXPECT_EQ(int(error.code), int(ErrorCode::internal));
  EXPECT_NE(error.to_string().find(file + ": the recipe is damaged"), std::string::npos) << error.to_string();
  // One of another scene under this name.
  const auto other = upload(loads, 2);
  hold(*other, "job 2");
  fs::copy_file(path_ + "/recipes/" + other->id, file, fs::copy_options::overwrite_existing);
  error = error_of(scene->id);
  EXPECT_NE(error.message.find(other->id), std::string::npos) << error.message;
  // The daemon starts all the same, and who holds the scene again writes it anew.
  open({{"job", scene->id}, {"job 2", other->id}});
  write_file(file, "x");
  open({{"job", scene->id}, {"job 2", other->id}});
  ASSERT_TRUE(store_->keep_upload(triangle_bundle()).ok());
  hold(*scene, "job 3");
  expect_loads_again(scene->id);
  EXPECT_EQ(int(error_of("no id").code), int(ErrorCode::not_found));
  EXPECT_EQ(int(error_of("../../etc/passwd").code), int(ErrorCode::not_found));
}

TEST_F(SceneStoreTest, WhatIsNotKeptCannotBeHeld) {
  SceneLoads loads;
  const auto scene = loads.load(triangle_bundle());
  const Status refused = store_->hold(*scene, "job");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(int(refused.error().code), int(ErrorCode::failed_precondition));
  EXPECT_NE(refused.error().message.find("of the scene's upload is not kept"), std::string::npos);
  EXPECT_EQ(files("recipes"), 0u);
}

// Room for two bundles beside the buffer that all share: the third takes the place of the one that was used longest
// ago, and of none that a job needs.
TEST_F(SceneStoreTest, TheLongestUnusedGoFirst) {
  const std::uint64_t gltf = triangle_gltf().size(), bin = triangle_bin().size();
  open({}, 2 * gltf + bin);
  SceneLoads loads;
  const auto first = upload(loads, 1), second = upload(loads, 2);
  ASSERT_TRUE(store_->keep_upload(triangle_bundle(1)).ok());  // used again
  const auto third = upload(loads, 3);
  EXPECT_EQ(store_->bytes(), 2 * gltf + bin);
  EXPECT_EQ(files("blobs"), 3u);
  EXPECT_FALSE(store_->hold(*second, "job 2").ok());
  hold(*first, "job 1");
  const auto fourth = upload(loads, 4);
  EXPECT_FALSE(store_->hold(*third, "job 3").ok());
  hold(*fourth, "job 4");
  // Both places are needed now.
  const Status full = store_->keep_upload(triangle_bundle(5));
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(int(full.error().code), int(ErrorCode::resource_exhausted));
  EXPECT_NE(full.error().message.find("max_state_scene_bytes"), std::string::npos) << full.error().message;
  EXPECT_EQ(store_->bytes(), 2 * gltf + bin);
  expect_loads_again(first->id);
  expect_loads_again(fourth->id);
  // Until a job ends.
  store_->release("job 1");
  EXPECT_TRUE(store_->keep_upload(triangle_bundle(5)).ok());
  EXPECT_EQ(int(error_of(first->id).code), int(ErrorCode::not_found));
  expect_loads_again(fourth->id);
}

TEST_F(SceneStoreTest, TheOrderOfUseSurvivesARestart) {
  const std::uint64_t gltf = triangle_gltf().size(), bin = triangle_bin().size();
  SceneLoads loads;
  const auto first = upload(loads, 1), second = upload(loads, 2);
  // A clock tick apart.
  const auto place = [&](const LoadedScene& scene) {
    return path_ + "/blobs/" + to_hex(scene.manifest.files.at("triangle.gltf"));
  };
  fs::last_write_time(place(*first), fs::file_time_type::clock::now() - std::chrono::hours(1));
  fs::last_write_time(place(*second), fs::file_time_type::clock::now() - std::chrono::hours(2));
  open({}, 2 * gltf + bin);
  ASSERT_TRUE(store_->keep_upload(triangle_bundle(3)).ok());
  EXPECT_TRUE(fs::exists(place(*first)));
  EXPECT_FALSE(fs::exists(place(*second)));
}

TEST_F(SceneStoreTest, AHoldLastsAsLongAsAnyOfItsJobs) {
  SceneLoads loads;
  const auto scene = upload(loads);
  hold(*scene, "a");
  hold(*scene, "b");
  EXPECT_EQ(files("recipes"), 1u);
  store_->release("a");
  store_->release("unknown");
  open({{"b", scene->id}}, bundle_bytes());
  EXPECT_FALSE(store_->keep_upload(triangle_bundle(2)).ok());
  expect_loads_again(scene->id);
  store_->release("b");
  EXPECT_EQ(files("recipes"), 0u);
  EXPECT_TRUE(store_->keep_upload(triangle_bundle(2)).ok());
}

// A second job of a scene needs nothing of the disk: the recipe's file may even be gone meanwhile.
TEST_F(SceneStoreTest, FurtherJobsCostNoAccessToTheDisk) {
  SceneLoads loads;
  const auto scene = upload(loads);
  hold(*scene, "a");
  fs::remove_all(path_);
  hold(*scene, "b");
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(SceneStoreTest, OpeningRemovesWhatNobodyNeeds) {
  SceneLoads loads;
  const auto first = upload(loads, 1), second = upload(loads, 2);
  hold(*first, "a");
  hold(*second, "b");
  write_file(path_ + "/blobs/" + std::string(64, 'a') + ".tmp-1-2", "half of a blob");
  open({{"b", second->id}});
  EXPECT_EQ(files("recipes"), 1u);
  EXPECT_EQ(files("blobs"), 3u);
  EXPECT_EQ(int(error_of(first->id).code), int(ErrorCode::not_found));
  expect_loads_again(second->id);
}

TEST_F(SceneStoreTest, AFailedWriteLeavesNothing) {
  fs::remove_all(path_ + "/blobs");
  const Status refused = store_->keep_upload(triangle_bundle());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(int(refused.error().code), int(ErrorCode::unavailable));
  EXPECT_EQ(store_->bytes(), 0u);
  fs::create_directory(path_ + "/blobs");
  SceneLoads loads;
  const auto scene = upload(loads);
  fs::remove_all(path_ + "/recipes");
  const Status not_held = store_->hold(*scene, "job");
  ASSERT_FALSE(not_held.ok());
  EXPECT_EQ(int(not_held.error().code), int(ErrorCode::unavailable));
  // The files are free to go.
  fs::create_directory(path_ + "/recipes");
  open({}, bundle_bytes());
  EXPECT_TRUE(store_->keep_upload(triangle_bundle(2)).ok());

  write_file(folder_ / "file", "");
  SceneStore nowhere(folder_ / "file/scenes", kPlenty);
  EXPECT_EQ(int(nowhere.open({}).error().code), int(ErrorCode::unavailable));
}

TEST_F(SceneStoreTest, ThreadsShareIt) {
  SceneLoads loads;
  std::vector<std::shared_ptr<const LoadedScene>> scenes;
  for (int glow = 1; glow <= 4; ++glow) scenes.push_back(loads.load(triangle_bundle(glow)));
  std::vector<std::jthread> threads;
  for (int thread = 0; thread < 8; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = 0; i < 20; ++i) {
        const int which = (thread + i) % 4;
        const std::string job = std::to_string(thread) + "-" + std::to_string(i);
        EXPECT_TRUE(store_->keep_upload(triangle_bundle(which + 1)).ok());
        hold(*scenes[std::size_t(which)], job);
        if (i % 3 != 0) store_->release(job);
      }
    });
  }
  threads.clear();
  EXPECT_EQ(store_->bytes(), 4 * triangle_gltf().size() + triangle_bin().size());
  for (const auto& scene : scenes) expect_loads_again(scene->id);
}

// The registry's half of it.
TEST(SceneChange, IsTheEditThatItCameFrom) {
  SceneLoads loads;
  const auto scene = loads.load(triangle_bundle());
  MaterialEdit material;
  material.target = 0u;
  material.emission = Rgb(2, 3, 4);
  const auto edited = loads.edit(scene->id, {material});
  auto lease = loads.scenes.acquire(scene->id, "");
  const auto same = loads.scenes.change(*lease, edited->changes, loads.never);
  ASSERT_TRUE(same);
  EXPECT_TRUE(same->already_loaded);
  EXPECT_EQ(same->scene, edited);
  SceneChanges beyond;
  beyond.materials[1] = {};
  beyond.lights[0] = {Rgb(1), Rgb(2)};
  beyond.environment = Changed<Rgb>{Rgb(1), Rgb(2)};
  const auto refused = loads.scenes.change(*lease, beyond, loads.never);
  ASSERT_FALSE(refused);
  EXPECT_EQ(int(refused.error().code), int(ErrorCode::invalid_argument));
  for (const char* part : {"changes.materials: number 1; the scene has 1", "changes.lights: number 0; the scene has 0",
                           "changes.environment"}) {
    EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;
  }
}

}  // namespace
}  // namespace helio::test
