// Pictures that a bench has rendered, as the record (CompareRecord) that `heliograph compare` makes of its own: tables,
// intervals, ratios and the report are then those of the product.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "heliograph/v1/compare.pb.h"
#include "renderer/frame/render_settings.h"
#include "tests/bench/scenes/error_scenes.h"

namespace helio::bench {

namespace pb = heliograph::v1;

// The first mode of a record is the one that the others are compared with.
struct RecordedMode {
  std::string name;                        // of A-Z, a-z, 0-9, '.', '_', '+', '-'
  std::optional<RenderSettings> settings;  // none: another renderer's
};

class RecordedComparison {
 public:
  // `name`: of the comparison. `counts`: samples per pixel, rising. All modes have the seeds [1, seeds]. The scene must
  // outlive this.
  RecordedComparison(const std::string& name, const ErrorScene& scene, const std::vector<RecordedMode>& modes,
                     const std::vector<int>& counts, const BenchOptions& options);

  // The picture of counts[count] samples of that mode and seed, which took so long. Measures mse, relmse, bias,
  // variance of the distance, dssim and outlier_share against the scene's reference; the errors are those of
  // picture_errors().
  Status add(const std::string& mode, int seed, std::size_t count, const PictureView& picture, double seconds);

  // With its table.
  Result<pb::CompareRecord> finish();

 private:
  const ErrorScene& scene_;
  int threads_;
  double started_s_;
  pb::CompareRecord record_;
  Status readable_ = ok_status();  // the reference's file
};

// Prints for each record what `heliograph compare` prints: lines, or with `as_json` {"comparisons": [...]}, in which
// "name" stands before the members that its --json has. Into `folder`, which is made, FOLDER/NAME/ is written as
// `heliograph compare --output` writes it, without pictures, the second of a name FOLDER/NAME-2/; empty: nothing is
// written.
Status publish_comparisons(const std::vector<pb::CompareRecord>& records, bool as_json, const std::string& folder);

}  // namespace helio::bench
