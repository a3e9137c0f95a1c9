#include "server/jobs/job_plan.h"

#include <spdlog/fmt/fmt.h>

#include <set>
#include <utility>

#include "renderer/trace/selection/unsampled_light.h"

namespace helio {
namespace {

constexpr int kMaxViews = 10000;

// The views to render, one for a still. Without a scene, cameras that are only named cannot be looked at.
std::vector<View> read_views(const pb::RunJobRequest& request, const LoadedScene* scene, const std::string& where,
                             Problems& problems) {
  static const std::vector<CameraDescription> kNone;
  const auto& cameras = scene ? scene->snapshot->description().cameras : kNone;
  std::vector<View> views;
  const auto add = [&](const CameraPose& pose) {
    View& view = views.emplace_back();
    view.id = views.size();
    view.time_s = scene ? scene->manifest.time_s : 0;
    view.camera = pose;
  };
  const auto read = [&](const pb::CameraView& camera, const std::string& place) {
    if (!scene && camera.orientation_case() == pb::CameraView::kSceneCamera) return;
    add(read_camera(camera, cameras, place, problems));
  };
  if (request.views_size() > kMaxViews) {
    problems.add(field_path(where, "views"),
                 fmt::format("{} views; allowed: at most {}", request.views_size(), kMaxViews));
    return views;
  }
  if (request.views_size() > 0 && request.has_camera())
    problems.add(field_path(where, "camera"), "is given beside views; allowed: one of them");
  for (int i = 0; i < request.views_size(); ++i)
    read(request.views(i), field_path(where, fmt::format("views[{}]", i).c_str()));
  if (request.has_camera()) read(request.camera(), field_path(where, "camera"));
  if (views.empty() && scene) add(camera_pose(cameras.front()));
  return views;
}

}  // namespace

JobPlan read_job(const ServiceCore& core, const pb::RunJobRequest& request, const LoadedScene* scene,
                 const std::string& where, Problems& problems) {
  JobPlan plan;
  plan.settings = read_settings(request.settings(), core.render_limits(), field_path(where, "settings"), problems);
  if (plan.settings.foveation.kind != Foveation::none) {
    problems.add(field_path(where, "settings.foveation"),
                 std::string(to_string(plan.settings.foveation.kind)) + "; allowed: none, for nobody looks at a job");
  }
  if (plan.settings.preview.rate > 0) {
    problems.add(field_path(where, "settings.preview_rate"),
                 number_text(plan.settings.preview.rate) + "; allowed: 0, for nobody drags the camera of a job");
  }
  plan.budget = read_budget(request.budget(), field_path(where, "budget"), problems);
  if (!plan.budget.time_s && !plan.budget.samples && !plan.budget.error)
    problems.add(field_path(where, "budget"), "has no end; one of time_s, samples, error is required");
  plan.format = read_tile_format(request.format(), field_path(where, "format"), problems, core.oidn != nullptr);
  plan.views = read_views(request, scene, where, problems);
  return plan;
}

Result<PlannedJob> plan_job(ServiceCore& core, const pb::RunJobRequest& request, const std::string& where) {
  Problems problems;
  const std::string scene_id = field_path(where, "scene_id");
  check_id(request.scene_id(), scene_id, problems);
  const bool id_usable = problems.empty();
  auto scene = core.scenes.acquire(request.scene_id(), scene_id);
  JobPlan plan = read_job(core, request, scene ? scene->get() : nullptr, where, problems);
  if (!problems.empty()) {
    if (!scene && id_usable) problems.add(scene.error().where, scene.error().message);
    return problems.to_error();
  }
  if (!scene) return scene.error();
  const Status fits = check_film_size(plan.settings, core.render_limits(), field_path(where, "settings"));
  if (!fits.ok()) return fits.error();
  return PlannedJob{std::move(plan), std::move(*scene)};
}

JobNotices notices_of(const JobPlan& plan, const SceneFeatures& features) {
  JobNotices told;
  told.unsampled = unsampled_light(plan.settings.integrator, features);
  std::set<std::string> notices;
  for (const View& view : plan.views)
    notices.insert(aspect_notice(view.camera, plan.settings.width, plan.settings.height));
  for (const std::string& line : notices) {
    if (!line.empty()) told.notices.push_back(line);
  }
  return told;
}

}  // namespace helio
