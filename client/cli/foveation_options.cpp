#include "client/cli/foveation_options.h"

#include "renderer/frame/render_settings.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

const std::vector<std::string> kMends = {"reject-history", "fixed-disk", "mean-rate", "surface-motion"};

}  // namespace

void add_foveation_options(CLI::App& app, FoveationOptions& options) {
  add_text(app, options.kind, "--foveation", "KIND",
           "none; density: samples go where the gaze is, fewer elsewhere; or paper: previews as published (Mrad 2022), "
           "a baseline. Default: none");
  add_text(app, options.viewing_distance, "--viewing-distance", "D",
           "Of the eye from the picture, in heights of the picture, [0.25, 20], with --foveation density. Default: 2");
  add_text(app, options.disk, "--paper-disk", "SHARE",
           "With --foveation paper: radius of the disk around the gaze, over the distance to the picture's farthest "
           "corner, [0.01, 1]. Default: 0.15");
  add_text(app, options.antialiasing, "--paper-antialiasing", "on|off",
           "With --foveation paper: temporal anti-aliasing outside the disk. Default: on");
  add_text(app, options.mends, "--paper-mend", "LIST",
           "With --foveation paper: faults to mend, comma-separated, of " + join(kMends, ", ") + ". Default: none");
}

bool read_foveation(const FoveationOptions& options, OptionReader& reader, pb::RenderSettings& settings) {
  const std::string kind = reader.choice(options.kind, {"none", "density", "paper"}).value_or("none");
  const bool density = kind == "density", paper = kind == "paper";
  if (density) settings.set_foveation(pb::FOVEATION_DENSITY);
  if (paper) settings.set_foveation(pb::FOVEATION_PAPER);
  if (const auto distance = reader.number(options.viewing_distance, find_field("viewing_distance", {})->range))
    settings.set_viewing_distance(*distance);
  if (options.viewing_distance.given() && !density)
    reader.problem(options.viewing_distance, "is only valid with --foveation density");
  for (const TextOption* option : {&options.disk, &options.antialiasing, &options.mends})
    if (option->given() && !paper) reader.problem(*option, "is only valid with --foveation paper");
  pb::FoveationPaperSettings published;
  if (const auto disk = reader.number(options.disk, find_field("foveation_paper.disk", {})->range))
    published.set_disk(*disk);
  published.set_without_antialiasing(reader.choice(options.antialiasing, {"on", "off"}) == "off");
  for (const std::string& mend : reader.choices(options.mends, kMends)) {
    if (mend == "reject-history") published.set_reject_history(true);
    if (mend == "fixed-disk") published.set_fixed_disk(true);
    if (mend == "mean-rate") published.set_mean_rate(true);
    if (mend == "surface-motion") published.set_surface_motion(true);
  }
  if (paper) *settings.mutable_foveation_paper() = published;
  return density || paper;
}

std::optional<pb::Gaze> read_point(const TextOption& option, OptionReader& reader) {
  const auto point = reader.pair(option, {-kMostGazePixels, kMostGazePixels});
  if (!point) return std::nullopt;
  pb::Gaze gaze;
  gaze.set_x(point->first);
  gaze.set_y(point->second);
  return gaze;
}

pb::Gaze centre_of_film(const pb::RenderSettings& settings) {
  pb::Gaze gaze;
  gaze.set_x(0.5 * settings.width());
  gaze.set_y(0.5 * settings.height());
  return gaze;
}

}  // namespace helio::cli
