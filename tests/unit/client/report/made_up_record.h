// A comparison that nobody rendered, for tests of its report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "heliograph/v1/compare.pb.h"

namespace helio::report {

struct RecordShape {
  std::vector<std::string> modes{"pt", "adaptive", "bdpt"};
  std::uint32_t seeds = 5, budgets = 7, views = 1;
  bool previews = false;  // the last mode's pictures are previews along a path
  int measures = 3;       // of the whole picture; the first three also of the dark half
  int width = 48, height = 32;
};

// Complete: every unit, point and ratio. The error of mode m at budget b is (1 + m) / 2^b in relMSE, with intervals of
// 10 % from five seeds on, its seconds are 0.1 x 2^b / (1 + m). "adaptive" is better, "bdpt" worse, later ones
// undecided.
heliograph::v1::CompareRecord made_up_record(const RecordShape& shape);

// Writes what pictures/ would hold and names it in the record: a gradient with a bright disc, modes with more and more
// noise.
void write_pictures(heliograph::v1::CompareRecord& record, const RecordShape& shape,
                    const std::filesystem::path& folder);

}  // namespace helio::report
