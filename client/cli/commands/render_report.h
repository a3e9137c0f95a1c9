// What a frame's end tells, as JSON members and as a line to read.
#pragma once

#include <string>

#include "client/cli/terminal.h"
#include "heliograph/v1/types.pb.h"

namespace helio::cli {

// samples, render_seconds, rays, rays_per_path, estimated_rmse, estimated_relmse (null while unknown),
// invalid_samples, media_overflows, paths, light_paths, samples_per_second, worst_tile_rmse, all_black, unproven,
// hidden_rmse, reuse_share, verification_rays, ended_by, first_tile_seconds, pass_seconds {pass: processor time}, and
// when samples were invalid: first_invalid {x, y, half, index} (and light_path, where it was one that all pixels share)
// and replay_token.
void add_frame_end(Json& json, const heliograph::v1::FrameEnd& end);

// The same members from a progress report, for a frame that never came to its end.
void add_progress(Json& json, const heliograph::v1::Progress& progress);

// "64 samples in 3.21 s, 18.4 M rays/s, 83 % reused, error 0.0123 (relMSE 0.0045)"
std::string describe_end(const heliograph::v1::FrameEnd& end);

// Warnings that a result deserves: invalid samples, an all-black picture. Empty: none.
std::string caution(const heliograph::v1::FrameEnd& end);

}  // namespace helio::cli
