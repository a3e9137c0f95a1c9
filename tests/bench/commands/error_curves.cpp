#include "tests/bench/commands/error_curves.h"

#include <cstdio>

#include "renderer/metrics/dark_half.h"
#include "renderer/metrics/dssim.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/bench/reports/error_plot.h"
#include "tests/bench/reports/report_files.h"

namespace helio::bench {

Result<PictureError> picture_error(const PictureView& view, double seconds, const LoopPicture& reference) {
  const auto squared = squared_error(view, reference.view());
  if (!squared) return squared.error();
  const auto relative = relative_error(view, reference.view());
  if (!relative) return relative.error();
  const auto structural = dssim(view, reference.view());
  if (!structural) return structural.error();
  const auto bias = estimate_bias({&view, 1}, reference.view());
  if (!bias) return bias.error();
  const DarkHalf dark = compare_dark_half(view, reference.view());
  return PictureError{seconds,           squared->mse, relative->relmse,
                      structural->dssim, bias->bias,   squared->distance_variance,
                      dark.relmse,       dark.bias};
}

std::vector<int> doubling_counts(int most) {
  std::vector<int> counts;
  for (int n = 1; n < most; n *= 2) counts.push_back(n);
  counts.push_back(most);
  return counts;
}

Result<std::vector<CurveReport>> measure_curves(const ErrorScene& scene, const std::vector<Contender>& contenders,
                                                const std::vector<int>& counts, int seeds) {
  // By contender, then count.
  std::vector<std::vector<std::vector<PictureError>>> errors(contenders.size(),
                                                             std::vector<std::vector<PictureError>>(counts.size()));
  for (int seed = 0; seed <= seeds; ++seed) {  // 0: the warm-up
    for (std::size_t k = 0; k < counts.size(); ++k) {
      for (std::size_t i = 0; i < contenders.size(); ++i) {
        const auto picture = contenders[i].render(counts[k], std::uint64_t(seed));
        if (!picture) return picture.error();
        const auto error = picture_error(picture->view(), picture->seconds, scene.reference);
        if (!error) return error.error();
        if (seed > 0) errors[i][k].push_back(*error);
      }
    }
  }
  std::vector<CurveReport> curves;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    CurveReport curve{scene.name, contenders[i].renderer, contenders[i].mode, reference_mse(scene), {}};
    for (std::size_t k = 0; k < counts.size(); ++k) curve.points.push_back(summarise(counts[k], errors[i][k]));
    curves.push_back(std::move(curve));
  }
  return curves;
}

Status publish_curves(const std::vector<CurveReport>& curves, bool as_json, const std::string& folder) {
  std::printf("%s\n", (as_json ? to_json(curves) : to_table(curves)).c_str());
  return write_reports(
      folder,
      {{"curves.json", to_json(curves) + "\n"}, {"curves.csv", to_csv(curves)}, {"curves.svg", to_svg(curves)}});
}

}  // namespace helio::bench
