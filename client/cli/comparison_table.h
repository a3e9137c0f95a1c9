// Computes the table of a comparison from the units that there are, for comparisons that ended early, and ratios that
// the daemon's table does not have.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "heliograph/v1/compare.pb.h"

namespace helio::cli {

// As the daemon makes it at the end of a comparison, of a record that has not come to its end: marked as partial, in
// words as well. None without units.
std::optional<heliograph::v1::CompareTable> partial_table(const heliograph::v1::CompareRecord& record);

// Seeds of one mode at one budget, by the record's request.
struct SeedsOf {
  std::string mode;
  std::uint32_t budget = 0;
};

// Ratios with the interval of CompareRatio: the jackknife over seeds on logarithms, paired by seed where both have the
// same ones, that is with common_seeds, or within one mode. None where a side has no seeds, or a mean is not positive.
class SeedRatios {
 public:
  explicit SeedRatios(const heliograph::v1::CompareRecord& record);

  // Ratio of the mean errors of a region, or, if that is empty, of the whole picture, for one view: KIND_EQUAL_SAMPLES
  // where both have the same budget.
  std::optional<heliograph::v1::CompareInterval> of_errors(heliograph::v1::CompareMeasure measure, std::uint32_t view,
                                                           const SeedsOf& top, const SeedsOf& bottom,
                                                           const std::string& region = {}) const;
  // Ratio of the geometric means of the seconds, which are means over all views: KIND_SPEED where both have the same
  // budget.
  std::optional<heliograph::v1::CompareInterval> of_seconds(const SeedsOf& top, const SeedsOf& bottom) const;

 private:
  const heliograph::v1::CompareRecord& record_;
};

}  // namespace helio::cli
