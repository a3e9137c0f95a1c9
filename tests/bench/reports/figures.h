// What a bench reports: named figures with unit, goal and direction.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace helio::bench {

enum class Better { lower, higher, within };

struct Figure {
  std::string name;  // "cornell.ray_share"
  double value = 0;
  std::string unit;
  std::optional<double> goal;  // in the same unit; none: reported for information; within: the most
  Better better = Better::lower;
  std::optional<double> least = std::nullopt;  // within: the other end of the range; always there where goal is

  bool meets_goal() const {
    if (!goal) return true;
    return better == Better::higher ? value >= *goal : value <= *goal && (better == Better::lower || value >= *least);
  }
};

class Figures {
 public:
  void add(Figure figure) { items_.push_back(std::move(figure)); }
  const std::vector<Figure>& items() const { return items_; }

  // {"figures": {name: {"value", "unit", "goal", "better"}}}; goal is null where there is none. Of a range goal is the
  // most, and "least" is there too. Values that are not finite are null.
  std::string json() const;
  std::string table() const;

 private:
  std::vector<Figure> items_;
};

// Why a figure is missing or not to be trusted: one line on stderr.
void note(const std::string& text);

}  // namespace helio::bench
