// The record of a comparison (CompareRecord): its text, and what becomes of it when more is asked for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "heliograph/v1/compare.pb.h"
#include "renderer/base/result.h"

namespace helio {

inline constexpr std::uint32_t kComparisonFormat = 1;

// Protobuf JSON. internal: a string is not UTF-8.
Result<std::string> comparison_json(const heliograph::v1::CompareRecord& record);

// Reads that back; keys that this version does not know are left out. `name` stands in the message.
// invalid_argument: it is no such JSON, of a newer format, or its units are not those of its request.
Result<heliograph::v1::CompareRecord> parse_comparison(const std::string& json, const std::string& name);

// A call of Compare, by which a record is to grow.
struct ComparisonCall {
  std::string scene_name, scene_file;      // CompareRecord's
  heliograph::v1::CompareRequest request;  // modes, views and the reference's settings complete; done empty
  std::vector<heliograph::v1::CompareRecord::ReferenceFile> reference_files;  // one for each view; none: rendered
  std::string command_line;                                                   // empty: not by a command
  std::string version, build, isa;                                            // of the daemon, as of GetServerInfo
  std::int32_t threads = 0;
  std::string processor;  // empty: not known
};

// Differences between a record that has units and a call. More modes, seeds and budgets than the record has, or fewer,
// are none.
struct ComparisonDifferences {
  std::vector<std::string> of_shape;   // units of both would not fit into one table: of no use together
  std::vector<std::string> of_values;  // units of both would stand side by side although they are of different things
};
ComparisonDifferences compare_with_record(const heliograph::v1::CompareRecord& record, const ComparisonCall& call);

// Adds the call, and whatever modes, seeds and budgets are new; what the record has stays. Modes are in the call's
// order, then those that the record alone has. A record without units is made anew. The table goes, and so do
// references that the call would not have. Precondition: no differences of shape. `differences`: what the call says of
// itself.
void extend_record(heliograph::v1::CompareRecord& record, const ComparisonCall& call,
                   const std::vector<std::string>& differences);

// The request that goes on with the record: all that was asked for, and the units that there are.
heliograph::v1::CompareRequest request_of(const heliograph::v1::CompareRecord& record);

// Samples per pixel, or seconds.
std::vector<double> budgets_of(const heliograph::v1::CompareRequest& request);
std::uint64_t unit_count(const heliograph::v1::CompareRequest& request);
int view_count(const heliograph::v1::CompareRequest& request);

// Into the order that CompareRecord states.
void sort_units(heliograph::v1::CompareRecord& record);

}  // namespace helio
