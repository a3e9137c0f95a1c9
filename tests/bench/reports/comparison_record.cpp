#include "tests/bench/reports/comparison_record.h"

#include <cstdio>
#include <filesystem>
#include <map>

#include "client/cli/commands/compare_report.h"
#include "client/comparison/comparison_csv.h"
#include "client/comparison/comparison_record.h"
#include "client/report/comparison_report.h"
#include "renderer/base/clock.h"
#include "renderer/codec/sha256.h"
#include "renderer/comparison/picture_errors.h"
#include "server/base/build_info.h"
#include "server/compare/compare_table.h"
#include "server/stream/settings_messages.h"
#include "tests/bench/reports/report_files.h"

namespace helio::bench {

namespace {

constexpr Measure kMeasured[] = {Measure::mse,   Measure::relmse,       Measure::bias, Measure::distance_variance,
                                 Measure::dssim, Measure::outlier_share};

unsigned measured_bits() {
  unsigned bits = 0;
  for (const Measure measure : kMeasured) bits |= 1u << unsigned(measure);
  return bits;
}

// A reference of another renderer may come without its variance.
ReferenceView reference_view(const ErrorScene& scene) {
  ReferenceView view{scene.reference.view(), {}, {}, {}};
  if (reference_mse(scene) > 0) view.variance = scene.reference_variance.view();
  return view;
}

pb::CompareResponse::Reference told_reference(const ReferenceView& view) {
  pb::CompareResponse::Reference reference;
  reference.set_kept(true);
  if (view.variance) reference.set_noise(pb::CompareResponse::Reference::NOISE_VARIANCE);
  reference.set_error(reference_error(view).value_or(0));
  return reference;
}

}  // namespace

RecordedComparison::RecordedComparison(const std::string& name, const ErrorScene& scene,
                                       const std::vector<RecordedMode>& modes, const std::vector<int>& counts,
                                       const BenchOptions& options)
    : scene_(scene), threads_(options.threads), started_s_(now_s()) {
  ComparisonCall call;
  call.scene_name = name;
  call.scene_file = scene.file.string();
  call.command_line = options.command_line;
  call.version = build_version();
  call.build = build_description();
  call.isa = build_isa();
  call.threads = options.threads;
  for (const RecordedMode& mode : modes) {
    pb::CompareMode& added = *call.request.add_modes();
    added.set_name(mode.name);
    if (mode.settings) *added.mutable_settings() = to_message(*mode.settings);
    added.mutable_settings()->clear_seed();
    added.mutable_settings()->set_width(scene.reference.width);
    added.mutable_settings()->set_height(scene.reference.height);
  }
  call.request.set_seeds(std::uint32_t(options.seeds));
  call.request.set_first_seed(1);
  call.request.set_common_seeds(true);
  for (const int count : counts) call.request.add_samples(std::uint32_t(count));
  for (const Measure measure : kMeasured) call.request.add_measures(to_message(measure));
  call.request.mutable_reference()->mutable_loaded();
  pb::CompareRecord::ReferenceFile& file = call.reference_files.emplace_back();
  file.set_path(scene.reference_file.string());
  if (const auto hash = hash_file(file.path()); hash) {
    file.set_sha256(hash->sha256.data(), hash->sha256.size());
  } else {
    readable_ = hash.error();
  }
  extend_record(record_, call, {});
  *record_.add_references() = told_reference(reference_view(scene));
}

Status RecordedComparison::add(const std::string& mode, int seed, std::size_t count, const PictureView& picture,
                               double seconds) {
  PictureErrorOptions options;
  options.measures = measured_bits();
  options.threads = threads_;
  const auto errors = picture_errors(picture, reference_view(scene_), options);
  if (!errors) return errors.error();
  pb::CompareUnit& unit = *record_.add_units();
  unit.set_mode(mode);
  unit.set_seed_number(std::uint32_t(seed));
  unit.set_seed(std::uint64_t(seed));
  unit.set_budget(std::uint32_t(count));
  unit.set_seconds(seconds);
  unit.set_samples(record_.request().samples(int(count)));
  for (const MeasuredValue& error : *errors) {
    pb::CompareValue& value = *unit.add_values();
    value.set_measure(to_message(error.measure));
    value.set_region(error.region);
    value.set_value(error.value);
  }
  return ok_status();
}

Result<pb::CompareRecord> RecordedComparison::finish() {
  if (!readable_) return readable_.error();
  sort_units(record_);
  ComparisonScript script;
  for (const pb::CompareMode& mode : record_.request().modes()) script.modes.push_back(mode.name());
  script.budgets = budgets_of(record_.request());
  script.common_seeds = record_.request().common_seeds();
  std::vector<ComparedUnit> units;
  for (const pb::CompareUnit& unit : record_.units()) units.push_back(unit_of(unit));
  *record_.mutable_table() = to_message(compare_units(script, units));
  pb::CompareRecord::Call& call = *record_.mutable_calls(record_.calls_size() - 1);
  call.set_units(std::uint32_t(record_.units_size()));
  call.set_seconds(now_s() - started_s_);
  call.set_ended(true);
  return std::move(record_);
}

Status publish_comparisons(const std::vector<pb::CompareRecord>& records, bool as_json, const std::string& folder) {
  cli::Json list = cli::Json::array();
  std::map<std::string, int> named;  // scenes of several folders may have one name
  for (const pb::CompareRecord& record : records) {
    if (as_json) {
      cli::Json& json = list.emplace_back();
      json["name"] = record.scene_name();
      cli::add_comparison(json, record);
    } else {
      std::printf("%s\n", record.scene_name().c_str());
      for (const std::string& line : cli::describe_table(record)) std::printf("%s\n", line.c_str());
      std::printf("\n");
    }
    if (folder.empty()) continue;
    const auto text = comparison_json(record);
    if (!text) return text.error();
    const int number = ++named[record.scene_name()];
    const std::filesystem::path own =
        std::filesystem::path(folder) / (record.scene_name() + (number > 1 ? "-" + std::to_string(number) : ""));
    const Status written = write_reports(own.string(), {{"comparison.json", *text},
                                                        {"units.csv", units_csv(record)},
                                                        {"points.csv", points_csv(record)},
                                                        {"ratios.csv", ratios_csv(record)},
                                                        {"report.html", comparison_report(record, own)}});
    if (!written) return written;
  }
  if (as_json) std::printf("%s\n", cli::Json({{"comparisons", list}}).dump(2).c_str());
  return ok_status();
}

}  // namespace helio::bench
