#include "tests/unit/vulkan/device_rays.h"

#include <helio_shaders/trace_rays_comp.h>
#include <helio_shaders/trace_rays_rgen.h>

#include <cstring>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/vulkan/rt_pipeline.h"
#include "renderer/vulkan/scene/material_tables.h"
#include "renderer/vulkan/scene/texture_tables.h"
#include "renderer/vulkan/shaders/tables/scene.h"

namespace helio::test {
namespace {

using vulkan::Level;

// The push constants of trace_rays.comp and trace_rays.rgen.
struct Push {
  std::uint64_t scene, rays, hits, occluded;
  std::uint32_t count, padding;
};

// What the shaders call Ray and Hit.
static_assert(sizeof(Ray) == 32 && sizeof(Hit) == 36);

template <class T>
T expect_ok(Result<T> result) {
  if (!result) {
    ADD_FAILURE() << result.error().to_string();
    std::abort();
  }
  return std::move(result).value();
}

}  // namespace

DeviceRays::DeviceRays(std::shared_ptr<vulkan::Device> device, const SceneData& scene, Level level)
    : device_(std::move(device)), level_(level), arena_(std::make_unique<vulkan::Arena>(device_)) {
  geometry_ = vulkan::make_geometry(scene);
  upload(scene);
  const std::uint32_t constants[] = {geometry_.tables.features};
  if (level_ == Level::rt) {
    pipeline_ = std::make_unique<vulkan::RayPipeline>(
        expect_ok(vulkan::make_ray_pipeline(device_, trace_rays_rgen, sizeof(Push))));
  } else {
    compute_ = std::make_unique<vulkan::ComputePipeline>(
        expect_ok(vulkan::ComputePipeline::create(device_, trace_rays_comp, sizeof(Push), constants)));
  }
}

void DeviceRays::upload(const SceneData& scene) {
  const double begin = now_s();
  if (level_ == Level::compute) bvh_ = expect_ok(vulkan::build_bvh(geometry_));
  const double built = now_s();
  expect_ok(upload_meshes(geometry_, *arena_));
  if (level_ == Level::compute) expect_ok(upload_bvh(bvh_, geometry_, *arena_));
  const double uploaded = now_s();
  if (level_ == Level::rt) {
    structures_ = std::make_unique<vulkan::AccelerationStructures>(
        expect_ok(vulkan::AccelerationStructures::build(geometry_, *arena_)));
  }
  build_seconds_ = (built - begin) + (now_s() - uploaded);
  upload_seconds_ = uploaded - built;
  expect_ok(upload_geometry(geometry_, *arena_));
  vulkan::SceneTables tables{};
  tables.geometry = geometry_.tables;
  tables.textures = expect_ok(vulkan::make_host_textures(scene.assets->images).place(*arena_));
  tables.materials =
      expect_ok(vulkan::make_host_materials(scene.description.materials, scene.materials).place(*arena_));
  scene_address_ = expect_ok(arena_->upload(std::as_bytes(std::span(&tables, 1)), 16, "tables"));
}

RayAnswers DeviceRays::trace(const std::vector<Ray>& rays, bool closest, bool any) const {
  using vulkan::Buffer;
  using vulkan::Memory;
  auto asked = expect_ok(Buffer::create(device_, rays.size() * sizeof(Ray), Memory::host, "rays"));
  auto hits = expect_ok(Buffer::create(device_, rays.size() * sizeof(Hit), Memory::host, "hits"));
  auto occluded = expect_ok(Buffer::create(device_, rays.size() * sizeof(std::uint32_t), Memory::host, "answers"));
  std::memcpy(asked.mapped().data(), rays.data(), rays.size() * sizeof(Ray));
  const Push push{scene_address_,
                  asked.address(),
                  closest ? hits.address() : 0,
                  any ? occluded.address() : 0,
                  std::uint32_t(rays.size()),
                  0};
  auto slot = expect_ok(vulkan::CommandSlot::create(device_));
  const double begin = now_s();
  expect_ok(slot.run(
      [&](const VolkDeviceTable&, VkCommandBuffer commands) {
        const auto bytes = std::as_bytes(std::span(&push, 1));
        if (level_ == Level::rt) {
          pipeline_->trace(commands, bytes, push.count);
        } else {
          compute_->dispatch(commands, bytes, {(push.count + 63) / 64});
        }
      },
      std::chrono::minutes(1)));
  RayAnswers answers;
  answers.seconds = now_s() - begin;
  if (closest) {
    answers.hits.resize(rays.size());
    std::memcpy(static_cast<void*>(answers.hits.data()), hits.mapped().data(), rays.size() * sizeof(Hit));
  }
  if (any) {
    for (const std::uint32_t answer : occluded.mapped_as<std::uint32_t>().first(rays.size())) {
      answers.occluded.push_back(std::uint8_t(answer));
    }
  }
  return answers;
}

RayAnswers trace_on_cpu(const SceneData& scene, const std::vector<Ray>& rays) {
  RayAnswers answers;
  answers.hits.resize(rays.size());
  answers.occluded.resize(rays.size());
  std::vector<std::uint32_t> order(rays.size());
  std::iota(order.begin(), order.end(), 0u);
  scene.accel->intersect(rays.data(), order.data(), rays.size(), answers.hits.data(), RayOrder::scattered);
  scene.accel->occluded(rays.data(), rays.size(), answers.occluded.data());
  return answers;
}

}  // namespace helio::test
