// Camera paths of the benches (client/named_paths.h), over poses of the renderer.
#pragma once

#include <string>
#include <vector>

#include "client/named_paths.h"
#include "renderer/base/result.h"
#include "renderer/trace/camera/camera.h"

namespace helio::bench {

// amount 0 gives the same bits back.
CameraPose moved(const CameraPose& home, const ViewStep& step, double amount);

// Of a path that ends at `home`, in its very bits.
std::vector<CameraPose> views_of(const NamedPath& path, const CameraPose& home);

// The paths for a scene whose depth (scene_depth.h) is `depth` > 0: those by name, their turns by 5, 10, 20 and 50
// degrees a step, 100 in all (Schalk 2018, chapter 4.3), as turn-5, turn-10, turn-20 and turn-50.
std::vector<NamedPath> camera_paths(double depth);

// One of them. not_found lists the names.
Result<NamedPath> find_camera_path(const std::string& name, double depth);

}  // namespace helio::bench
