// Loads, edits and replays run on threads of their own: none waits for another kind.
#include <future>
#include <latch>
#include <utility>

#include "client/render_client.h"
#include "server/rpc/render_service.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

// The service on a core that the test can reach into.
class SideBySideTest : public testing::Test {
 protected:
  void start(const std::function<void(ServerConfig&)>& change = {}) {
    ServerConfig config;
    config.render_threads = 1;
    config.max_memory = 1ull << 30;
    if (change) change(config);
    auto roots = SceneRoots::open({});
    ASSERT_TRUE(roots.ok());
    core_ = std::make_unique<ServiceCore>(complete(config), std::move(*roots));
    compare_ = std::make_unique<CompareCore>(*core_);
    service_ = std::make_unique<RenderService>(*compare_, nullptr, "");
    grpc::ServerBuilder builder;
    builder.RegisterService(service_.get());
    server_ = builder.BuildAndStart();
    stub_ = pb::RenderService::NewStub(server_->InProcessChannel(grpc::ChannelArguments()));
  }

  void TearDown() override {
    end_hold();
    stub_.reset();
    if (server_) server_->Shutdown();
    server_.reset();
    service_.reset();
    core_.reset();
  }

  // Keeps a thread of the core's busy until end_hold(); returns when it is.
  [[nodiscard]] bool hold(TaskThread& thread) {
    auto begun = std::make_shared<std::promise<void>>();
    auto begins = begun->get_future();
    if (!thread.submit([begun, ended = hold_.get_future().share()] {
          begun->set_value();
          ended.wait();
        })) {
      return false;
    }
    begins.wait();
    held_ = true;
    return true;
  }
  void end_hold() {
    if (std::exchange(held_, false)) hold_.set_value();
  }

  // As an upload would, on this thread.
  std::shared_ptr<const LoadedScene> load(const std::string& bytes) {
    SceneRequest request;
    SceneBundle bundle;
    bundle.main_file = "scene.gltf";
    bundle.files.push_back({"scene.gltf", {bytes.begin(), bytes.end()}});
    Sha256 hash;
    hash.update(bytes);
    bundle.digests["scene.gltf"] = hash.finish();
    request.files = std::move(bundle);
    request.environment = "0,0,0";
    auto outcome = core_->scenes.load(std::move(request), CancelToken());
    return outcome ? outcome->scene : nullptr;
  }

  // The replay token of an invalid sample of the scene.
  std::string token_of(const std::string& scene_id) {
    pb::RunJobRequest job;
    job.set_scene_id(scene_id);
    job.mutable_settings()->set_width(40);
    job.mutable_settings()->set_height(30);
    job.mutable_budget()->set_samples(64);
    grpc::ClientContext context;
    const auto call = stub_->RunJob(&context, job);
    pb::RunJobResponse response;
    std::string token;
    while (call->Read(&response)) {
      if (response.has_result()) token = response.result().end().replay_token();
    }
    EXPECT_TRUE(call->Finish().ok());
    return token;
  }

  static pb::SceneEdit emission(double radiance) {
    pb::SceneEdit edit;
    edit.mutable_material()->set_index(0);
    edit.mutable_material()->mutable_emission()->set_x(radiance);
    return edit;
  }

  std::promise<void> hold_;
  bool held_ = false;
  std::unique_ptr<ServiceCore> core_;
  std::unique_ptr<CompareCore> compare_;
  std::unique_ptr<RenderService> service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<pb::RenderService::Stub> stub_;
};

TEST_F(SideBySideTest, AnEditAndAReplayAreAnsweredWhileALoadIsStuck) {
  start();
  const auto scene = load(overflowing_gltf());
  ASSERT_TRUE(scene);
  const std::string token = token_of(scene->id);
  ASSERT_FALSE(token.empty());

  ASSERT_TRUE(hold(core_->loader));
  // Behind the load that is stuck: the deadline ends a hang only.
  const auto deadline = std::chrono::system_clock::now() + std::chrono::seconds(60);
  {
    grpc::ClientContext context;
    context.set_deadline(deadline);
    pb::EditSceneRequest request;
    request.set_scene_id(scene->id);
    *request.add_edits() = emission(3);
    pb::EditSceneResponse response;
    const grpc::Status status = stub_->EditScene(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  {
    grpc::ClientContext context;
    context.set_deadline(deadline);
    pb::ReplaySampleRequest request;
    request.set_token(token);
    pb::ReplaySampleResponse response;
    const grpc::Status status = stub_->ReplaySample(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_FALSE(response.finite());
  }
  EXPECT_TRUE(core_->busy());
  EXPECT_TRUE(core_->loader.busy());
}

// Documented as one of the short calls.
TEST_F(SideBySideTest, AReplayThatDoesNotComeEndsWithTheClientsPatience) {
  start();
  ASSERT_TRUE(hold(core_->replayer));
  ConnectOptions options;
  options.call_timeout_s = 0.2;
  RenderClient client(server_->InProcessChannel(grpc::ChannelArguments()), "in process", options);
  const auto scene = load(overflowing_gltf());
  ASSERT_TRUE(scene);
  const std::string token = token_of(scene->id);
  ASSERT_FALSE(token.empty());
  const auto answer = client.replay_sample(token);
  end_hold();
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::unavailable);
  EXPECT_NE(answer.error().message.find("did not answer in time"), std::string::npos) << answer.error().message;
}

TEST_F(SideBySideTest, LoadsAndEditsTogetherKeepToTheNumberOfScenes) {
  start([](ServerConfig& config) { config.max_scenes = 2; });
  const auto scene = load(quad_gltf(1));
  ASSERT_TRUE(scene);
  const SceneLease lease(scene);
  for (int i = 0; i < 12; ++i) {
    std::latch together(2);
    MaterialEdit brighter;
    brighter.target = std::uint32_t(0);
    brighter.emission = Rgb(float(2 + i));
    const std::vector<SceneEdit> edits = {brighter};
    auto edit = std::async(std::launch::async, [&] {
      together.arrive_and_wait();
      return core_->scenes.edit(lease, edits, CancelToken());
    });
    together.arrive_and_wait();
    const auto other = load(quad_gltf(1000 + i));
    const auto edited = edit.get();
    EXPECT_LE(core_->scenes.list().size(), 2u);
    EXPECT_TRUE(other || edited.ok()) << "one of them has room";
    if (other) {
      EXPECT_TRUE(core_->scenes.unload(other->id, "").ok());
    }
  }
}

}  // namespace
}  // namespace helio::test
