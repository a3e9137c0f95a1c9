// Units of a comparison and its table, between messages and the values of renderer/comparison.
#pragma once

#include <vector>

#include "renderer/comparison/comparison_table.h"
#include "server/compare/comparison_request.h"

namespace helio {

pb::CompareMeasure to_message(Measure measure);

ComparisonScript script_of(const ComparisonRequest& request);
ComparedUnit unit_of(const pb::CompareUnit& message);
pb::CompareTable to_message(const ComparisonTable& table);

}  // namespace helio
