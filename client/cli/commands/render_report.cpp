#include "client/cli/commands/render_report.h"

#include <spdlog/fmt/fmt.h>

#include "client/cli/commands/replay_report.h"
#include "client/enum_names.h"

namespace helio::cli {

void add_progress(Json& json, const pb::Progress& progress) {
  const pb::ErrorEstimate& error = progress.error();
  const auto known = [&](double value) { return error.known() ? Json(value) : Json(nullptr); };
  json["samples"] = progress.samples_per_pixel();
  json["render_seconds"] = progress.seconds();
  json["rays"] = progress.rays();
  json["rays_per_path"] = progress.paths() > 0 ? double(progress.rays()) / double(progress.paths()) : 0.0;
  json["estimated_rmse"] = known(error.rmse());
  json["estimated_relmse"] = known(error.relmse());
  json["invalid_samples"] = progress.invalid_samples();
  json["media_overflows"] = progress.media_overflows();
  json["paths"] = progress.paths();
  json["light_paths"] = progress.light_paths();
  json["samples_per_second"] = progress.samples_per_second();
  json["worst_tile_rmse"] = known(error.worst_tile_rmse());
  json["all_black"] = error.all_black();
  json["unproven"] = error.unproven();
  json["hidden_rmse"] = error.all_black() ? Json() : known(error.hidden_rmse());
  json["bias"] = error.bias();
  json["bias_error"] = error.bias_error();
  json["reuse_share"] = progress.reuse_share();
  json["verification_rays"] = progress.verification_rays();
}

void add_frame_end(Json& json, const pb::FrameEnd& end) {
  add_progress(json, end.totals());
  json["ended_by"] = to_short_name(end.reason());
  json["first_tile_seconds"] = end.first_tile_seconds();
  json["pass_seconds"] = Json::object();
  for (const pb::PassTime& pass : end.passes()) json["pass_seconds"][pass.pass()] = pass.seconds();
  if (end.has_first_invalid()) {
    json["first_invalid"] = {{"x", end.first_invalid().x()},
                             {"y", end.first_invalid().y()},
                             {"half", end.first_invalid().half()},
                             {"index", end.first_invalid().index()}};
    if (end.first_invalid().light_path() > 0) json["first_invalid"]["light_path"] = end.first_invalid().light_path();
    json["replay_token"] = end.replay_token();
  }
}

std::string describe_end(const pb::FrameEnd& end) {
  const pb::Progress& totals = end.totals();
  std::string line = fmt::format("{} samples in {}", totals.samples_per_pixel(), human_seconds(totals.seconds()));
  if (totals.seconds() > 0) line += fmt::format(", {} rays/s", human_count(double(totals.rays()) / totals.seconds()));
  if (totals.light_paths() > 0) line += fmt::format(", {} light paths", human_count(double(totals.light_paths())));
  if (totals.reuse_share() > 0) line += fmt::format(", {:.0f} % reused", 100 * totals.reuse_share());
  if (totals.error().known()) {
    line += fmt::format(", error {:.3g} (relMSE {:.3g})", totals.error().rmse(), totals.error().relmse());
  }
  if (totals.error().bias_error() > 0)
    line += fmt::format(", bias {:+.2g} +- {:.1g}", totals.error().bias(), totals.error().bias_error());
  return line;
}

std::string caution(const pb::FrameEnd& end) {
  std::string text;
  if (end.totals().error().all_black())
    text = "no sample returned light: the picture is black, its error unknown";
  else if (end.totals().error().hidden_rmse() > end.totals().error().rmse())
    text = fmt::format("{:.2g} % of the pixels saw no light although it may reach them: the error may be {:.2g} more",
                       100 * end.totals().error().unproven(), end.totals().error().hidden_rmse());
  if (end.totals().media_overflows() > 0) {
    if (!text.empty()) text += "; ";
    text += fmt::format(
        "volumes lie within eight others, {} times entered: they absorb what the innermost of the eight does",
        human_count(double(end.totals().media_overflows())));
  }
  if (end.totals().invalid_samples() == 0) return text;
  if (!text.empty()) text += "; ";
  text += fmt::format("{} samples were NaN or infinite and left out", end.totals().invalid_samples());
  if (end.has_first_invalid()) {
    text += fmt::format(" (first: {})", describe_id(end.first_invalid()));
  }
  if (!end.replay_token().empty()) {
    text += fmt::format("; to see it: heliograph replay {} and the scene as it was given here", end.replay_token());
  }
  return text;
}

}  // namespace helio::cli
