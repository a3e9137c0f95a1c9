// Messages <-> values. Every function that reads a message reports all problems that it finds, with field, value and
// allowed range, and fills in the defaults that the protocol states for zero.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "heliograph/v1/frame_stream.pb.h"
#include "heliograph/v1/job.pb.h"
#include "heliograph/v1/render_service.pb.h"
#include "heliograph/v1/types.pb.h"
#include "renderer/base/result.h"
#include "renderer/frame/frame_sink.h"
#include "server/stream/outbound_queue.h"
#include "server/stream/settings_messages.h"
#include "server/stream/tile_encoder.h"

namespace helio {

// has_oidn: the daemon has Open Image Denoise, without which no format may ask for it.
TileFormat read_tile_format(const pb::TileFormat& message, const std::string& where, Problems& problems,
                            bool has_oidn = false);
// `cameras` are the scene's: a view may name one.
CameraPose read_camera(const pb::CameraView& message, const std::vector<CameraDescription>& cameras,
                       const std::string& where, Problems& problems);

struct ViewRules {
  const std::vector<CameraDescription>* cameras = nullptr;
  double scene_time_s = 0;
  std::uint64_t last_view_id = 0;
};
std::optional<Gaze> read_gaze(const pb::StreamRequest::MoveGaze& message, const std::string& where,
                              Problems& problems);
View read_view(const pb::View& message, const ViewRules& rules, const std::string& where, Problems& problems);

// A required id: 1 to 64 bytes.
void check_id(const std::string& id, const std::string& where, Problems& problems);

pb::CameraView to_message(const CameraPose& pose);
pb::FrameTag to_message(const FrameTag& tag, const std::string& session_id);
pb::FrameBegin to_message(const FrameBegin& begin, const std::string& session_id);
pb::Progress to_message(const FrameProgress& progress, const std::string& session_id);
pb::FrameEnd to_message(const FrameReport& report, const std::string& session_id);
pb::Notice to_message(const Notice& notice);
// Everything but the EXR or JPEG file itself.
pb::Tile to_message(const EncodedTile& tile, const std::string& session_id);

}  // namespace helio
