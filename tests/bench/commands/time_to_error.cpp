#include "tests/bench/commands/time_to_error.h"

#include "renderer/metrics/error_metrics.h"
#include "tests/bench/reports/statistics.h"

namespace helio::bench {

void add_compared(const std::string& name, const std::vector<double>& ours, const std::vector<double>& theirs,
                  double goal_ratio, Figures& figures) {
  const double seconds = median(ours);
  if (theirs.empty()) {
    figures.add({name, seconds, "s", std::nullopt, Better::lower});
    return;
  }
  const double peer_seconds = median(theirs);
  figures.add({name, seconds, "s", goal_ratio * peer_seconds, Better::lower});
  figures.add({name + ".over_mitsuba", seconds / peer_seconds, "x", goal_ratio, Better::lower});
  figures.add({name + ".mitsuba", peer_seconds, "s", std::nullopt, Better::lower});
}

Result<std::vector<CurvePoint>> our_curve(const std::shared_ptr<const RenderScene>& scene, RenderEngine& engine,
                                          const RenderSettings& settings, const LoopPicture& reference,
                                          const ErrorGoal& goal, const std::vector<int>& counts, double most_seconds) {
  std::vector<CurvePoint> curve;
  for (const int samples : counts) {
    auto picture = render_picture(engine, scene, settings, std::uint32_t(samples));
    if (!picture) return picture.error();
    const auto error = relative_error(picture->view(), reference.view(), RelativeEpsilon::fixed(goal.epsilon));
    if (!error) return error.error();
    curve.push_back({samples, picture->seconds, error.value().relmse});
    if (error.value().relmse <= goal.target || picture->seconds > most_seconds) break;
  }
  return curve;
}

}  // namespace helio::bench
