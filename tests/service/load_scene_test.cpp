// LoadScene, ListScenes, UnloadScene: good and bad uploads, paths and roots.
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "service_fixture.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

class LoadSceneTest : public ServiceTest {
 protected:
  void SetUp() override {
    directory_ = fs::temp_directory_path() / ("helio-load-" + std::to_string(getpid()) + "-" +
                                              testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(directory_ / "root/sub");
    fs::create_directories(directory_ / "outside");
    write("root/quad.gltf", quad_gltf(2));
    write("root/sub/quad.gltf", quad_gltf(3));
    write("outside/secret.gltf", quad_gltf(4));
    fs::create_symlink(directory_ / "outside/secret.gltf", directory_ / "root/link.gltf");
    fs::create_directory_symlink(directory_ / "outside", directory_ / "root/linked");
    start([&](ServerConfig& config) {
      config.scene_roots = {directory_ / "root"};
      config.max_scene_bytes = 1 << 20;
    });
  }
  void TearDown() override {
    ServiceTest::TearDown();
    fs::remove_all(directory_);
  }

  void write(const std::string& name, const std::string& text) { std::ofstream(directory_ / name) << text; }

  grpc::Status load_path(const std::string& path, pb::LoadSceneResponse* response = nullptr,
                         const std::string& environment = "") {
    pb::LoadSceneRequest request;
    request.mutable_begin()->set_path(path);
    request.mutable_begin()->set_environment(environment);
    pb::LoadSceneResponse ignored;
    return load({request}, response ? response : &ignored);
  }
  grpc::Status upload(const std::vector<pb::LoadSceneRequest>& messages) {
    pb::LoadSceneResponse response;
    return load(messages, &response);
  }
  int scenes() {
    pb::ListScenesResponse list;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &list).ok());
    return list.scenes_size();
  }

  fs::path directory_;
};

TEST_F(LoadSceneTest, UploadTellsWhatWasFound) {
  pb::LoadSceneResponse response;
  const grpc::Status status = load(Upload().messages(), &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.scene().scene_id().size(), 64u);
  EXPECT_EQ(response.scene().triangles(), 2u);
  EXPECT_EQ(response.scene().instanced_triangles(), 2u);
  EXPECT_EQ(response.scene().meshes(), 1u);
  EXPECT_EQ(response.scene().instances(), 1u);
  ASSERT_EQ(response.scene().cameras_size(), 1);
  EXPECT_EQ(response.scene().cameras(0).name(), "front");
  EXPECT_DOUBLE_EQ(response.scene().cameras(0).view().position().z(), 3);
  EXPECT_NEAR(response.scene().cameras(0).view().vertical_fov(), 0.8, 1e-6);
  EXPECT_GT(response.scene().memory_bytes(), 0u);
  EXPECT_DOUBLE_EQ(response.scene().bounds_max().x(), 1);
  EXPECT_FALSE(response.already_loaded());
  EXPECT_EQ(scenes(), 1);
}

TEST_F(LoadSceneTest, TexturesAreBilinear) {
  pb::LoadSceneResponse first, named;
  std::vector<pb::LoadSceneRequest> messages = Upload().messages();
  ASSERT_TRUE(load(messages, &first).ok());
  messages[0].mutable_begin()->set_texture_filter(pb::TEXTURE_FILTER_BILINEAR);
  ASSERT_TRUE(load(messages, &named).ok());
  EXPECT_TRUE(named.already_loaded());
  const std::string allowed = "; allowed: TEXTURE_FILTER_BILINEAR (1), or 0";
  for (const auto& [filter, shown] : {std::pair(2, "TEXTURE_FILTER_MIP (2)"), {7, "7"}}) {
    messages[0].mutable_begin()->set_texture_filter(static_cast<pb::TextureFilter>(filter));
    expect_status(upload({messages[0]}), grpc::StatusCode::INVALID_ARGUMENT,
                  {"begin.texture_filter: " + std::string(shown) + allowed});
  }
}

// The square, in two clips at x = 1 and x = 2, with 300 cameras and 300 slips more.
std::string long_lists_gltf() {
  auto gltf = nlohmann::json::parse(quad_gltf(2));
  gltf["buffers"].push_back({{"byteLength", 32},
                             {"uri", "data:application/octet-stream;base64,"
                                     "AAAAAAAAgD8AAIA/AAAAAAAAAAAAAABAAAAAAAAAAAA="}});  // 0 1; 1 0 0; 2 0 0
  for (const auto& [offset, length] : {std::pair(0, 4), std::pair(8, 12), std::pair(20, 12)})
    gltf["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", offset}, {"byteLength", length}});
  gltf["accessors"].push_back(
      {{"bufferView", 2}, {"componentType", 5126}, {"count", 1}, {"type", "SCALAR"}, {"min", {0}}, {"max", {0}}});
  for (const int view : {3, 4})
    gltf["accessors"].push_back({{"bufferView", view}, {"componentType", 5126}, {"count", 1}, {"type", "VEC3"}});
  for (const auto& [name, output] : {std::pair("Near", 3), std::pair("Far", 4)})
    gltf["animations"].push_back({{"name", name},
                                  {"samplers", {{{"input", 2}, {"output", output}}}},
                                  {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}});
  for (int i = 0; i < 300; ++i) {
    gltf["nodes"].push_back({{"camera", 0},
                             {"name", "camera " + std::to_string(i)},
                             {"translation", {0, 0, 3 + i}},
                             {"children", nlohmann::json::array()}});
    gltf["scenes"][0]["nodes"].push_back(gltf["nodes"].size() - 1);
  }
  return gltf.dump();
}

TEST_F(LoadSceneTest, AnimationIsPartOfTheScene) {
  Upload upload;
  upload.bytes = long_lists_gltf();
  const auto load_clip = [&](const std::string& animation, pb::LoadSceneResponse* response) {
    std::vector<pb::LoadSceneRequest> messages = upload.messages();
    messages[0].mutable_begin()->set_animation(animation);
    return load(messages, response);
  };
  pb::LoadSceneResponse first, far, again;
  ASSERT_TRUE(load_clip("", &first).ok());
  ASSERT_TRUE(load_clip("Far", &far).ok());
  ASSERT_TRUE(load_clip("Far", &again).ok());
  EXPECT_EQ(first.scene().animation(), "Near");
  EXPECT_DOUBLE_EQ(first.scene().bounds_max().x(), 2);
  EXPECT_EQ(far.scene().animation(), "Far");
  EXPECT_DOUBLE_EQ(far.scene().bounds_max().x(), 3);
  EXPECT_NE(first.scene().scene_id(), far.scene().scene_id());
  EXPECT_TRUE(again.already_loaded());
  EXPECT_EQ(first.scene().animation_total(), 2u);
  ASSERT_EQ(first.scene().animations_size(), 2);
  EXPECT_EQ(first.scene().animations(1), "Far");
  pb::LoadSceneResponse none;
  expect_status(load_clip("Jump", &none), grpc::StatusCode::INVALID_ARGUMENT, {"/animations", "\"Near\", \"Far\""});
  expect_status(load_clip(std::string(5000, 'a'), &none), grpc::StatusCode::INVALID_ARGUMENT, {"begin.animation"});
  // From disk, too, another clip is another scene.
  write("root/clips.gltf", long_lists_gltf());
  pb::LoadSceneRequest request;
  request.mutable_begin()->set_path("clips.gltf");
  ASSERT_TRUE(load({request}, &first).ok());
  request.mutable_begin()->set_animation("Far");
  ASSERT_TRUE(load({request}, &far).ok());
  EXPECT_FALSE(far.already_loaded());
}

TEST_F(LoadSceneTest, CutListsSayHowManyThereAreAndCamerasComeInPages) {
  Upload upload;
  upload.bytes = long_lists_gltf();
  pb::LoadSceneResponse response;
  const grpc::Status status = load(upload.messages(), &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.warnings_total(), 300u);
  ASSERT_EQ(response.warnings_size(), 65);
  EXPECT_EQ(response.warnings(64), "and 236 more like these");
  EXPECT_EQ(response.scene().camera_total(), 301u);
  ASSERT_EQ(response.scene().cameras_size(), 256);
  pb::ListScenesRequest page;
  page.set_scene_id(response.scene().scene_id());
  page.set_first_camera(256);
  pb::ListScenesResponse rest;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListScenes, page, &rest).ok());
  ASSERT_EQ(rest.scenes_size(), 1);
  ASSERT_EQ(rest.scenes(0).cameras_size(), 45);
  EXPECT_EQ(rest.scenes(0).cameras(44).name(), "camera 299");
  EXPECT_DOUBLE_EQ(rest.scenes(0).cameras(44).view().position().z(), 302);
  page.set_scene_id("none");
  expect_status(call(&pb::RenderService::Stub::ListScenes, page, &rest), grpc::StatusCode::NOT_FOUND, {"scene_id"});
  page.clear_scene_id();
  expect_status(call(&pb::RenderService::Stub::ListScenes, page, &rest), grpc::StatusCode::INVALID_ARGUMENT,
                {"first_camera: 256 without scene_id"});
}

TEST_F(LoadSceneTest, StrictLoadsRefuseSlipsAlsoOfScenesThatAreLoaded) {
  Upload upload, clean;
  upload.bytes = long_lists_gltf();
  pb::LoadSceneResponse response;
  std::vector<pb::LoadSceneRequest> messages = upload.messages();
  ASSERT_TRUE(load(messages, &response).ok());
  messages[0].mutable_begin()->set_strict(true);
  expect_status(load(messages, &response), grpc::StatusCode::INVALID_ARGUMENT,
                {"/nodes/2/children: is empty", "/nodes/3/children: is empty"});
  // A file without slips is the same scene, strict or not.
  ASSERT_TRUE(load(clean.messages(), &response).ok());
  messages = clean.messages();
  messages[0].mutable_begin()->set_strict(true);
  ASSERT_TRUE(load(messages, &response).ok());
  EXPECT_TRUE(response.already_loaded());
}

TEST_F(LoadSceneTest, AStrictDaemonRefusesSlips) {
  ServiceTest::TearDown();
  start([](ServerConfig& config) { config.strict = true; });
  Upload upload;
  upload.bytes = long_lists_gltf();
  expect_status(this->upload(upload.messages()), grpc::StatusCode::INVALID_ARGUMENT, {"/nodes/2/children: is empty"});
  EXPECT_TRUE(this->upload(Upload().messages()).ok());
}

TEST_F(LoadSceneTest, SameBytesAndOptionsAreTheSameScene) {
  pb::LoadSceneResponse first, again, elsewhere;
  ASSERT_TRUE(load(Upload().messages(), &first).ok());
  ASSERT_TRUE(load(Upload().messages(), &again).ok());
  EXPECT_TRUE(again.already_loaded());
  EXPECT_EQ(again.scene().scene_id(), first.scene().scene_id());
  EXPECT_EQ(scenes(), 1);
  Upload other;
  other.environment = "1,1,1";
  ASSERT_TRUE(load(other.messages(), &elsewhere).ok());
  EXPECT_FALSE(elsewhere.already_loaded());
  EXPECT_NE(elsewhere.scene().scene_id(), first.scene().scene_id());
}

TEST_F(LoadSceneTest, PathIsLoadedOnceUntilItsBytesChange) {
  pb::LoadSceneResponse first, again, changed;
  const grpc::Status status = load_path("quad.gltf", &first);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_TRUE(load_path((directory_ / "root/quad.gltf").string(), &again).ok());
  EXPECT_TRUE(again.already_loaded());
  write("root/quad.gltf", quad_gltf(5));
  ASSERT_TRUE(load_path("quad.gltf", &changed).ok());
  EXPECT_FALSE(changed.already_loaded());
  EXPECT_NE(changed.scene().scene_id(), first.scene().scene_id());
  EXPECT_TRUE(load_path("sub/quad.gltf").ok());
}

TEST_F(LoadSceneTest, PathsStayBelowTheRoots) {
  using grpc::StatusCode;
  const std::string outside = (directory_ / "outside/secret.gltf").string();
  expect_status(load_path("../outside/secret.gltf"), StatusCode::PERMISSION_DENIED,
                {"begin.path", "outside the scene"});
  expect_status(load_path("sub/../../outside/secret.gltf"), StatusCode::PERMISSION_DENIED, {"begin.path"});
  expect_status(load_path(outside), StatusCode::PERMISSION_DENIED, {"begin.path"});
  expect_status(load_path("link.gltf"), StatusCode::PERMISSION_DENIED, {"begin.path"});
  expect_status(load_path("linked/secret.gltf"), StatusCode::PERMISSION_DENIED, {"begin.path"});
  // Whether something exists outside is not told.
  expect_status(load_path("../outside/nothing.gltf"), StatusCode::PERMISSION_DENIED, {"begin.path"});
  expect_status(load_path("/etc/passwd"), StatusCode::PERMISSION_DENIED, {"begin.path"});
  expect_status(load_path("nothing.gltf"), StatusCode::NOT_FOUND, {"begin.path", "nothing.gltf"});
  expect_status(load_path("sub"), StatusCode::NOT_FOUND, {"begin.path"});
  expect_status(load_path(std::string(5000, 'a')), StatusCode::INVALID_ARGUMENT, {"begin.path", "4096"});
  expect_status(load_path("quad.gltf", nullptr, "../outside/map.exr"), StatusCode::PERMISSION_DENIED,
                {"begin.environment"});
  expect_status(load_path("quad.gltf", nullptr, "missing.exr"), StatusCode::NOT_FOUND, {"begin.environment"});
  EXPECT_EQ(scenes(), 0);
}

TEST_F(LoadSceneTest, HalfUploadsAndWrongSizesAreRefused) {
  using grpc::StatusCode;
  const Upload good;
  pb::LoadSceneRequest half = good.data(), more = good.data(), short_total = good.begin(), long_total = good.begin();
  half.mutable_data()->resize(half.data().size() / 2);
  more.mutable_data()->append("x");
  short_total.mutable_begin()->set_total_bytes(good.bytes.size() - 1);
  long_total.mutable_begin()->set_total_bytes(good.bytes.size() + 1);
  const std::string size = std::to_string(good.bytes.size());
  expect_status(upload({good.begin(), good.begin_file(), half}), StatusCode::INVALID_ARGUMENT,
                {"data", "'quad.gltf'", "of " + size});
  expect_status(upload({good.begin(), good.begin_file()}), StatusCode::INVALID_ARGUMENT, {"0 bytes of " + size});
  expect_status(upload({good.begin()}), StatusCode::INVALID_ARGUMENT, {"begin.total_bytes", "0 arrived"});
  expect_status(upload({good.begin(), good.begin_file(), more}), StatusCode::INVALID_ARGUMENT,
                {"data", size + " were announced"});
  expect_status(upload({short_total, good.begin_file()}), StatusCode::INVALID_ARGUMENT,
                {"begin_file.bytes", size, "begin.total_bytes"});
  expect_status(upload({long_total, good.begin_file(), good.data()}), StatusCode::INVALID_ARGUMENT,
                {"begin.total_bytes", size + " arrived"});
  EXPECT_EQ(scenes(), 0);
}

TEST_F(LoadSceneTest, WrongHashesAreRefused) {
  const Upload good;
  pb::LoadSceneRequest wrong = good.begin_file(), short_hash = good.begin_file();
  wrong.mutable_begin_file()->set_sha256(sha256_of("something else"));
  short_hash.mutable_begin_file()->set_sha256("abc");
  expect_status(upload({good.begin(), wrong, good.data()}), grpc::StatusCode::INVALID_ARGUMENT,
                {"begin_file.sha256", "'quad.gltf'"});
  expect_status(upload({good.begin(), short_hash}), grpc::StatusCode::INVALID_ARGUMENT,
                {"begin_file.sha256", "3 bytes; allowed: 32"});
  EXPECT_EQ(scenes(), 0);
}

TEST_F(LoadSceneTest, OutOfOrderMessagesAreRefused) {
  using grpc::StatusCode;
  const Upload good;
  pb::LoadSceneRequest path;
  path.mutable_begin()->set_path("quad.gltf");
  expect_status(upload({}), StatusCode::INVALID_ARGUMENT, {"before begin"});
  expect_status(upload({good.data()}), StatusCode::INVALID_ARGUMENT, {"first message is not begin"});
  expect_status(upload({good.begin_file()}), StatusCode::INVALID_ARGUMENT, {"first message is not begin"});
  expect_status(upload({good.begin(), good.begin()}), StatusCode::INVALID_ARGUMENT, {"begin: was sent before"});
  expect_status(upload({good.begin(), good.data()}), StatusCode::INVALID_ARGUMENT, {"before any begin_file"});
  expect_status(upload({path, good.begin_file()}), StatusCode::INVALID_ARGUMENT, {"begin_file", "begin.path"});
  expect_status(upload({path, good.data()}), StatusCode::INVALID_ARGUMENT, {"data", "begin.path"});
  expect_status(upload({good.begin(), pb::LoadSceneRequest()}), StatusCode::INVALID_ARGUMENT, {"is empty"});
  EXPECT_EQ(scenes(), 0);
}

TEST_F(LoadSceneTest, EveryWrongFieldIsNamed) {
  using grpc::StatusCode;
  pb::LoadSceneRequest all_wrong;
  all_wrong.mutable_begin()->set_path("quad.gltf");
  all_wrong.mutable_begin()->set_main_file("quad.gltf");
  all_wrong.mutable_begin()->set_total_bytes(5);
  all_wrong.mutable_begin()->set_time_s(std::numeric_limits<double>::quiet_NaN());
  all_wrong.mutable_begin()->set_environment(std::string(5000, 'x'));
  expect_status(upload({all_wrong}), StatusCode::INVALID_ARGUMENT,
                {"begin.main_file", "begin.total_bytes: 5", "begin.time_s: nan", "begin.environment: 5000 bytes"});
  expect_status(upload({pb::LoadSceneRequest()}), StatusCode::INVALID_ARGUMENT, {"first message"});
  pb::LoadSceneRequest nothing;
  nothing.mutable_begin();
  expect_status(upload({nothing}), StatusCode::INVALID_ARGUMENT, {"begin.path", "required"});

  pb::LoadSceneRequest upload_wrong;
  upload_wrong.mutable_begin()->set_main_file("../a");
  upload_wrong.mutable_begin()->set_time_s(std::numeric_limits<double>::infinity());
  upload_wrong.mutable_begin()->set_environment(std::string(5000, 'x'));
  expect_status(upload({upload_wrong}), StatusCode::INVALID_ARGUMENT,
                {"begin.main_file: '../a'", "begin.total_bytes: 0; allowed: [1,", "begin.time_s: inf",
                 "begin.environment: 5000 bytes"});
  for (const char* color : {"nan,1,1", "1e39,1,1", "1,2", "-1,0,0", "  "}) {
    pb::LoadSceneRequest begin = Upload().begin();
    begin.mutable_begin()->set_time_s(std::numeric_limits<double>::quiet_NaN());
    begin.mutable_begin()->set_environment(color);
    expect_status(upload({begin}), StatusCode::INVALID_ARGUMENT, {"begin.time_s: nan", "begin.environment: ", "R,G,B"});
  }

  for (const char* name : {"../x.gltf", "/x.gltf", "a//b", "a/./b", "C:x", "a\\b", "", "a/.."}) {
    Upload bad;
    bad.name = name;
    pb::LoadSceneRequest begin = Upload().begin();
    expect_status(upload({begin, bad.begin_file()}), StatusCode::INVALID_ARGUMENT,
                  {"begin_file.name", "relative path"});
  }
  Upload small;
  small.bytes = "x";
  pb::LoadSceneRequest begin = small.begin();
  begin.mutable_begin()->set_total_bytes(2);
  expect_status(upload({begin, small.begin_file(), small.data(), small.begin_file()}), StatusCode::INVALID_ARGUMENT,
                {"begin_file.name", "sent before"});
  begin.mutable_begin()->set_total_bytes(1);
  begin.mutable_begin()->set_main_file("other.gltf");
  expect_status(upload({begin, small.begin_file(), small.data()}), StatusCode::INVALID_ARGUMENT,
                {"begin.main_file", "'other.gltf'", "not among"});
  EXPECT_EQ(scenes(), 0);
}

TEST_F(LoadSceneTest, BrokenScenesNameFileAndPlaceAndHarmNothing) {
  const std::string good = load_quad();
  Upload broken;
  broken.bytes = quad_gltf();
  broken.bytes.replace(broken.bytes.find("\"count\": 6"), 10, "\"count\": 9");
  expect_status(upload(broken.messages()), grpc::StatusCode::INVALID_ARGUMENT, {"quad.gltf", "accessors"});
  broken.bytes = "this is no glTF";
  expect_status(upload(broken.messages()), grpc::StatusCode::INVALID_ARGUMENT, {"quad.gltf"});
  broken.bytes = quad_gltf();
  broken.bytes.replace(broken.bytes.find("\"extensionsUsed\""), 16,
                       "\"extensionsRequired\": [\"ACME_x\"], \"extensionsUsed\"");
  const grpc::Status unknown = upload(broken.messages());
  expect_status(unknown, grpc::StatusCode::UNIMPLEMENTED, {"ACME_x"});
  Upload environment;
  environment.environment = "1,nan,2";
  expect_status(upload(environment.messages()), grpc::StatusCode::INVALID_ARGUMENT, {"environment"});
  environment.environment = "not-in-the-bundle.exr";
  EXPECT_FALSE(upload(environment.messages()).ok());
  EXPECT_EQ(scenes(), 1);
  EXPECT_FALSE(create_session(good, 16, 16).empty());
}

TEST_F(LoadSceneTest, SceneBytesAreLimited) {
  Upload large;
  pb::LoadSceneRequest begin = large.begin();
  begin.mutable_begin()->set_total_bytes((1 << 20) + 1);
  expect_status(upload({begin}), grpc::StatusCode::RESOURCE_EXHAUSTED,
                {"begin.total_bytes: 1048577", "max_scene_bytes = 1048576"});
  write("root/large.gltf", quad_gltf() + std::string(1 << 20, ' '));
  expect_status(load_path("large.gltf"), grpc::StatusCode::RESOURCE_EXHAUSTED, {"max_scene_bytes"});
}

TEST_F(LoadSceneTest, MessagesAreLimited) {
  const Upload good;
  pb::LoadSceneRequest data;
  data.set_data(std::string(5 << 20, 'x'));
  expect_status(upload({good.begin(), good.begin_file(), data}), grpc::StatusCode::RESOURCE_EXHAUSTED, {"message"});
  Upload long_one;
  long_one.bytes.assign(1 << 20, 'x');
  pb::LoadSceneRequest chunk;
  chunk.set_data(std::string((1 << 20) + 1, 'x'));
  expect_status(upload({long_one.begin(), long_one.begin_file(), chunk}), grpc::StatusCode::INVALID_ARGUMENT,
                {"data", "1048577 bytes; allowed: at most 1048576"});
}

TEST_F(LoadSceneTest, SceneInUseStays) {
  const std::string scene = load_quad();
  const std::string session = create_session(scene, 8, 8);
  pb::UnloadSceneRequest unload;
  pb::UnloadSceneResponse unloaded;
  unload.set_scene_id(scene);
  expect_status(call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded), grpc::StatusCode::FAILED_PRECONDITION,
                {"scene_id", scene, "1 sessions"});
  pb::CloseSessionRequest close;
  pb::CloseSessionResponse closed;
  close.set_session_id(session);
  ASSERT_TRUE(call(&pb::RenderService::Stub::CloseSession, close, &closed).ok());
  EXPECT_TRUE(eventually([&] { return call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded).ok(); }));
  EXPECT_EQ(scenes(), 0);
  expect_status(call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded), grpc::StatusCode::NOT_FOUND, {scene});
  unload.clear_scene_id();
  expect_status(call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded), grpc::StatusCode::INVALID_ARGUMENT,
                {"scene_id: 0 bytes"});
}

TEST_F(LoadSceneTest, KilledUploadLeavesNothingBehind) {
  const Upload good;
  {
    grpc::ClientContext context;
    pb::LoadSceneResponse response;
    auto writer = stub().LoadScene(&context, &response);
    writer->Write(good.begin());
    writer->Write(good.begin_file());
    context.TryCancel();
    EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(load(good.messages(), std::make_unique<pb::LoadSceneResponse>().get()).ok());
  EXPECT_EQ(scenes(), 1);
}

}  // namespace
}  // namespace helio::test
