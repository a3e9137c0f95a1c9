// Median and worst over scenes of the figures that each scene has.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/bench/reports/figures.h"

namespace helio::bench {

class OverScenes {
 public:
  // `figure`: of one scene, named without it. Its goal is one of every scene, and so of the worst and of the median,
  // unless `median_goal` says what the median is to be.
  void add(const Figure& figure, std::optional<double> median_goal = std::nullopt);

  // "all.NAME.median" and "all.NAME.worst", in the order in which names came first.
  void publish(Figures& figures) const;

 private:
  struct Series {
    Figure figure;  // of the first scene
    std::optional<double> median_goal;
    std::vector<double> values;
  };
  std::vector<Series> all_;
};

// Of values that are as good as `figure`'s goal says. Of a range the worst is the one that is furthest from its middle,
// the geometric one where the range is of positive values. Not a number is worse than any number. Precondition: not
// empty.
double worst_of(const std::vector<double>& values, const Figure& figure);

}  // namespace helio::bench
