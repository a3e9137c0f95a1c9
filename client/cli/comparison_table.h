// What is computed of a comparison's units on this side of the wire: the table of those that there are, and ratios that
// the table does not have.
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

  // Of the mean errors of the whole picture, of one view: KIND_EQUAL_SAMPLES where both have the same budget.
  std::optional<heliograph::v1::CompareInterval> of_errors(heliograph::v1::CompareMeasure measure, std::uint32_t view,
                                                           const SeedsOf& top, const SeedsOf& bottom) const;
  // Of the geometric means of the seconds, which are means over all views: KIND_SPEED where both have the same budget.
  std::optional<heliograph::v1::CompareInterval> of_seconds(const SeedsOf& top, const SeedsOf& bottom) const;

 private:
  const heliograph::v1::CompareRecord& record_;
};

}  // namespace helio::cli
