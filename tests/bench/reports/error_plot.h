// A plot of curves, as an SVG file that needs nothing but a viewer.
#pragma once

#include <span>
#include <string>

#include "tests/bench/reports/error_report.h"

namespace helio::bench {

// One row of two panels for each scene: relMSE against seconds and against samples, both axes logarithmic, a line with
// a marker at every point and the confidence interval as a band. What is not positive and finite cannot be drawn on
// such axes and is left out; a band that reaches to 0 or below is drawn to the lower edge. SVG 1.1, text escaped.
std::string to_svg(std::span<const CurveReport> curves);

}  // namespace helio::bench
