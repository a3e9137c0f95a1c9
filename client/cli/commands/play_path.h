// Plays a camera path in real time, as a hand on a mouse does: views leave at fixed moments, whatever comes back.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client/camera_path.h"
#include "client/cli/commands/move_player.h"
#include "client/cli/interrupt.h"
#include "client/cli/terminal.h"
#include "client/render_client.h"

namespace helio::cli {

struct RealTimePlay {
  double rate = 20;        // views a second
  double rest_s = 2;       // at the first view, before the others leave
  double time_s = 0;       // of the views
  std::int64_t pixels = 0;  // of a whole picture
};

// What was shown, in seconds since the play began; ids of views are from 1, the first one's rest.
class ShownPictures {
 public:
  explicit ShownPictures(std::int64_t pixels) : whole_(pixels) {}  // of a whole picture
  void sent(std::uint64_t view, double now) { sent_[view] = now; }
  // A tile of so many pixels; `pass` of the film.
  void tile(std::uint64_t view, bool preview, std::uint32_t pass, std::int64_t pixels, double now);

  // {"views", "views_with_a_tile", "whole_pictures", "whole_share", "whole_per_second", "skipped_views", "previews",
  // "age_p50_ms", "age_p95_ms", "last_preview_whole_ms", "last_film_first_tile_ms", "last_film_whole_ms"}: of the views
  // after the first, pictures that were whole by `end`. What there is none of is null.
  Json report(double seconds, double end) const;

 private:
  struct Arrival {
    double first = 0, whole = 0;  // 0: not yet
    std::int64_t pixels = 0;      // of the first pass
  };
  std::map<std::uint64_t, double> sent_;
  std::map<std::uint64_t, Arrival> previews_, films_;
  std::int64_t whole_;
};

// Opens the stream of a session that exists, plays the views and waits for the last one's film to end. `json` gets what
// ShownPictures reports; `last` holds the film's picture of the last view.
Status play_in_real_time(RenderClient& client, const std::string& session_id, const heliograph::v1::TileFormat& format,
                         const std::vector<PathView>& views, const RealTimePlay& play, const Interrupt& interrupt,
                         Terminal& terminal, Json& json, PlayedView& last);

}  // namespace helio::cli
