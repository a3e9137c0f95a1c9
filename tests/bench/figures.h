// What a bench reports: named figures with unit, goal and direction.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace helio::bench {

enum class Better { lower, higher };

struct Figure {
  std::string name;  // "cornell.ray_share"
  double value = 0;
  std::string unit;
  std::optional<double> goal;  // in the same unit; none: reported for information
  Better better = Better::lower;

  bool meets_goal() const { return !goal || (better == Better::lower ? value <= *goal : value >= *goal); }
};

class Figures {
 public:
  void add(Figure figure) { items_.push_back(std::move(figure)); }
  const std::vector<Figure>& items() const { return items_; }

  // {"figures": {name: {"value", "unit", "goal", "better"}}}; goal is null where there is none.
  std::string json() const;
  std::string table() const;

 private:
  std::vector<Figure> items_;
};

// Why a figure is missing or not to be trusted: one line on stderr.
void note(const std::string& text);

}  // namespace helio::bench
