#include "server/jobs/load_kept_scene.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace helio {

Result<SceneLease> load_kept_scene(ServiceCore& core, const SceneStore& scenes, const std::string& scene_id,
                                   const std::string& owner, const CancelToken& cancel) {
  if (auto held = core.scenes.acquire(scene_id, "scene_id")) return held;
  auto recipe = scenes.recipe(scene_id, core.memory);
  if (!recipe) return recipe.error();
  const auto loaded = core.scenes.load(std::move(recipe->request), cancel);
  if (!loaded) return loaded.error();
  SceneLease scene(loaded->scene);
  scene->owners.add(owner);
  if (scene->id != recipe->loaded_id) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("its files make scene {} now, where it was submitted with {}", scene->id.substr(0, 12),
                             recipe->loaded_id.substr(0, 12)),
                 "scene_id"};
  }
  spdlog::info("scene loaded again scene={} triangles={} load_s={:.3f}", scene->id.substr(0, 12),
               scene->snapshot->stats().triangles, scene->load_seconds);
  if (recipe->changes.empty()) return scene;
  const auto edited = core.scenes.change(scene, recipe->changes, cancel);
  if (!edited) return edited.error();
  edited->scene->owners.add(owner);
  return SceneLease(edited->scene);
}

}  // namespace helio
