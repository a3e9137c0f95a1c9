// The tables of a comparison as CSV (RFC 4180): a header, then a line for each; numbers in full precision, a cell is
// empty where there is nothing to say.
#pragma once

#include <string>
#include <vector>

#include "heliograph/v1/compare.pb.h"

namespace helio {

// mode, seed_number, seed, budget (samples per pixel or seconds, as the header says), view, seconds, samples, rays,
// paths, invalid_samples, reuse_share, others_share, disturbed, then a column for each measure that a unit has:
// "relmse", "relmse dark half".
std::string units_csv(const heliograph::v1::CompareRecord& record);
// A line for each measure and region of each point; view "all" is a path's.
std::string points_csv(const heliograph::v1::CompareRecord& record);
std::string ratios_csv(const heliograph::v1::CompareRecord& record);

// One line, with its end; cells are quoted where they have to be.
std::string csv_line(const std::vector<std::string>& cells);

}  // namespace helio
