#include "renderer/vulkan/scene/device_scene.h"

#include <utility>

#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/scene/acceleration_structures.h"
#include "renderer/vulkan/shaders/tables/scene.h"

namespace helio::vulkan {

struct DeviceScene::Parts {
  explicit Parts(std::shared_ptr<Device> device) : arena(std::move(device)) {}

  Arena arena;
  AccelerationStructures structures;  // of Level::rt; refer to what is in the arena
};

DeviceScene::~DeviceScene() = default;

std::uint64_t DeviceScene::bytes() const {
  return parts_->arena.allocated_bytes() + parts_->structures.bytes();
}

Result<std::shared_ptr<const DeviceScene>> DeviceScene::upload(std::shared_ptr<Device> device,
                                                               std::shared_ptr<const RenderScene> scene,
                                                               const CancelToken* cancel) {
  auto host = make_host_scene(std::move(scene), device->level(), cancel);
  if (!host) return std::move(host).error();
  return upload(std::move(device), std::move(*host), cancel);
}

Result<std::shared_ptr<const DeviceScene>> DeviceScene::upload(std::shared_ptr<Device> device, HostScene host,
                                                               const CancelToken* cancel) {
  const SceneData& data = host.scene->impl();
  SceneGeometry& geometry = host.geometry;
  std::shared_ptr<DeviceScene> uploaded(new DeviceScene);
  uploaded->parts_ = std::make_unique<Parts>(device);
  Arena& arena = uploaded->parts_->arena;
  if (Status fits = arena.reserve(host.bytes()); !fits) return std::move(fits).error();
  if (Status done = upload_meshes(geometry, arena); !done) return std::move(done).error();
  if (device->level() == Level::rt) {
    auto structures = AccelerationStructures::build(geometry, arena, cancel);
    if (!structures) return std::move(structures).error();
    uploaded->parts_->structures = std::move(*structures);
  } else if (Status done = upload_bvh(host.bvh, geometry, arena); !done) {
    return std::move(done).error();
  }
  if (Status done = upload_geometry(geometry, arena); !done) return std::move(done).error();

  SceneTables tables{};
  tables.geometry = geometry.tables;
  auto material_address = host.materials.place(arena);
  if (!material_address) return std::move(material_address).error();
  tables.materials = *material_address;
  auto light_tables = host.lights.place(arena);
  if (!light_tables) return std::move(light_tables).error();
  tables.lights = *light_tables;
  auto texture_tables = host.textures.place(arena);
  if (!texture_tables) return std::move(texture_tables).error();
  tables.textures = *texture_tables;
  tables.radius = data.radius;
  auto address = arena.upload_value(tables, "the scene's tables");
  if (!address) return std::move(address).error();
  if (cancel && cancel->cancelled()) return Error{ErrorCode::cancelled, "the caller gave up", {}};
  uploaded->address_ = *address;
  uploaded->features_ = host.features;
  uploaded->device_ = std::move(device);
  uploaded->scene_ = std::move(host.scene);
  return std::shared_ptr<const DeviceScene>(std::move(uploaded));
}

}  // namespace helio::vulkan
