#include "client/comparison_folder.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "client/comparison_csv.h"
#include "client/comparison_record.h"
#include "renderer/base/clock.h"
#include "renderer/codec/atomic_file.h"
#include "renderer/codec/tile_codec.h"

namespace helio {

namespace fs = std::filesystem;
namespace pb = heliograph::v1;

namespace {

constexpr const char* kRecordFile = "comparison.json";
constexpr std::uint64_t kMaxRecordBytes = std::uint64_t(1) << 30;
constexpr double kSaveEvery = 1;         // seconds at least
constexpr double kSaveShare = 1 / 20.0;  // of the time at most that a large record is being written

}  // namespace

Result<std::optional<pb::CompareRecord>> read_comparison_folder(const fs::path& folder) {
  const std::string path = (folder / kRecordFile).string();
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return std::optional<pb::CompareRecord>();
  const auto bytes = read_whole_file(path, kMaxRecordBytes);
  if (!bytes) return bytes.error();
  auto record = parse_comparison(std::string(bytes->begin(), bytes->end()), path);
  if (!record) return record.error();
  return std::optional<pb::CompareRecord>(std::move(*record));
}

std::string picture_file(const pb::CompareRecord::Picture& picture) {
  // No mode's name begins with '+'.
  const std::string what = picture.reference()             ? "reference"
                           : picture.mode() == "reference" ? "+reference"
                                                           : picture.mode();
  return fmt::format("pictures/{}.view{}.exr", what, picture.view());
}

ComparisonFolder::ComparisonFolder(fs::path folder, pb::CompareRecord record, CallControl& control)
    : folder_(std::move(folder)), record_(std::move(record)), control_(control), begun_s_(now_s()) {}

pb::CompareRecord::Call& ComparisonFolder::call() {
  return *record_.mutable_calls(record_.calls_size() - 1);
}

void ComparisonFolder::note(const Status& status) {
  if (status) return;
  if (!failure_) failure_ = status.error();
  control_.cancel();
}

void ComparisonFolder::accepted(const pb::CompareResponse::Accepted& accepted) {
  call().set_version(accepted.version());
  call().set_build(accepted.build());
  call().set_isa(accepted.isa());
  call().set_threads(accepted.threads());
  auto& notices = *record_.mutable_notices();
  for (const std::string& notice : accepted.notices()) {
    if (std::find(notices.begin(), notices.end(), notice) == notices.end()) *record_.add_notices() = notice;
  }
  unsaved_ = true;
  save_when_due();
}

void ComparisonFolder::progress() {
  save_when_due();
}

void ComparisonFolder::reference(const pb::CompareResponse::Reference& reference) {
  auto& references = *record_.mutable_references();
  const auto at = std::find_if(references.begin(), references.end(),
                               [&](const auto& known) { return known.view() >= reference.view(); });
  if (at != references.end() && at->view() == reference.view()) {
    *at = reference;
  } else {
    const int place = int(at - references.begin());
    *record_.add_references() = reference;
    for (int i = references.size() - 1; i > place; --i) references.SwapElements(i, i - 1);
  }
  unsaved_ = true;
  save_when_due();
}

void ComparisonFolder::unit(const pb::CompareUnit& unit) {
  *record_.add_units() = unit;
  call().set_units(call().units() + 1);
  unsaved_ = true;
  save_when_due();
}

void ComparisonFolder::picture(pb::CompareResponse::Picture picture) {
  if (failure_) return;
  if (record_.request().modes().empty()) return;
  if (!std::exchange(in_picture_, true)) {
    pb::RenderSettings frame;
    frame.set_width(record_.request().modes(0).settings().width());
    frame.set_height(record_.request().modes(0).settings().height());
    note(assembler_.begin(frame));
  }
  if (picture.has_tile()) {
    const auto added = assembler_.add(std::move(*picture.mutable_tile()));
    if (!added) note(added.error());
  }
  if (!picture.last()) return;
  in_picture_ = false;
  pb::CompareRecord::Picture kept;
  kept.set_reference(picture.reference());
  kept.set_view(picture.view());
  if (!picture.reference()) {
    kept.set_mode(picture.mode());
    kept.set_seed_number(picture.seed_number());
    kept.set_budget(picture.budget());
  }
  kept.set_file(picture_file(kept));
  if (!failure_) note(keep_picture(kept));
}

Status ComparisonFolder::keep_picture(const pb::CompareRecord::Picture& picture) {
  if (!assembler_.complete())
    return Error{ErrorCode::internal, "not every tile of " + picture.file() + " has come", {}};
  const auto whole = assembler_.picture();
  if (!whole) return whole.error();
  const Picture& pixels = **whole;
  std::vector<TileChannel> channels;
  for (std::size_t i = 0; i < pixels.names.size(); ++i)
    channels.push_back({pixels.names[i], pixels.planes[i].data(), true});
  const TileHeader header{pixels.window, pixels.frame_width, pixels.frame_height};
  const Status written =
      write_exr((folder_ / picture.file()).string(), header, channels, {TilePixelType::float32, TileCompression::zip});
  if (!written) return written;
  for (pb::CompareRecord::Picture& known : *record_.mutable_pictures()) {
    if (known.file() != picture.file()) continue;
    known = picture;
    return ok_status();
  }
  *record_.add_pictures() = picture;
  unsaved_ = true;
  return ok_status();
}

void ComparisonFolder::set_reference_ids(const std::vector<std::string>& ids) {
  auto& loaded = *record_.mutable_request()->mutable_reference()->mutable_loaded();
  loaded.clear_reference_ids();
  for (const std::string& id : ids) loaded.add_reference_ids(id);
}

Status ComparisonFolder::finish(const pb::CompareResponse::Result& result) {
  *record_.mutable_table() = result.table();
  call().set_rendering_seconds(result.rendering_seconds());
  call().set_ended(true);
  if (const Status saved = save(); !saved) return saved;
  if (const Status written = write("units.csv", units_csv(record_)); !written) return written;
  if (const Status written = write("points.csv", points_csv(record_)); !written) return written;
  return write("ratios.csv", ratios_csv(record_));
}

Status ComparisonFolder::interrupted() {
  return unsaved_ ? save() : ok_status();
}

void ComparisonFolder::save_when_due() {
  if (unsaved_ && !failure_ && now_s() >= next_save_s_) note(save());
}

Status ComparisonFolder::save() {
  const double start = now_s();
  if (!made_) {
    std::error_code problem;
    fs::create_directories(folder_ / "pictures", problem);
    if (problem)
      return Error{
          ErrorCode::internal, "the folder '" + folder_.string() + "' cannot be made: " + problem.message(), {}};
    made_ = true;
  }
  sort_units(record_);
  call().set_seconds(start - begun_s_);
  const auto json = comparison_json(record_);
  if (!json) return json.error();
  const Status written = write(kRecordFile, *json);
  const double end = now_s();
  next_save_s_ = end + std::max(kSaveEvery, (end - start) / kSaveShare);
  if (written) unsaved_ = false;
  return written;
}

Status ComparisonFolder::write(const std::string& file, const std::string& text) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  return write_file_atomically((folder_ / file).string(), {bytes, text.size()});
}

}  // namespace helio
