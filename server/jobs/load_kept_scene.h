// A scene that a job or a session needs: as the daemon holds it, or loaded again by its recipe.
#pragma once

#include <string>

#include "server/sessions/service_core.h"
#include "server/state/scene_store.h"

namespace helio {

// Takes as long as a load. Errors: those of SceneStore::recipe(), SceneRegistry::load() and change();
// failed_precondition: its files make another scene now.
// owner: the name of the token that it belongs to.
Result<SceneLease> load_kept_scene(ServiceCore& core, const SceneStore& scenes, const std::string& scene_id,
                                   const std::string& owner, const CancelToken& cancel);

}  // namespace helio
