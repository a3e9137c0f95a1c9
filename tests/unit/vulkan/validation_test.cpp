// Uploads and dispatches break none of Vulkan's rules, those of synchronisation included, as far as the validation
// layer VK_LAYER_KHRONOS_validation knows.
#include <cstdlib>
#include <string>

#include "renderer/vulkan/tracer.h"
#include "tests/support/small_rooms.h"
#include "tests/support/tier.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

using vulkan::DeviceScene;
using vulkan::Level;
using vulkan::Tracer;

class Validation : public DeviceTest, public testing::WithParamInterface<Level> {
 protected:
  Validation() : DeviceTest(GetParam()) {}

  // Null, and the test skipped, where the layer is not installed.
  static std::shared_ptr<vulkan::Device> open_validated(bool staging) {
    vulkan::DeviceOptions options;
    options.level = GetParam();
    options.validation = true;
    options.staging = staging;
    auto opened = vulkan::Device::open(options);
    if (opened.ok()) return *opened;
    skip_or_fail(opened.error());
    return nullptr;
  }

 private:
  static void skip_or_fail(const Error& error) {
    if (error.message.find("VK_LAYER_KHRONOS_validation") == std::string::npos) FAIL() << error.to_string();
    GTEST_SKIP() << error.to_string();
  }
};

// Something of everything, a picture on a wall and one of the sky among it.
SceneDescription scene_with_images() {
  SceneDescription scene = mixed_scene();
  Image image;
  image.name = "stripes";
  image.width = image.height = 4;
  image.channels = 4;
  for (int i = 0; i < 16; ++i) {
    for (int c = 0; c < 4; ++c) image.texels.push_back(std::uint8_t(c == 3 ? 255 : 40 + 10 * i));
  }
  scene.images = {image};
  scene.materials.front().base_color_texture.image = 0;
  scene.environment->image = 0;
  return scene;
}

TEST_P(Validation, UploadAndPathTracingGiveNoMessage) {
  HELIO_FULL_TIER_ONLY();
  const auto scene = build(scene_with_images());
  ASSERT_TRUE(scene);
  const int before = vulkan::validation_message_count();
  for (const bool staging : {false, true}) {
    SCOPED_TRACE(staging ? "by staging buffers" : "written by the host");
    std::shared_ptr<vulkan::Device> opened = open_validated(staging);
    if (!opened) return;
    ASSERT_EQ(opened->level(), GetParam());
    {
      auto placed = DeviceScene::upload(opened, scene);
      ASSERT_TRUE(placed.ok()) << placed.error().to_string();
      auto tracer = Tracer::create(opened);
      ASSERT_TRUE(tracer.ok()) << tracer.error().to_string();
      Film film(16, 16);
      const Camera camera(camera_at({0, 0, 0.9}, {0, -0.2, -1}, 70), 16, 16, scene->origin());
      TraceStats stats;
      for (int half = 0; half < kHalves; ++half) {
        // The second one takes the buffers of the first.
        for (const std::uint32_t first : {0u, 2u}) {
          const auto done = (*tracer)->trace(**placed, camera, {}, {half, first, 2}, film.bounds(), CancelToken(),
                                             film, stats);
          ASSERT_TRUE(done.ok() && *done) << (done.ok() ? "cancelled" : done.error().to_string());
        }
      }
      EXPECT_GT(mean_of(film).mean.x, 0);
      EXPECT_EQ(stats.invalid_samples, 0u);
    }
    opened.reset();  // what is left over when a device goes is told as well
    EXPECT_EQ(vulkan::validation_message_count(), before) << "the first: " << vulkan::first_validation_message();
  }
}

// A buffer of no bytes is against the rules.
TEST_P(Validation, WhatIsWrongIsCounted) {
  HELIO_FULL_TIER_ONLY();
  const std::shared_ptr<vulkan::Device> opened = open_validated(false);
  if (!opened) return;
  const int before = vulkan::validation_message_count();
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  if (opened->api().vkCreateBuffer(opened->handle(), &info, nullptr, &buffer) == VK_SUCCESS)
    opened->api().vkDestroyBuffer(opened->handle(), buffer, nullptr);
  EXPECT_GT(vulkan::validation_message_count(), before);
}

INSTANTIATE_TEST_SUITE_P(, Validation, testing::Values(Level::compute, Level::rt),
                         [](const auto& info) { return std::string(vulkan::level_name(info.param)); });

}  // namespace
}  // namespace helio::test
