// Sessions and jobs on Vulkan devices: what is refused, what is shared, and what happens when a device fails.
#include "server/sessions/device_rendering.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "tests/service/service_fixture.h"
#include "tests/support/loop_picture.h"
#include "tests/support/small_rooms.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

using vulkan::DeviceInfo;
using vulkan::DeviceList;
using vulkan::Level;

// Traces on the processor until it has traced so many pieces; then it is lost.
class FakeDevice final : public vulkan::PathDevice {
 public:
  explicit FakeDevice(int pieces) : pieces_(pieces) { info_.name = "fake"; }

  const DeviceInfo& info() const override { return info_; }
  Level level() const override { return Level::compute; }
  bool lost() const override { return pieces_ < 0; }

  Result<std::shared_ptr<const vulkan::SceneOnDevice>> upload(std::shared_ptr<const RenderScene> scene,
                                                              const Admit& admit, const CancelToken*) override {
    if (Status admitted = admit(900); !admitted) return std::move(admitted).error();
    ++uploads;
    return std::shared_ptr<const vulkan::SceneOnDevice>(std::make_shared<Placed>(std::move(scene)));
  }
  Status prepare(const vulkan::SceneOnDevice&) override { return ok_status(); }
  Result<bool> trace(const vulkan::SceneOnDevice& scene, const Camera& camera, const PathSettings& settings,
                     const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                     TraceStats& stats, double*) override {
    if (--pieces_ < 0) return Error{ErrorCode::unavailable, "the device is lost", {}};
    ++traced;
    return trace_window(*static_cast<const Placed&>(scene).scene, camera, settings, range, window, cancel, film, stats);
  }

  std::atomic<int> uploads{0}, traced{0};

 private:
  struct Placed final : vulkan::SceneOnDevice {
    explicit Placed(std::shared_ptr<const RenderScene> placed) : scene(std::move(placed)) {}
    std::uint64_t bytes() const override { return 1000; }
    std::shared_ptr<const RenderScene> scene;
  };

  std::atomic<int> pieces_;
  DeviceInfo info_;
};

// One device that works, behind one that does not.
class FakeSource final : public DeviceSource {
 public:
  explicit FakeSource(int pieces) : device(std::make_shared<FakeDevice>(pieces)) {}

  bool listed() const override { return true; }
  DeviceList list() const override {
    DeviceInfo broken, works;
    broken.name = "broken";
    broken.reason = "its self-test crashed";
    works.name = "fake";
    works.index = 1;
    works.level = Level::compute;
    return {{broken, works}, ""};
  }
  Result<std::shared_ptr<vulkan::PathDevice>> open(const DeviceInfo& listed) override {
    ++opened;
    EXPECT_EQ(listed.index, 1);
    return std::shared_ptr<vulkan::PathDevice>(device);
  }

  const std::shared_ptr<FakeDevice> device;
  int opened = 0;
};

class DeviceRenderingTest : public testing::Test {
 protected:
  void start(int pieces) {
    auto source = std::make_unique<FakeSource>(pieces);
    source_ = source.get();
    devices_.emplace(std::move(source), memory_);
    scene_ = build(lambert_room());
    ASSERT_TRUE(scene_);
    settings_.width = settings_.height = 64;
    settings_.device = {RenderDevice::Kind::vulkan, RenderDevice::kAny};
  }

  std::string refusal(const RenderDevice& device) {
    const auto placed = devices_->place(device, scene_);
    return placed ? "" : placed.error().to_string();
  }

  MemoryAccount memory_{1 << 20};
  FakeSource* source_ = nullptr;
  std::optional<RenderDevices> devices_;
  std::shared_ptr<const RenderScene> scene_;
  RenderSettings settings_;
};

TEST_F(DeviceRenderingTest, RefusalsNameTheDeviceAndTheReason) {
  start(1000);
  using Kind = RenderDevice::Kind;
  EXPECT_EQ(refusal({Kind::vulkan, 0}),
            "device: vulkan:0 cannot trace paths: vulkan:0 (broken): its self-test crashed");
  EXPECT_EQ(refusal({Kind::vulkan, 7}), "device: vulkan:7: no such device; there are vulkan:0 to vulkan:1");
  RenderDevices none(nullptr, memory_);
  EXPECT_EQ(none.place(settings_.device, scene_).error().to_string(),
            "device: vulkan: the daemon renders on its CPU alone; --devices cpu,vulkan allows Vulkan devices");
}

TEST_F(DeviceRenderingTest, SessionsShareADeviceAndWhatLiesOnIt) {
  start(1000);
  {
    // By index or as the first that can: the same device.
    const auto first = devices_->place(settings_.device, scene_);
    const auto second = devices_->place({RenderDevice::Kind::vulkan, 1}, scene_);
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_EQ(*first, *second);
    EXPECT_EQ(source_->opened, 1);
    EXPECT_EQ(source_->device->uploads, 1);
    EXPECT_EQ(memory_.used(), 1000u);
  }
  EXPECT_EQ(memory_.used(), 0u);
  ASSERT_TRUE(devices_->place(settings_.device, scene_).ok());
  EXPECT_EQ(source_->opened, 1);
  EXPECT_EQ(source_->device->uploads, 2);
}

// Memory that is not there is refused before the device is given anything.
TEST_F(DeviceRenderingTest, AnUploadBeyondTheMemoryAccountIsRefusedBefore) {
  start(1000);
  const auto most = memory_.reserve((1 << 20) - 950, "a test");
  ASSERT_TRUE(most.ok());
  EXPECT_NE(refusal(settings_.device).find("the scene on vulkan:1"), std::string::npos);
  EXPECT_EQ(source_->device->uploads, 1);  // 900 bytes fit, all 1,000 do not
  const auto more = memory_.reserve(100, "a test");
  ASSERT_TRUE(more.ok());
  EXPECT_NE(refusal(settings_.device).find("the scene on vulkan:1"), std::string::npos);
  EXPECT_EQ(source_->device->uploads, 1);
  EXPECT_EQ(memory_.used(), (1u << 20) - 850);
}

// What a device has done when it fails stays; the rest comes from the processor, and the picture is whole.
TEST_F(DeviceRenderingTest, APictureGoesOnOnTheCpuWhenItsDeviceFails) {
  start(3);
  std::mutex mutex;
  std::vector<std::string> notices;
  const auto rendering = std::make_shared<DeviceRendering>([&](const std::string& notice) {
    const std::lock_guard lock(mutex);
    notices.push_back(notice);
  });
  auto placed = devices_->place(settings_.device, scene_);
  ASSERT_TRUE(placed.ok());
  rendering->keep(settings_.device, *placed);
  RenderLoopOptions options;
  options.make_tracer = [&](std::shared_ptr<const RenderScene> scene) { return rendering->tracer(std::move(scene)); };
  Budget budget;
  budget.samples = 16;
  RenderEngine engine(1);  // so that the piece that fails is the first to tell
  const CameraPose pose = camera_at({0, 0, 0.9}, {0, -0.2, -1});
  const LoopPicture picture = render_through_loop(engine, scene_, settings_, budget, pose, options);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples) << picture.end.message;
  EXPECT_EQ(source_->device->traced, 3);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices.front(), "vulkan:1 (fake) failed: the device is lost; the picture goes on on the CPU");
  EXPECT_EQ(rendering->failure(), notices.front());

  // Same samples, same bits: the fake one traces as the processor does.
  settings_.device = {};
  const LoopPicture cpu = render_through_loop(engine, scene_, settings_, budget, pose);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(picture.channels[c], cpu.channels[c]);

  EXPECT_EQ(devices_->place({RenderDevice::Kind::vulkan, 1}, scene_).error().to_string(),
            "device: vulkan:1 cannot trace paths: vulkan:1 (fake): it failed, and is not used again until the daemon "
            "is restarted");
  EXPECT_EQ(devices_->list().devices[1].level, Level::none);
  // The session that had the device goes on without it, whatever is edited.
  EXPECT_TRUE(rendering->use({RenderDevice::Kind::vulkan, RenderDevice::kAny}, nullptr));
  EXPECT_FALSE(rendering->use({RenderDevice::Kind::vulkan, 1}, nullptr));

  // Another session on the device is told, too, although its own work never failed.
  std::vector<std::string> others;
  const auto other = std::make_shared<DeviceRendering>([&](const std::string& notice) {
    const std::lock_guard lock(mutex);
    others.push_back(notice);
  });
  other->keep({RenderDevice::Kind::vulkan, RenderDevice::kAny}, *placed);
  options.make_tracer = [&](std::shared_ptr<const RenderScene> scene) { return other->tracer(std::move(scene)); };
  settings_.device = {RenderDevice::Kind::vulkan, RenderDevice::kAny};
  const LoopPicture without = render_through_loop(engine, scene_, settings_, budget, pose, options);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(without.channels[c], cpu.channels[c]);
  ASSERT_EQ(others.size(), 1u);
  EXPECT_EQ(others.front(), "vulkan:1 (fake) has failed; the picture goes on on the CPU");
}

// On this machine's devices, through the daemon.
class DeviceServiceTest : public ServiceTest {
 protected:
  struct Outcome {
    std::vector<pb::RunJobResponse> messages;
    grpc::Status status;
  };
  Outcome run(const std::string& device, const std::string& scene) {
    pb::RunJobRequest request;
    request.set_scene_id(scene);
    request.mutable_settings()->set_width(32);
    request.mutable_settings()->set_height(32);
    request.mutable_settings()->set_device(device);
    request.mutable_budget()->set_samples(4);
    request.mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(120));
    auto reader = stub().RunJob(&context, request);
    Outcome outcome;
    pb::RunJobResponse response;
    while (reader->Read(&response)) outcome.messages.push_back(response);
    outcome.status = reader->Finish();
    return outcome;
  }
};

TEST_F(DeviceServiceTest, ADaemonThatIsNotAllowedDevicesRefusesThem) {
  start();
  const Outcome outcome = run("vulkan", load_quad());
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_NE(outcome.status.error_message().find("--devices cpu,vulkan"), std::string::npos)
      << outcome.status.error_message();
  EXPECT_EQ(run("gpu", load_quad()).status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(DeviceServiceTest, AJobAndASessionOnADevice) {
  start([](ServerConfig& config) { config.vulkan_devices = true; });
  const bool required = std::getenv("HELIOGRAPH_REQUIRE_VULKAN") != nullptr;
  pb::GetServerInfoResponse info;
  bool any = false;
  // On a busy machine the devices' first test may be too short.
  for (int i = 0; i < 200 && !any && (i == 0 || required); ++i) {
    if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(200));
    grpc::ClientContext context;
    ASSERT_TRUE(stub().GetServerInfo(&context, {}, &info).ok());
    any = std::any_of(info.devices().begin(), info.devices().end(),
                      [](const pb::Device& device) { return !device.path_tracing().empty(); });
  }
  if (!any) {
    ASSERT_FALSE(required) << info.no_vulkan_reason();
    GTEST_SKIP() << "no Vulkan device traces paths: " << info.no_vulkan_reason();
  }
  // Metal that lies under a sky: the processor and a device round what it scatters in different places.
  auto gltf = nlohmann::json::parse(quad_gltf(3));
  gltf["materials"][0]["pbrMetallicRoughness"] = {{"metallicFactor", 1}, {"roughnessFactor", 0.5}};
  Upload upload;
  upload.bytes = gltf.dump();
  upload.environment = "0.3,0.4,0.5";
  pb::LoadSceneResponse loaded;
  ASSERT_TRUE(load(upload.messages(), &loaded).ok());
  const std::string scene = loaded.scene().scene_id();
  const Outcome outcome = run("vulkan", scene);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.messages.front().accepted().settings().device(), "vulkan");
  const pb::RunJobResponse::Result& result = outcome.messages.back().result();
  EXPECT_EQ(result.end().reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(result.end().notice(), "");
  EXPECT_EQ(result.end().totals().samples_per_pixel(), 4u);
  EXPECT_EQ(result.end().totals().invalid_samples(), 0u);
  // It was the device that rendered.
  const auto picture = [](const Outcome& of) {
    std::string tiles;
    for (const pb::RunJobResponse& message : of.messages) tiles += message.tile().exr();
    return tiles;
  };
  EXPECT_FALSE(picture(outcome).empty());
  EXPECT_TRUE(picture(outcome) == picture(run("vulkan", scene)));
  EXPECT_TRUE(picture(outcome) != picture(run("cpu", scene)));

  // A session changes over to the device and back.
  const std::string session = create_session(scene, 32, 32, 4);
  StreamClient stream(stub(), session);
  ASSERT_TRUE(stream.send(view(1)));
  ASSERT_TRUE(stream.reader().wait_for_frame_end(1));
  for (const char* device : {"vulkan", "cpu"}) {
    pb::StreamRequest request;
    request.mutable_settings()->set_width(32);
    request.mutable_settings()->set_height(32);
    request.mutable_settings()->set_device(device);
    ASSERT_TRUE(stream.send(request));
    const std::uint64_t id = device == std::string("vulkan") ? 2 : 3;
    ASSERT_TRUE(stream.send(view(id)));
    ASSERT_TRUE(stream.reader().wait_for_frame_end(id)) << device;
  }
}

}  // namespace
}  // namespace helio::test
