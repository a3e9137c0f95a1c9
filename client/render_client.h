// The thin client of a Heliograph daemon: scenes, sessions, streams and jobs, as blocking calls with callbacks.
//
//   auto client = RenderClient::connect("127.0.0.1:7777");
//   auto scene = (*client)->upload_scene(*collect_local_scene("room.glb", ""));
//   heliograph::v1::RunJobRequest job;
//   job.set_scene_id(scene->scene().scene_id());
//   job.mutable_budget()->set_samples(64);
//   FrameAssembler picture;
//   auto end = (*client)->run_job(job, {.accepted = [&](auto& a) { picture.begin(a.settings()); },
//                                       .tile = [&](auto tile) { picture.add(std::move(tile)); }});
//
// Messages are those of proto/heliograph/v1, which states every field's unit, range and the meaning of zero.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/frame_stream.h"
#include "client/local_scene.h"
#include "client/service_link.h"
#include "renderer/base/result.h"

namespace helio {

struct SceneLoadRequest {
  double time_s = 0;      // the animation is evaluated at this time
  std::string animation;  // name or number of the clip to play; empty: the file's first
  bool strict = false;    // refuse files that break a rule of their format although their meaning is beyond doubt
  // Called during an upload with the bytes sent so far and in total.
  std::function<void(std::uint64_t, std::uint64_t)> uploaded;
};

// Called on the thread of run_job, in the order of arrival; empty ones are skipped.
struct JobCallbacks {
  std::function<void(const heliograph::v1::RunJobResponse::Accepted&)> accepted;
  std::function<void(const heliograph::v1::Progress&)> progress;
  std::function<void(heliograph::v1::Tile)> tile;
  // All tiles of a view of a path have come; those that follow are of the next one, which wants a FrameAssembler begun
  // anew. The last view's end is what run_job returns.
  std::function<void(const heliograph::v1::RunJobResponse::ViewResult&)> view_result;
};

// Called on the thread of compare, in the order of arrival; empty ones are skipped.
struct CompareCallbacks {
  std::function<void(const heliograph::v1::CompareResponse::Accepted&)> accepted;
  std::function<void(const heliograph::v1::CompareResponse::Progress&)> progress;
  std::function<void(const heliograph::v1::CompareResponse::Reference&)> reference;
  std::function<void(const heliograph::v1::CompareUnit&)> unit;
  std::function<void(heliograph::v1::CompareResponse::Picture)> picture;
};

// Thread safe: calls may run side by side. Every failure is an Error; ErrorCode::unavailable means that the daemon
// cannot be reached, drains, died or did not answer in time.
class RenderClient {
 public:
  // `address`: HOST:PORT or unix:PATH. Errors: invalid_argument (address), unavailable.
  static Result<std::unique_ptr<RenderClient>> connect(const std::string& address, const ConnectOptions& options = {});
  // Over a channel that exists already (in process). `peer` names the other side in messages.
  RenderClient(std::shared_ptr<grpc::Channel> channel, std::string peer, const ConnectOptions& options = {});

  const std::string& peer() const { return link_->peer(); }
  const std::string& token() const { return link_->options().token; }
  // For clients of single areas (client/jobs/job_client.h).
  std::shared_ptr<const ServiceLink> link() const { return link_; }

  // Waits until the daemon's address answers, at most so many seconds. False: it does not.
  bool reach(double seconds);

  Result<heliograph::v1::GetServerInfoResponse> server_info();

  // Uploads the scene's files in chunks, with their SHA-256.
  Result<heliograph::v1::LoadSceneResponse> upload_scene(const LocalScene& scene, const SceneLoadRequest& request = {},
                                                         CallControl* control = nullptr);
  // A path under the server's scene roots. `environment`: "", "R,G,B" or a map under the roots.
  Result<heliograph::v1::LoadSceneResponse> load_server_scene(const std::string& path, const std::string& environment,
                                                              const SceneLoadRequest& request = {},
                                                              CallControl* control = nullptr);
  Result<heliograph::v1::ListScenesResponse> list_scenes();
  // Asks for the cameras that the message had no room for.
  Status complete_cameras(heliograph::v1::SceneInfo& scene);
  Status unload_scene(const std::string& scene_id);
  // A scene that shares memory with the one that is edited; FrameStream::send_scene() switches a session to it.
  Result<heliograph::v1::EditSceneResponse> edit_scene(const heliograph::v1::EditSceneRequest& request,
                                                       CallControl* control = nullptr);

  Result<heliograph::v1::CreateSessionResponse> create_session(const heliograph::v1::CreateSessionRequest& request);
  Status close_session(const std::string& session_id);
  Result<heliograph::v1::ListSessionsResponse> list_sessions();
  Result<std::uint64_t> update_session(const heliograph::v1::UpdateSessionRequest& request);  // the new revision

  std::unique_ptr<FrameStream> stream_frames(const heliograph::v1::StreamRequest::Open& open, FrameCallbacks callbacks);
  // Blocks until the server or `control` ends the watch; callbacks come on this thread, `ended` is not called.
  Status watch_frames(const heliograph::v1::WatchFramesRequest& request, const FrameCallbacks& callbacks,
                      CallControl* control = nullptr);

  // Blocks until the job ends; a cancelled job ends with reason END_REASON_CANCELLED and what was rendered.
  Result<heliograph::v1::FrameEnd> run_job(const heliograph::v1::RunJobRequest& request, const JobCallbacks& callbacks,
                                           CallControl* control = nullptr);
  Status cancel_job(const std::string& job_id);

  // Blocks until every unit has come and answers the table of all. Cancelled by `control`, it ends with
  // ErrorCode::cancelled; units that came before stay valid, as CompareRequest.done of a later call.
  Result<heliograph::v1::CompareResponse::Result> compare(const heliograph::v1::CompareRequest& request,
                                                          const CompareCallbacks& callbacks,
                                                          CallControl* control = nullptr);
  // Sends an EXR file that pictures are to be compared with, in chunks, with its SHA-256. `uploaded` is called with the
  // bytes sent so far and in total.
  Result<heliograph::v1::LoadReferenceResponse> load_reference(
      const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& uploaded = {},
      CallControl* control = nullptr);

  // One sample again, told vertex by vertex; `token`: FrameEnd.replay_token. The scene must be loaded: not_found says
  // which.
  Result<heliograph::v1::ReplaySampleResponse> replay_sample(const std::string& token, CallControl* control = nullptr);

 private:
  std::shared_ptr<const ServiceLink> link_;
};

}  // namespace helio
