// What a comparison is asked for, read and checked.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "heliograph/v1/compare.pb.h"
#include "renderer/comparison/picture_errors.h"
#include "renderer/frame/render_settings.h"
#include "renderer/trace/camera/camera.h"
#include "server/scenes/scene_registry.h"

namespace helio {

namespace pb = heliograph::v1;

// A way to render that takes part.
struct ComparedMode {
  enum class Picture { film, display, preview };

  std::string name;
  RenderSettings settings;  // the seed is that of no unit
  Picture picture = Picture::film;
  bool oidn = false;  // of display: by Open Image Denoise

  unsigned channels() const;  // ResolveChannels that its pictures need
};

struct ReferenceRequest {
  // Rendered, unless `loaded` names one for each view.
  RenderSettings settings;
  double error = 0.01;  // root of the relative mean square error
  std::uint32_t max_samples = 65536;
  std::vector<std::string> loaded;
};

struct ComparisonRequest {
  std::vector<ComparedMode> modes;
  std::vector<CameraPose> views;  // at least one
  std::optional<Gaze> gaze;       // of all of them
  std::uint32_t seeds = 0;
  std::uint64_t first_seed = 0;
  bool common_seeds = false;
  std::vector<double> budgets;  // samples per pixel, or seconds of a view
  bool budgets_are_seconds = false;
  ReferenceRequest reference;
  PictureErrorOptions errors;
  bool flicker = false, told_rmse = false;  // the measures that need more than a picture and its reference
  bool exclusive = false, send_pictures = false;
  std::set<std::pair<std::string, std::uint32_t>> pictures_done;  // mode (empty: the reference) and view
  std::uint32_t worst_pixels = 0;
  std::vector<pb::CompareUnit> done;

  int width() const { return modes.front().settings.width; }
  int height() const { return modes.front().settings.height; }
  bool path() const { return views.size() > 1; }
  // The picture of this mode's (empty: the reference's) view is to be sent.
  bool sends(const std::string& mode, std::uint32_t view) const {
    return send_pictures && !pictures_done.contains({mode, view});
  }
  std::size_t units() const { return modes.size() * seeds * budgets.size() * views.size(); }
  // Of a mode's seed_number-th run, [1, seeds]: below 2^53, so that every language can say it.
  std::uint64_t seed(const ComparedMode& mode, std::uint32_t seed_number) const;
};

struct ComparisonLimits {
  RenderLimits film;
  std::uint64_t max_units = 0, max_pixels = 0;
  bool has_oidn = false, allow_exclusive = false;
};

// Cameras are those of the scene; null: it is not there, and views by name are not looked at. All problems together:
// invalid_argument; then permission_denied (exclusive), resource_exhausted (max_compare_units, max_compare_pixels,
// max_film_pixels).
Result<ComparisonRequest> read_comparison(const pb::CompareRequest& message, const LoadedScene* scene,
                                          const ComparisonLimits& limits);

// Of the request's complete settings.
pb::CompareMode to_message(const ComparedMode& mode);

}  // namespace helio
