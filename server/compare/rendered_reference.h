// References that the daemon renders itself: two independent pictures of as many samples each, so that their noise can
// be taken off errors (metrics/reference_halves.h).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/compare/compared_session.h"
#include "server/compare/reference_store.h"

namespace helio {

// What identifies it: the scene, the view, the settings, how good it is to be, and this build.
std::string rendered_reference_id(const LoadedScene& scene, const CameraPose& view, const ReferenceRequest& request);

// Rendered until its error is at most the request's, or its samples are. `told`: about four times a second, samples per
// pixel of both pictures together so far, and the error so far, 0: not known. Errors: of ComparedSession.
struct ReferenceProgress {
  double samples = 0, error = 0;
};
// kept: the account of the picture, which outlives the comparison.
Result<std::shared_ptr<const ReferencePicture>> render_reference(
    const RenderContext::Resources& resources, MemoryAccount& kept, const std::shared_ptr<const LoadedScene>& scene,
    const CameraPose& view, const ReferenceRequest& request, const CancelToken& cancel,
    const std::function<void(const ReferenceProgress&)>& told);

}  // namespace helio
