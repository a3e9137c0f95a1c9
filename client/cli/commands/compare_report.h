// Output of `heliograph compare`: its progress line, the table at the end, and its JSON.
#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal.h"
#include "heliograph/v1/compare.pb.h"

namespace helio::cli {

// Time left, by the pictures that were rendered so far in the time that they took.
class CompareClock {
 public:
  explicit CompareClock(const heliograph::v1::CompareRecord& record);
  void progress(double now_s, bool rendering_modes);  // false: a reference is rendered
  void unit(const heliograph::v1::CompareUnit& unit);
  double seconds_left() const;  // < 0: not known yet

 private:
  double work_of(std::uint32_t budget) const;

  std::vector<double> budgets_;
  bool path_ = false;
  double work_ = 0, done_ = 0;  // in samples or seconds of a view
  double seconds_ = 0, last_s_ = 0;
  bool rendering_ = false;
};

// "combined: seed 2, 16 samples, view 3: 12 of 105 units, 42.0 s left"; of a reference what it has come to.
std::string describe(const heliograph::v1::CompareResponse::Progress& progress,
                     const heliograph::v1::CompareRecord& record, double seconds_left);

// Lines: of each mode the error after the last budget, its time, and how much sooner it comes to an equal error; then
// the sentences of the table.
std::vector<std::string> describe_table(const heliograph::v1::CompareRecord& record);

// The members modes, budgets, ..., points, ratios and sentences.
void add_comparison(Json& json, const heliograph::v1::CompareRecord& record);

extern const char* const kCompareJsonHelp;

}  // namespace helio::cli
