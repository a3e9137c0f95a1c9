#include "renderer/vulkan/scene/host_scene.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <utility>

#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/scene/supported.h"
#include "renderer/vulkan/shaders/tables/scene.h"

namespace helio::vulkan {

std::uint64_t HostScene::bytes() const {
  constexpr std::uint64_t kAlignment = 4096;  // of all tables together, rounded up
  return geometry.bytes() + bvh.bytes() + materials.bytes() + lights.bytes() + textures.bytes() + sizeof(SceneTables) +
         kAlignment;
}

Result<HostScene> make_host_scene(std::shared_ptr<const RenderScene> scene, Level level, const CancelToken* cancel) {
  if (const auto missing = unsupported(*scene); !missing.empty())
    return Error{ErrorCode::unimplemented, fmt::format("Vulkan devices do not have {}", fmt::join(missing, "; ")), {}};
  const SceneData& data = scene->impl();
  HostScene host{std::move(scene),
                 make_geometry(data),
                 {},
                 make_host_materials(data.description.materials, data.materials),
                 make_host_lights(*data.lights),
                 make_host_textures(data.assets->images),
                 {}};
  if (level != Level::rt) {
    SceneBvhOptions options;
    options.cancel = cancel;
    auto built = build_bvh(host.geometry, options);
    if (!built) return std::move(built).error();
    host.bvh = std::move(*built);
  }
  host.features = {host.geometry.tables.features, material_features(data),
                   host.lights.features() | host.textures.features(),
                   data.features.absorption ? kPathAbsorption : 0};
  return host;
}

}  // namespace helio::vulkan
