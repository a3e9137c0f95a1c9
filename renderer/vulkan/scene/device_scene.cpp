#include "renderer/vulkan/scene/device_scene.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <utility>

#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/scene/acceleration_structures.h"
#include "renderer/vulkan/scene/bvh.h"
#include "renderer/vulkan/scene/geometry_tables.h"
#include "renderer/vulkan/scene/light_tables.h"
#include "renderer/vulkan/scene/material_tables.h"
#include "renderer/vulkan/scene/supported.h"
#include "renderer/vulkan/scene/texture_tables.h"
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
                                                               const std::function<Status(std::uint64_t)>& admit,
                                                               const CancelToken* cancel) {
  if (const auto missing = unsupported(*scene); !missing.empty())
    return Error{ErrorCode::unimplemented, fmt::format("Vulkan devices do not have {}", fmt::join(missing, "; ")), {}};
  const SceneData& data = scene->impl();
  const bool rt = device->level() == Level::rt;

  SceneGeometry geometry = make_geometry(data);
  const HostMaterials materials = make_host_materials(data.description.materials, data.materials);
  const HostLights lights = make_host_lights(*data.lights);
  const HostTextures textures = make_host_textures(data.assets->images);
  SceneBvh bvh;
  if (!rt) {
    SceneBvhOptions options;
    options.cancel = cancel;
    auto built = build_bvh(geometry, options);
    if (!built) return std::move(built).error();
    bvh = std::move(*built);
  }

  std::shared_ptr<DeviceScene> uploaded(new DeviceScene);
  uploaded->parts_ = std::make_unique<Parts>(device);
  Arena& arena = uploaded->parts_->arena;
  const std::uint64_t bytes = geometry.bytes() + bvh.bytes() + materials.bytes() + lights.bytes() + textures.bytes() +
                              sizeof(SceneTables) + 4096;
  if (Status admitted = admit ? admit(bytes) : ok_status(); !admitted) return std::move(admitted).error();
  if (Status fits = arena.reserve(bytes); !fits) return std::move(fits).error();
  if (Status done = upload_meshes(geometry, arena); !done) return std::move(done).error();
  if (rt) {
    auto structures = AccelerationStructures::build(geometry, arena, cancel);
    if (!structures) return std::move(structures).error();
    uploaded->parts_->structures = std::move(*structures);
  } else if (Status done = upload_bvh(bvh, geometry, arena); !done) {
    return std::move(done).error();
  }
  if (Status done = upload_geometry(geometry, arena); !done) return std::move(done).error();

  SceneTables tables{};
  tables.geometry = geometry.tables;
  auto material_address = materials.place(arena);
  if (!material_address) return std::move(material_address).error();
  tables.materials = *material_address;
  auto light_tables = lights.place(arena);
  if (!light_tables) return std::move(light_tables).error();
  tables.lights = *light_tables;
  auto texture_tables = textures.place(arena);
  if (!texture_tables) return std::move(texture_tables).error();
  tables.textures = *texture_tables;
  tables.radius = data.radius;
  auto address = arena.upload_value(tables, "the scene's tables");
  if (!address) return std::move(address).error();
  if (cancel && cancel->cancelled()) return Error{ErrorCode::cancelled, "the caller gave up", {}};
  uploaded->address_ = *address;
  uploaded->features_ = {geometry.tables.features, material_features(data), lights.features() | textures.features(),
                         data.features.absorption ? kPathAbsorption : 0};
  uploaded->device_ = std::move(device);
  uploaded->scene_ = std::move(scene);
  return std::shared_ptr<const DeviceScene>(std::move(uploaded));
}

}  // namespace helio::vulkan
