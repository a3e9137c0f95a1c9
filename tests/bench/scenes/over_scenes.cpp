#include "tests/bench/scenes/over_scenes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/bench/reports/statistics.h"

namespace helio::bench {

namespace {

double badness(double value, const Figure& figure) {
  if (std::isnan(value)) return std::numeric_limits<double>::infinity();
  if (figure.better == Better::lower) return value;
  if (figure.better == Better::higher) return -value;
  const double least = figure.least.value_or(0), most = figure.goal.value_or(0);
  if (least > 0) return value > 0 ? std::abs(std::log(value / std::sqrt(least * most))) : INFINITY;
  return std::abs(value - (least + most) / 2);
}

}  // namespace

double worst_of(const std::vector<double>& values, const Figure& figure) {
  return *std::max_element(values.begin(), values.end(),
                           [&](double a, double b) { return badness(a, figure) < badness(b, figure); });
}

void OverScenes::add(const Figure& figure, std::optional<double> median_goal) {
  auto series = std::find_if(all_.begin(), all_.end(), [&](const Series& s) { return s.figure.name == figure.name; });
  if (series == all_.end()) series = all_.insert(series, {figure, median_goal, {}});
  series->values.push_back(figure.value);
}

void OverScenes::publish(Figures& figures) const {
  for (const Series& series : all_) {
    Figure middle = series.figure, worst = series.figure;
    middle.name = "all." + series.figure.name + ".median";
    middle.value = median(series.values);
    if (series.median_goal) middle.goal = series.median_goal;
    worst.name = "all." + series.figure.name + ".worst";
    worst.value = worst_of(series.values, series.figure);
    figures.add(middle);
    figures.add(worst);
  }
}

}  // namespace helio::bench
