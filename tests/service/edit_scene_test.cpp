// EditScene: new scenes that share memory, their ids, their end, and sessions that switch to them.
#include <algorithm>
#include <utility>

#include "renderer/codec/tile_codec.h"
#include "server/scenes/scene_registry.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

pb::SceneEdit emission(double radiance) {
  pb::SceneEdit edit;
  edit.mutable_material()->set_index(0);
  for (const auto set : {&pb::Vec3::set_x, &pb::Vec3::set_y, &pb::Vec3::set_z}) {
    (edit.mutable_material()->mutable_emission()->*set)(radiance);
  }
  return edit;
}

pb::SceneEdit moved(double x) {
  pb::SceneEdit edit;
  pb::ObjectEdit& object = *edit.mutable_object();
  object.set_index(0);
  for (const double number : {1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}) object.add_transform(number);
  return edit;
}

class EditSceneTest : public ServiceTest {
 protected:
  grpc::Status edit(const std::string& scene, const std::vector<pb::SceneEdit>& edits,
                    pb::EditSceneResponse* response) {
    pb::EditSceneRequest request;
    request.set_scene_id(scene);
    for (const pb::SceneEdit& one : edits) *request.add_edits() = one;
    return call(&pb::RenderService::Stub::EditScene, request, response);
  }
  pb::EditSceneResponse edited(const std::string& scene, const std::vector<pb::SceneEdit>& edits) {
    pb::EditSceneResponse response;
    const grpc::Status status = edit(scene, edits, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  grpc::Status unload(const std::string& scene) {
    pb::UnloadSceneRequest request;
    request.set_scene_id(scene);
    pb::UnloadSceneResponse response;
    return call(&pb::RenderService::Stub::UnloadScene, request, &response);
  }
  bool holds(const std::string& scene) {
    pb::ListScenesResponse list;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &list).ok());
    return std::any_of(list.scenes().begin(), list.scenes().end(),
                       [&](const pb::SceneInfo& info) { return info.scene_id() == scene; });
  }
};

// Red of the middle pixel of a 32x32 picture, from the tiles of this revision.
float middle(const std::vector<pb::StreamResponse>& messages, std::uint64_t revision) {
  float red = -1;
  for (const auto& message : messages) {
    if (!message.has_tile() || !message.tile().final() || message.tile().tag().revision() != revision) continue;
    const std::string& exr = message.tile().exr();
    const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(exr.data()), exr.size()}, 1 << 20);
    EXPECT_TRUE(tile.ok());
    const PixelRect window = tile->header.data_window;
    if (!window.contains(16, 16)) continue;
    red = (*tile->find("R"))[std::size_t(16 - window.y0) * std::size_t(window.width()) + std::size_t(16 - window.x0)];
  }
  return red;
}

TEST_F(EditSceneTest, AnswersASceneOfItsOwnThatSharesMemory) {
  start();
  const std::string base = load_quad(1);
  const pb::EditSceneResponse brighter = edited(base, {emission(3)});
  EXPECT_NE(brighter.scene().scene_id(), base);
  EXPECT_EQ(brighter.scene().scene_id().size(), base.size());
  EXPECT_EQ(brighter.scene().edited_from(), base);
  EXPECT_FALSE(brighter.already_there());
  EXPECT_TRUE(brighter.shares_bvh());
  EXPECT_GT(brighter.scene().own_bytes(), 0u);
  EXPECT_LT(brighter.scene().own_bytes(), brighter.scene().memory_bytes());
  EXPECT_TRUE(holds(base));
  const pb::EditSceneResponse away = edited(base, {moved(0.5)});
  EXPECT_FALSE(away.shares_bvh());
  EXPECT_NEAR(away.scene().bounds_min().x(), -0.5, 1e-6);  // the square reaches from -1 to 1
}

TEST_F(EditSceneTest, TheSameValuesAreTheSameScene) {
  start();
  const std::string base = load_quad(1);
  const std::string bright = edited(base, {emission(3)}).scene().scene_id();
  const pb::EditSceneResponse again = edited(base, {emission(3)});
  EXPECT_EQ(again.scene().scene_id(), bright);
  EXPECT_TRUE(again.already_there());
  EXPECT_EQ(edited(base, {emission(7), emission(3)}).scene().scene_id(), bright);
  // In steps, by way of another value, and from another object's edit.
  const std::string dim = edited(base, {emission(0.5)}).scene().scene_id();
  EXPECT_NE(dim, bright);
  EXPECT_EQ(edited(dim, {emission(3)}).scene().scene_id(), bright);
  const std::string both = edited(base, {emission(3), moved(0.5)}).scene().scene_id();
  EXPECT_EQ(edited(edited(base, {moved(0.5)}).scene().scene_id(), {emission(3)}).scene().scene_id(), both);
  EXPECT_NE(edited(base, {emission(3), moved(0.25)}).scene().scene_id(), both);
  // Back to what was loaded.
  const pb::EditSceneResponse back = edited(bright, {emission(1)});
  EXPECT_EQ(back.scene().scene_id(), base);
  EXPECT_TRUE(back.already_there());
}

TEST_F(EditSceneTest, BadEditsAreRefused) {
  start();
  const std::string base = load_quad();
  pb::EditSceneResponse response;
  expect_status(edit("none", {emission(1)}, &response), StatusCode::NOT_FOUND, {"scene_id", "none"});
  expect_status(edit("", {}, &response), StatusCode::INVALID_ARGUMENT,
                {"scene_id: 0 bytes", "edits: 0 edits; allowed: [1, 1024]"});
  expect_status(edit(base, {pb::SceneEdit()}, &response), StatusCode::INVALID_ARGUMENT,
                {"edits[0]", "object, material, light"});
  pb::SceneEdit nobody, short_transform, unknown;
  nobody.mutable_material()->set_roughness(0.5);
  short_transform.mutable_object()->set_index(0);
  short_transform.mutable_object()->add_transform(1);
  unknown.mutable_light()->set_name("Sun");
  unknown.mutable_light()->set_scale(2);
  expect_status(edit(base, {nobody, short_transform}, &response), StatusCode::INVALID_ARGUMENT,
                {"edits[0].material: has no target", "edits[1].object.transform: 1 numbers; allowed: 12"});
  expect_status(
      edit(base, {unknown, emission(-1)}, &response), StatusCode::INVALID_ARGUMENT,
      {"edits[0].light.name: 'Sun'; the scene has no point, spot or directional lights", "edits[1].material.emission"});
  expect_status(edit(base, {emission(-1e-300)}, &response), StatusCode::INVALID_ARGUMENT, {"at least 0"});
  expect_status(edit(base, {emission(1e300)}, &response), StatusCode::INVALID_ARGUMENT, {"finite"});
  pb::SceneEdit flat = moved(0);
  flat.mutable_object()->set_transform(0, 0);
  expect_status(edit(base, {flat}, &response), StatusCode::INVALID_ARGUMENT, {"object 0", "flattens"});
}

TEST_F(EditSceneTest, TheSceneIsFreeOnceItsEditIsAnswered) {
  start();
  std::string scene = load_quad(0.25);
  for (int i = 0; i < 200; ++i) {
    const std::string next = edited(scene, {emission(1 + float(i))}).scene().scene_id();
    const auto status = unload(scene);
    ASSERT_TRUE(status.ok()) << "edit " << i << ": " << status.error_message();
    scene = next;
  }
}

TEST_F(EditSceneTest, AStreamSwitchesToTheEditedScene) {
  start();
  const std::string base = load_quad(0.25);
  const std::string session = create_session(base, 32, 32, 4);
  StreamClient client(stub(), session);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  EXPECT_EQ(client.reader().messages()[0].opened().scene_id(), base);
  const auto ended = [](std::uint64_t revision) {
    return [revision](const pb::StreamResponse& message) {
      return message.has_frame_end() && message.frame_end().tag().revision() >= revision &&
             message.frame_end().reason() == pb::END_REASON_SAMPLES;
    };
  };
  std::uint64_t revision = session_info(session).revision();
  EXPECT_EQ(middle(client.reader().messages(), revision), 0.25f);

  const std::string bright = edited(base, {emission(3)}).scene().scene_id();
  pb::StreamRequest request;
  request.mutable_scene()->set_scene_id(bright);
  ASSERT_TRUE(client.send(request));
  ASSERT_TRUE(client.reader().wait_for(ended(revision + 1)));
  revision = session_info(session).revision();
  EXPECT_EQ(middle(client.reader().messages(), revision), 3.0f);  // and no sample of the other scene
  EXPECT_EQ(session_info(session).scene_id(), bright);
  expect_status(unload(bright), StatusCode::FAILED_PRECONDITION, {"used by 1 sessions and jobs"});

  // The same by UpdateSession, to a scene where the square has gone to the side.
  const std::string away = edited(bright, {moved(40)}).scene().scene_id();
  pb::UpdateSessionRequest update;
  update.set_session_id(session);
  update.set_scene_id(away);
  pb::UpdateSessionResponse updated;
  ASSERT_TRUE(call(&pb::RenderService::Stub::UpdateSession, update, &updated).ok());
  ASSERT_TRUE(client.reader().wait_for(ended(updated.revision())));
  EXPECT_EQ(middle(client.reader().messages(), updated.revision()), 0.0f);
  EXPECT_TRUE(unload(bright).ok()) << "nobody uses it any more";
  EXPECT_TRUE(unload(base).ok());
  // What the edited scene shares with them is still there.
  const std::string here = edited(away, {moved(0)}).scene().scene_id();
  update.set_scene_id(here);
  ASSERT_TRUE(call(&pb::RenderService::Stub::UpdateSession, update, &updated).ok());
  ASSERT_TRUE(client.reader().wait_for(ended(updated.revision())));
  EXPECT_EQ(middle(client.reader().messages(), updated.revision()), 3.0f);

  request.mutable_scene()->set_scene_id(base);
  client.send(request);
  expect_status(client.status(), StatusCode::NOT_FOUND, {"scene.scene_id", base});
  EXPECT_EQ(session_info(session).scene_id(), here) << "the session goes on";
}

TEST_F(EditSceneTest, EditedScenesThatNobodyUsesMakeRoom) {
  start([](ServerConfig& config) { config.max_scenes = 3; });
  const std::string base = load_quad(1);
  const std::string first = edited(base, {emission(2)}).scene().scene_id();
  const std::string second = edited(base, {emission(3)}).scene().scene_id();
  edited(base, {emission(2)});  // asked for again: the other is the older one
  const std::string third = edited(base, {emission(4)}).scene().scene_id();
  EXPECT_TRUE(holds(base) && holds(first) && holds(third));
  EXPECT_FALSE(holds(second));
  // What a session renders stays, and so does what was loaded.
  create_session(first, 8, 8);
  create_session(third, 8, 8);
  pb::EditSceneResponse response;
  expect_status(edit(base, {emission(5)}, &response), StatusCode::RESOURCE_EXHAUSTED, {"max_scenes", "3"});
  EXPECT_TRUE(holds(base) && holds(first) && holds(third));
}

TEST_F(EditSceneTest, ALoadTakesTheRoomOfAnEditedScene) {
  start([](ServerConfig& config) { config.max_scenes = 2; });
  const std::string base = load_quad(1);
  const std::string bright = edited(base, {emission(2)}).scene().scene_id();
  load_quad(9);
  EXPECT_TRUE(holds(base));
  EXPECT_FALSE(holds(bright));
}

// Memory that scenes share is counted once, and given back with the last of them.
TEST(EditSceneMemory, SharedPartsAreCountedOnce) {
  MemoryAccount memory(1ull << 30);
  auto roots = SceneRoots::open({});
  ASSERT_TRUE(roots.ok());
  SceneRegistry registry(std::move(*roots), {1 << 20, 1 << 30, 100, 1}, memory);
  SceneRequest request;
  SceneBundle bundle;
  const std::string gltf = quad_gltf();
  bundle.main_file = "quad.gltf";
  bundle.files.push_back({"quad.gltf", {gltf.begin(), gltf.end()}});
  Sha256 hash;
  hash.update(gltf);
  bundle.digests["quad.gltf"] = hash.finish();
  request.files = std::move(bundle);
  const CancelToken never;
  auto loaded = registry.load(std::move(request), never);
  ASSERT_TRUE(loaded.ok()) << loaded.error().to_string();
  std::string scene = loaded->scene->id;
  const std::uint64_t of_base = memory.used();
  EXPECT_EQ(of_base, loaded->scene->snapshot->stats().memory_bytes);
  const std::string base = std::exchange(loaded->scene, nullptr)->id;

  std::uint64_t expected = of_base;
  std::vector<std::string> ids;
  for (int i = 0; i < 5; ++i) {
    auto lease = registry.acquire(scene, "scene_id");
    ASSERT_TRUE(lease.ok());
    M44d place;
    place[3][0] = 0.1 * (i + 1);
    MaterialEdit colour;
    colour.target = 0u;
    colour.emission = Rgb(float(i + 2), 1, 1);
    std::vector<SceneEdit> edits;
    if (i % 2 == 0) {
      edits.emplace_back(ObjectEdit{0u, place, false});
    } else {
      edits.emplace_back(colour);
    }
    auto edited = registry.edit(*lease, edits, never);
    ASSERT_TRUE(edited.ok()) << edited.error().to_string();
    scene = edited->scene->id;
    ids.push_back(scene);
    expected += edited->scene->snapshot->stats().own_bytes;
    EXPECT_EQ(memory.used(), expected) << i;
    EXPECT_GE(edited->scene->snapshot->stats().memory_bytes, edited->scene->snapshot->stats().own_bytes);
  }
  // Whatever goes first, nothing is left in the end.
  ASSERT_TRUE(registry.unload(base, "").ok());
  EXPECT_LT(memory.used(), expected);
  for (const int i : {3, 0, 4, 1}) ASSERT_TRUE(registry.unload(ids[std::size_t(i)], "").ok());
  EXPECT_GT(memory.used(), 0u);
  ASSERT_TRUE(registry.unload(ids[2], "").ok());
  EXPECT_EQ(memory.used(), 0u);
}

}  // namespace
}  // namespace helio::test
