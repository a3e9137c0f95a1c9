#include "client/cli/commands/view_in_tev.h"

#include <utility>

#include "client/cli/render_options.h"
#include "client/cli/tev_option.h"

namespace helio::cli {

namespace pb = heliograph::v1;

ViewInTev::ViewInTev(RenderClient& client, const pb::SceneInfo& scene, const std::string& scene_name,
                     const std::string& server, const TevAddress& address, Terminal& terminal)
    : client_(client), scene_name_(scene_name), terminal_(terminal) {
  pb::RunJobRequest request;
  request.set_scene_id(scene.scene_id());
  if (!scene.cameras().empty()) {
    const pb::SceneCamera& camera = scene.cameras(0);
    camera_ = camera.name();
    *request.mutable_camera() = camera.view();
    set_defaults(*request.mutable_settings(), scene, camera);
  }
  request.mutable_budget()->set_samples(kSamples);
  Problems none;
  OptionReader reader(none);
  *request.mutable_format() = read_transport({}, server, reader);
  request.set_preview_tiles(true);
  tev_ = open_tev(address, request.format(), terminal);
  thread_ = std::thread([this, request = std::move(request)] { run(request); });
}

ViewInTev::~ViewInTev() {
  cancel();
  thread_.join();
}

void ViewInTev::cancel() {
  {
    const std::lock_guard lock(mutex_);
    cancelled_ = true;
  }
  control_.cancel();
}

void ViewInTev::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return over_; });
}

void ViewInTev::run(const pb::RunJobRequest& request) {
  FrameAssembler picture;  // checks the tiles
  std::string broken;
  const auto note = [&](const Error& error) {
    if (broken.empty()) broken = error.to_string();
    control_.cancel();
  };
  JobCallbacks callbacks;
  callbacks.accepted = [&](const pb::RunJobResponse::Accepted& accepted) {
    tev_->set_name(scene_name_, accepted.job_id());
    if (const Status begun = picture.begin(accepted.settings()); !begun) note(begun.error());
    if (const Status shown = tev_->begin(accepted.settings()); !shown) note(shown.error());
  };
  callbacks.tile = [&](pb::Tile tile) {
    if (const auto added = add_and_show(picture, std::move(tile), tev_.get()); !added) note(added.error());
  };
  const auto end = client_.run_job(request, callbacks, &control_);
  tev_->finish();
  const std::lock_guard lock(mutex_);
  if (!broken.empty()) {
    terminal_.warn("tev lacks a part of the picture: " + broken);
  } else if (!cancelled_ && !end) {
    terminal_.warn("the picture for tev cannot be rendered: " + end.error().to_string());
  } else if (!cancelled_ && end->reason() == pb::END_REASON_FAILED) {
    terminal_.warn("the picture for tev failed: " + end->message());
  }
  over_ = true;
  changed_.notify_all();
}

}  // namespace helio::cli
