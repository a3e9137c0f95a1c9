// Messages <-> values. Every function that reads a message reports all problems that it finds, with field, value and
// allowed range, and fills in the defaults that the protocol states for zero.
#pragma once

#include <string>
#include <vector>

#include "heliograph/v1/frame_stream.pb.h"
#include "heliograph/v1/job.pb.h"
#include "heliograph/v1/render_service.pb.h"
#include "heliograph/v1/types.pb.h"
#include "renderer/base/result.h"
#include "renderer/frame/frame_sink.h"
#include "renderer/frame/render_settings.h"
#include "server/stream/outbound_queue.h"
#include "server/stream/tile_encoder.h"

namespace helio {

namespace pb = heliograph::v1;

RenderSettings read_settings(const pb::RenderSettings& message, const RenderLimits& limits, const std::string& where,
                             Problems& problems);
// `scale`: 0 stands for the filter's default. `where` is that of the message that holds filter and filter_scale.
PixelFilter read_filter(pb::PixelFilter kind, double scale, const std::string& where, Problems& problems);
// Defaults where the integrator does without.
LightCacheSettings read_light_cache(const pb::LightCacheSettings& message, Integrator integrator);
pb::LightCacheSettings to_message(const LightCacheSettings& cache);
pb::PixelFilter to_message(PixelFilterKind kind);
// Checked with the settings that it is part of.
Technique read_technique(const pb::Technique& message);
// resource_exhausted, naming max_film_pixels, for a film that is too large. Call it with settings without problems.
Status check_film_size(const RenderSettings& settings, const RenderLimits& limits, const std::string& where);
Budget read_budget(const pb::Budget& message, const std::string& where, Problems& problems);
TileFormat read_tile_format(const pb::TileFormat& message, const std::string& where, Problems& problems);
// `cameras` are the scene's: a view may name one.
CameraPose read_camera(const pb::CameraView& message, const std::vector<CameraDescription>& cameras,
                       const std::string& where, Problems& problems);

struct ViewRules {
  const std::vector<CameraDescription>* cameras = nullptr;
  double scene_time_s = 0;
  std::uint64_t last_view_id = 0;
};
View read_view(const pb::View& message, const ViewRules& rules, const std::string& where, Problems& problems);

// A required id: 1 to 64 bytes.
void check_id(const std::string& id, const std::string& where, Problems& problems);

void write_rect(const PixelRect& rect, pb::Rect& message);
pb::Mode to_message(RenderMode mode);
pb::Integrator to_message(Integrator integrator);
pb::Technique to_message(const Technique& technique);
pb::RenderSettings to_message(const RenderSettings& settings);
pb::Budget to_message(const Budget& budget);
pb::CameraView to_message(const CameraPose& pose);
pb::FrameTag to_message(const FrameTag& tag, const std::string& session_id);
pb::FrameBegin to_message(const FrameBegin& begin, const std::string& session_id);
pb::Progress to_message(const FrameProgress& progress, const std::string& session_id);
pb::FrameEnd to_message(const FrameReport& report, const std::string& session_id);
pb::Notice to_message(const Notice& notice);
// Everything but the EXR itself.
pb::Tile to_message(const EncodedTile& tile, const std::string& session_id);

}  // namespace helio
