// What a job is to render, read from its request: the same of RunJob and of jobs that the daemon keeps.
#pragma once

#include <string>
#include <vector>

#include "server/sessions/service_core.h"
#include "server/stream/convert.h"

namespace helio {

struct JobPlan {
  RenderSettings settings;
  Budget budget;
  TileFormat format;
  std::vector<View> views;  // at least one; their ids count from 1
};

// All problems of the request are reported together, with `where` before their fields; scene_id's is not among them.
// `scene`: null where it cannot be had; then cameras that are only named are left out.
JobPlan read_job(const ServiceCore& core, const pb::RunJobRequest& request, const LoadedScene* scene,
                 const std::string& where, Problems& problems);

// Reads the request and takes hold of its scene. Errors: invalid_argument, with scene_id among the problems; not_found;
// resource_exhausted (max_film_pixels).
struct PlannedJob {
  JobPlan plan;
  SceneLease scene;
};
Result<PlannedJob> plan_job(ServiceCore& core, const pb::RunJobRequest& request, const std::string& where);

// What is told of it before it begins: RunJobResponse.Accepted's `unsampled` and `notices`.
struct JobNotices {
  std::vector<std::string> unsampled, notices;
};
JobNotices notices_of(const JobPlan& plan, const SceneFeatures& features);

}  // namespace helio
