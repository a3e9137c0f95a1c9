// Lines with intervals over a logarithmic axis, as SVG 1.1 that needs neither script nor network.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace helio::report {

struct PlotPoint {
  double x = 0, y = 0;
  struct Band {
    double low = 0, high = 0;
  };
  std::optional<Band> interval;  // of y; none: not known
};

struct PlotSeries {
  std::size_t style = 0;  // colour, dashes and marker: see series_class()
  std::vector<PlotPoint> points;
};

enum class PlotScale {
  logarithmic,  // what is not positive cannot be drawn and is left out; a band from there begins at the lower edge
  linear,
};

struct LinePlot {
  std::string x_label, y_label;
  PlotScale x_scale = PlotScale::logarithmic, y_scale = PlotScale::logarithmic;
  std::vector<PlotSeries> series;
  std::vector<double> x_ticks = {};  // those of them that the axis reaches; empty: round numbers
};

// Pixels of a panel with its labels.
inline constexpr double kPanelWidth = 560, kPanelHeight = 370;

// The contents of one panel, its corner at (left, top), without the element <svg>: axes, then for each series that has
// anything to draw one group of series_class() with a path of class "band", where intervals are known, and one of class
// "curve". Colours, dashes and markers come from plot_style(). Empty: nothing can be drawn.
std::string draw_panel(const LinePlot& plot, double left = 0, double top = 0);

// Number of points that the scales cannot show.
int points_left_out(const LinePlot& plot);

// "series s3": colour, dashes and marker of a style. No two of the first 280 are equal; the first eight differ in
// colour, and any five that follow each other in dashes and in marker.
std::string series_class(std::size_t style);

// A line with a marker as the curve of that style has it, 44 x 14 pixels, an <svg> of its own.
std::string legend_sample(std::size_t style);

// <defs> with the markers of styles [0, count): once a document.
std::string plot_markers(std::size_t count);

// CSS that styles [0, count) need: for light pages and, with `dark_too`, for dark ones.
std::string plot_style(std::size_t count, bool dark_too);

}  // namespace helio::report
