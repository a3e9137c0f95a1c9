// Names of a comparison's measures for readers, and how the measures are drawn.
#pragma once

#include <string>

#include "client/report/line_plot.h"
#include "heliograph/v1/compare.pb.h"

namespace helio::report {

struct MeasureName {
  std::string key;         // "relmse": in the page's identifiers
  std::string title;       // "Relative MSE"
  std::string definition;  // a clause for people to read
  PlotScale scale = PlotScale::logarithmic;
};
// A measure that this build does not know is named by its number.
MeasureName name_of(heliograph::v1::CompareMeasure measure);

// Smaller: asked for first.
int reading_order(heliograph::v1::CompareMeasure measure);

// "relative MSE" for "Relative MSE", "MSE" for "MSE".
std::string in_sentence(std::string title);

// "whole picture" for the empty region.
std::string region_title(const std::string& region);

}  // namespace helio::report
