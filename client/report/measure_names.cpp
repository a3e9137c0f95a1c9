#include "client/report/measure_names.h"

#include <algorithm>
#include <cctype>
#include <iterator>

namespace helio::report {
namespace {

namespace pb = heliograph::v1;

struct Row {
  pb::CompareMeasure measure;
  const char *key, *title, *definition;
  PlotScale scale;
};
constexpr auto kLogarithmic = PlotScale::logarithmic;
// In the order of reading. x is the picture, r the reference; means are over pixels and channels.
const Row kRows[] = {
    {pb::COMPARE_MEASURE_RELMSE, "relmse", "Relative MSE",
     "mean of (x − r)² / (r² + 0.01 mean(r)²), x the picture and r its reference", kLogarithmic},
    {pb::COMPARE_MEASURE_MSE, "mse", "MSE", "mean of (x − r)², x the picture and r its reference, in radiance squared",
     kLogarithmic},
    {pb::COMPARE_MEASURE_HDR_FLIP, "hdr_flip", "HDR-FLIP", "mean of HDR-FLIP (Andersson et al. 2021)", kLogarithmic},
    {pb::COMPARE_MEASURE_HDR_FLIP_MEDIAN, "hdr_flip_median", "HDR-FLIP, weighted median",
     "the HDR-FLIP value above and below which lies half of the picture's sum", kLogarithmic},
    {pb::COMPARE_MEASURE_FLIP, "flip", "LDR-FLIP", "mean of LDR-FLIP (Andersson et al. 2020)", kLogarithmic},
    {pb::COMPARE_MEASURE_FLIP_MEDIAN, "flip_median", "LDR-FLIP, weighted median",
     "the LDR-FLIP value above and below which lies half of the picture's sum", kLogarithmic},
    {pb::COMPARE_MEASURE_DSSIM, "dssim", "DSSIM", "1 / SSIM − 1 (Wang et al. 2004)", kLogarithmic},
    {pb::COMPARE_MEASURE_FLICKER, "flicker", "Flicker",
     "mean change of the error from the view before, each pixel followed to where it was, in radiance", kLogarithmic},
    {pb::COMPARE_MEASURE_DISTANCE_VARIANCE, "distance_variance", "Variance of the distance",
     "variance over pixels and channels of |x − r| (Schalk 2018), in radiance squared", kLogarithmic},
    {pb::COMPARE_MEASURE_BIAS, "bias", "Bias", "mean of x − r over the mean of r; its sign matters, 0 is best",
     PlotScale::linear},
    {pb::COMPARE_MEASURE_OUTLIER_SHARE, "outlier_share", "Share of outliers",
     "share of the squared relative error that the 0.1 % of pixels with the largest have; no measure of quality",
     PlotScale::linear},
    {pb::COMPARE_MEASURE_TOLD_RMSE, "told_rmse", "Reported standard error",
     "standard error that the mode itself reports of its picture, in radiance; no measured error", kLogarithmic},
};

const Row* row_of(pb::CompareMeasure measure) {
  const auto found =
      std::find_if(std::begin(kRows), std::end(kRows), [&](const Row& row) { return row.measure == measure; });
  return found == std::end(kRows) ? nullptr : found;
}

}  // namespace

MeasureName name_of(pb::CompareMeasure measure) {
  if (const Row* row = row_of(measure)) return {row->key, row->title, row->definition, row->scale};
  const std::string digits = std::to_string(int(measure));
  return {"measure-" + digits, "Measure " + digits, "a measure that this version does not know", PlotScale::linear};
}

int reading_order(pb::CompareMeasure measure) {
  const Row* row = row_of(measure);
  return row ? int(row - kRows) : int(std::size(kRows)) + int(measure);
}

std::string in_sentence(std::string title) {
  const auto lower = [](char letter) { return letter >= 'a' && letter <= 'z'; };
  if (title.size() > 1 && lower(title[1])) title[0] = char(std::tolower(static_cast<unsigned char>(title[0])));
  return title;
}

std::string region_title(const std::string& region) {
  return region.empty() ? "whole picture" : region;
}

}  // namespace helio::report
