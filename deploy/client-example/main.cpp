// Renders one frame of a scene on a daemon. usage: render_frame HOST:PORT SCENE PICTURE.exr
#include <cstdio>

#include "client/frame_assembler.h"
#include "client/render_client.h"
#include "renderer/codec/tile_codec.h"

namespace {

int fail(const helio::Error& error) {
  std::fprintf(stderr, "render_frame: %s\n", error.to_string().c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return fail({helio::ErrorCode::invalid_argument, "HOST:PORT SCENE PICTURE.exr", "usage"});
  const auto client = helio::RenderClient::connect(argv[1]);
  if (!client) return fail(client.error());
  const auto files = helio::collect_local_scene(argv[2], "");
  if (!files) return fail(files.error());
  const auto scene = (*client)->upload_scene(*files);
  if (!scene) return fail(scene.error());

  heliograph::v1::RunJobRequest job;
  job.set_scene_id(scene->scene().scene_id());
  job.mutable_settings()->set_width(320);
  job.mutable_settings()->set_height(240);
  job.mutable_budget()->set_samples(16);
  helio::FrameAssembler frame;
  helio::JobCallbacks callbacks;
  callbacks.accepted = [&](const auto& accepted) { (void)frame.begin(accepted.settings()); };
  callbacks.tile = [&](auto tile) { (void)frame.add(std::move(tile)); };
  if (const auto end = (*client)->run_job(job, callbacks); !end) return fail(end.error());

  const auto picture = frame.picture();
  if (!picture) return fail(picture.error());
  const helio::Picture& p = **picture;
  std::vector<helio::TileChannel> channels;
  for (std::size_t i = 0; i < p.names.size(); ++i) channels.push_back({p.names[i], p.planes[i].data()});
  const auto written = helio::write_exr(argv[3], {p.window, p.frame_width, p.frame_height}, channels, {});
  return written ? 0 : fail(written.error());
}
