// Plays a camera path in real time, as a hand on a mouse does: views leave at fixed moments, whatever comes back.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/camera_path.h"
#include "client/cli/commands/move_player.h"
#include "client/cli/interrupt.h"
#include "client/cli/terminal.h"
#include "client/render_client.h"

namespace helio::cli {

struct RealTimePlay {
  double rate = 20;         // views a second
  double rest_s = 2;        // at the first view, before the others leave
  double time_s = 0;        // of the views
  std::int64_t pixels = 0;  // of a whole picture
  double patience_s = 60;  // ReattachOptions
};

// Which pictures were shown, and when, on the now_s() clock. The first view that was sent is the one that rests.
class ShownPictures {
 public:
  explicit ShownPictures(std::int64_t pixels) : whole_(pixels) {}  // of a whole picture
  void sent(std::uint64_t view, double now_s) { sent_[view] = now_s; }
  void tile(std::uint64_t view, bool preview, const PixelRect& window, double now_s);

  // Of the views after the first: "views", "views_with_a_tile", "whole_pictures" (whole by `end_s`), "whole_share" (of
  // the views), "whole_per_second" (at `rate` views a second), "skipped_views" (never whole), "previews",
  // "age_p50_ms", "age_p95_ms" (from sending a view to its whole picture), and of the last one, from sending it,
  // "last_preview_whole_ms", "last_film_first_tile_ms", "last_film_whole_ms". null: there is none.
  Json report(double rate, double end_s) const;

 private:
  struct Arrival {
    double first_s = 0, whole_s = 0;  // 0: not yet
    std::int64_t pixels = 0;
    std::set<std::pair<int, int>> corners;  // of the tiles that came
  };
  std::map<std::uint64_t, double> sent_;  // by view, as the next two
  std::map<std::uint64_t, Arrival> previews_, films_;
  std::int64_t whole_;
};

// ShownPictures::report() as lines to read.
std::string describe_shown(const Json& shown);

// Opens the stream of a session that exists, plays the views, waits for the film of the last one to end, and ends the
// session. However it ends, `shown` gets what ShownPictures reports, null where fewer than two views were sent, and
// `last` what came of the film of the view that was sent last.
Status play_in_real_time(RenderClient& client, const std::string& session_id, const heliograph::v1::TileFormat& format,
                         const std::vector<PathView>& views, const RealTimePlay& play, const Interrupt& interrupt,
                         Terminal& terminal, TevBridge* tev, Json& shown, PlayedView& last);

}  // namespace helio::cli
