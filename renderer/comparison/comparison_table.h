// From pictures' errors to answers: curves over seeds, and one mode against another with intervals.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "renderer/comparison/interval.h"
#include "renderer/comparison/measures.h"

namespace helio {

// One picture: of one mode, seed, budget and view.
struct ComparedUnit {
  std::string mode;
  std::uint32_t seed_number = 1;
  std::uint32_t budget = 0, view = 0;  // indices
  double seconds = 0;                  // wall time in which it was rendered
  double samples = 0;                  // per pixel
  std::vector<MeasuredValue> values;
  bool disturbed = false;
  std::uint32_t call = 0;  // that it comes from: its modes took turns; 0: not known
};

struct ComparisonScript {
  std::vector<std::string> modes;    // the first is what the others are compared with
  std::vector<double> budgets;       // rising
  bool budgets_are_seconds = false;  // false: samples per pixel
  std::uint32_t views = 1;
  bool common_seeds = false;  // ratios are then paired by seed
  // Modes whose pictures are previews along a path: view 0 is a film of the budget, each later view one preview, whose
  // seconds and samples do not follow the budget. They have no effect with one view.
  std::vector<std::string> preview_modes;
};

// All seeds of one mode, budget and view; of a path also of all views, whose values are each seed's means over them. A
// preview mode's means leave out view 0, which is no preview.
struct ComparedPoint {
  struct Value {
    Measure measure = Measure::mse;
    std::string region;
    Interval value;                  // within possible_values(); of bias with the reference's noise, where it is known
    bool few_pixels_decide = false;  // heavy_tails.h
  };
  std::string mode;
  std::uint32_t budget = 0;
  std::optional<std::uint32_t> view;  // none: all views of a path
  std::uint32_t seeds = 0;
  Interval seconds;
  double samples = 0;
  std::vector<Value> values;
  std::uint32_t disturbed = 0;  // units
};

enum class RatioKind {
  // The baseline's time over the mode's to the same error: above 1, the mode is faster. Not of preview modes.
  equal_error,
  equal_time,  // the mode's error over the baseline's after the same time: below 1, the mode is better
  // The mode's error over the baseline's after the same budget of samples. Not of preview modes.
  equal_samples,
  speed,  // the mode's time over the baseline's for the same budget of samples. Not of preview modes
};
enum class Verdict { better, worse, undecided };

struct ComparedRatio {
  RatioKind kind = RatioKind::equal_error;
  std::string mode, baseline;
  Measure measure = Measure::relmse;  // not of speed
  std::string region;
  double at = 0;  // error, seconds or samples
  Interval ratio;
  Verdict verdict = Verdict::undecided;
  bool few_pixels_decide = false;  // one of the two errors, or both: nothing is decided then
  // A ratio of times, or after equal times, of modes that took no turns, as most of their seeds are from different
  // calls: what else the machine did then is in it, and nothing is decided.
  bool different_calls = false;

  // Both modes have the same error in every seed.
  bool equal() const { return ratio.known && ratio.low == 1 && ratio.high == 1; }
};

struct ComparisonTable {
  std::vector<ComparedPoint> points;  // by mode, budget and view, in the script's order
  std::vector<ComparedRatio> ratios;
  std::vector<std::string> sentences;
};

// Units may come in any order and need not be complete; those that the script does not know are left out.
ComparisonTable compare_units(const ComparisonScript& script, const std::vector<ComparedUnit>& units);

}  // namespace helio
