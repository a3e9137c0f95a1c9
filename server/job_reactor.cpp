#include "server/job_reactor.h"

#include <spdlog/spdlog.h>

#include "server/convert.h"
#include "server/grpc_status.h"
#include "server/guarded.h"
#include "server/message_check.h"
#include "server/stream_messages.h"

namespace helio {

JobReactor::JobReactor(ServiceCore& core, const grpc::ByteBuffer& request) : core_(core) {
  stream_ = std::make_shared<OutboundStream>(
      static_cast<OutboundStream::Call&>(*this),
      [this](Outbound message) { return to_job_response(std::move(message), job_id_); }, core.timers);
  const Status started = guarded([&] { return start(request); });
  if (!started.ok()) stream_->finish(to_grpc_status(started));
}

Status JobReactor::start(grpc::ByteBuffer bytes) {
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  pb::RunJobRequest request;
  if (const Status parsed = parse_message(bytes, request); !parsed.ok()) return parsed;
  Problems problems;
  check_id(request.scene_id(), "scene_id", problems);
  const RenderSettings settings = read_settings(request.settings(), core_.render_limits(), "settings", problems);
  const Budget budget = read_budget(request.budget(), "budget", problems);
  if (!budget.time_s && !budget.samples && !budget.error) {
    problems.add("budget", "has no end; one of time_s, samples, error is required");
  }
  const TileFormat format = read_tile_format(request.format(), "format", problems);
  if (!problems.empty()) return problems.to_error();
  if (const Status fits = check_film_size(settings, core_.render_limits(), "settings"); !fits.ok()) return fits;

  auto scene = core_.scenes.acquire(request.scene_id(), "scene_id");
  if (!scene) return scene.error();
  const auto& cameras = (*scene)->snapshot->description().cameras;
  View view;
  view.id = 1;
  view.time_s = (*scene)->manifest.time_s;
  view.camera =
      request.has_camera() ? read_camera(request.camera(), cameras, "camera", problems) : camera_pose(cameras.front());
  if (!problems.empty()) return problems.to_error();

  auto id = core_.jobs.reserve();
  if (!id) return id.error();
  job_id_ = *id;
  const auto tiles = request.preview_tiles() ? FramePublisher::Tiles::all : FramePublisher::Tiles::final_only;
  auto rendering = Rendering::create(core_.resources(), std::move(*scene), settings, budget, RenderRank::job, tiles,
                                     format.channels);
  if (!rendering) return rendering.error();
  if (const Status fits = (*rendering)->reserve_queue(settings, format); !fits.ok()) return fits;
  job_ = std::make_shared<Job>(Job{job_id_, std::move(*rendering)});
  core_.jobs.add(job_);

  pb::RunJobResponse greeting;
  greeting.mutable_accepted()->set_job_id(job_id_);
  *greeting.mutable_accepted()->mutable_settings() = to_message(settings);
  stream_->push(Greeting{greeting.SerializeAsString()});
  Rendering& job = *job_->rendering;
  job.publisher().attach(stream_, format);
  job.publisher().finish_after(0);
  RenderLoop::Update start;
  start.view = view;
  job.loop().update(start);
  job.report_progress(stream_);
  spdlog::info("job accepted id={} scene={} size={}x{}", job_id_, job.scene().id.substr(0, 12), settings.width,
               settings.height);
  return ok_status();
}

void JobReactor::OnCancel() {
  if (job_) job_->rendering->loop().cancel();
  stream_->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

void JobReactor::OnDone() {
  if (job_) {
    job_->rendering->publisher().detach(stream_.get());
    spdlog::info("job over id={}", job_id_);
  }
  job_.reset();
  if (!job_id_.empty()) core_.jobs.remove(job_id_);
  delete this;
}

}  // namespace helio
