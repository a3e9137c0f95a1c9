#include "client/comparison/comparison_folder.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "client/comparison/comparison_csv.h"
#include "client/comparison/comparison_record.h"
#include "renderer/base/clock.h"
#include "renderer/codec/atomic_file.h"
#include "renderer/codec/tile_codec.h"

namespace helio {

namespace fs = std::filesystem;
namespace pb = heliograph::v1;

namespace {

constexpr const char* kRecordFile = "comparison.json";
constexpr const char* kLockFile = "comparison.lock";
constexpr int kLockTries = 100;  // others may remove their file between our steps
constexpr std::uint64_t kMaxPixels = std::uint64_t(1) << 28;
constexpr std::uint64_t kMaxRecordBytes = std::uint64_t(1) << 30;
constexpr double kSaveEvery = 1;         // seconds at least
constexpr double kSaveShare = 1 / 20.0;  // of the time at most that a large record is being written

std::string own_name() {
  char host[256] = {};
  if (::gethostname(host, sizeof host - 1) != 0) host[0] = 0;
  return fmt::format("process {}{}{}", ::getpid(), host[0] ? " on " : "", host);
}

// That the holder of the lock wrote into its file.
std::string holder(int file) {
  char text[300];
  const ssize_t bytes = ::pread(file, text, sizeof text, 0);
  std::string name(text, bytes > 0 ? std::size_t(bytes) : 0);
  const bool good = name.rfind("process ", 0) == 0 &&
                    std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return good ? name : "another process";
}

// The path still names the file: its holder has not removed it since it was opened.
bool is_there(int file, const std::string& path) {
  struct stat opened {
  }, named{};
  return ::fstat(file, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

// The reference's variance is there, as it is in pictures of the daemon.
bool has_variance(const std::string& path, int width, int height) {
  const auto picture = read_exr(path, kMaxPixels);
  if (!picture || picture->header.frame_width != width || picture->header.frame_height != height) return false;
  return picture->find("variance.R") && picture->find("variance.G") && picture->find("variance.B");
}

}  // namespace

Result<ComparisonLock> ComparisonLock::take(const fs::path& folder) {
  const std::string path = (folder / kLockFile).string();
  std::string problem;
  for (int i = 0; i < kLockTries; ++i) {
    std::error_code code;
    const bool made = fs::create_directory(folder, code);
    if (code)
      return Error{ErrorCode::internal, "the folder '" + folder.string() + "' cannot be made: " + code.message(), {}};
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file < 0) {
      problem = std::strerror(errno);
      if (errno == ENOENT) continue;
      break;
    }
    const bool locked = ::flock(file, LOCK_EX | LOCK_NB) == 0;
    if (!locked && errno == EWOULDBLOCK) {
      const Error error{
          ErrorCode::failed_precondition,
          "the folder '" + folder.string() + "' is in use: " + holder(file) +
              " is writing a comparison into it; allowed: another folder, or this one once that has ended",
          {}};
      ::close(file);
      return error;
    }
    if (locked && !is_there(file, path)) {
      ::close(file);
      continue;
    }
    const std::string name = own_name();
    if (::ftruncate(file, 0) == 0) static_cast<void>(!::pwrite(file, name.data(), name.size(), 0));
    return ComparisonLock(folder, file, made, locked);
  }
  return Error{ErrorCode::internal, "the file '" + path + "' cannot be made: " + problem, {}};
}

ComparisonLock::ComparisonLock(ComparisonLock&& other) noexcept {
  *this = std::move(other);
}

ComparisonLock& ComparisonLock::operator=(ComparisonLock&& other) noexcept {
  std::swap(folder_, other.folder_);
  std::swap(file_, other.file_);
  std::swap(made_, other.made_);
  std::swap(effective_, other.effective_);
  return *this;
}

ComparisonLock::~ComparisonLock() {
  if (file_ < 0) return;
  ::unlink((folder_ / kLockFile).c_str());  // while it is held: take() notices
  ::close(file_);
  if (made_) ::rmdir(folder_.c_str());
}

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
    : folder_(std::move(folder)), record_(std::move(record)), control_(control), begun_s_(now_s()) {
  for (const pb::CompareUnit& unit : record_.units()) {
    if (is_last_of_first_seed(unit.seed_number(), unit.budget())) units_.emplace(unit.mode(), unit.view());
  }
  std::error_code ignored;
  for (const pb::CompareRecord::Picture& picture : record_.pictures()) {
    if (!picture.reference() && !is_last_of_first_seed(picture.seed_number(), picture.budget())) continue;
    if (fs::exists(folder_ / picture_file(picture), ignored)) files_.insert(picture_file(picture));
  }
}

bool ComparisonFolder::is_last_of_first_seed(std::uint32_t seed_number, std::uint32_t budget) const {
  return seed_number == 1 && budget + std::size_t(1) == budgets_of(record_.request()).size();
}

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
  for (const std::string& text : accepted.notices()) notice(text);
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
    const pb::CompareResponse::Reference before = *at;
    *at = reference;
    if (own_references_) {
      at->set_reference_id(before.reference_id());
      at->set_samples(before.samples());
    }
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
  if (is_last_of_first_seed(unit.seed_number(), unit.budget())) units_.emplace(unit.mode(), unit.view());
  call().set_units(call().units() + 1);
  unsaved_ = true;
  save_when_due();
}

void ComparisonFolder::picture(pb::CompareResponse::Picture picture) {
  if (failure_) return;
  if (record_.request().modes().empty()) return;
  pb::CompareRecord::Picture kept;
  kept.set_reference(picture.reference());
  kept.set_view(picture.view());
  if (!picture.reference()) {
    kept.set_mode(picture.mode());
    kept.set_seed_number(picture.seed_number());
    kept.set_budget(picture.budget());
  }
  kept.set_file(picture_file(kept));
  // Rendered again, which in the same seconds makes another picture than the one that was measured.
  if (!picture.reference() && units_.contains({picture.mode(), picture.view()}) && files_.contains(kept.file())) return;
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
  files_.insert(picture.file());
  unsaved_ = true;
  for (pb::CompareRecord::Picture& known : *record_.mutable_pictures()) {
    if (known.file() != picture.file()) continue;
    known = picture;
    return ok_status();
  }
  *record_.add_pictures() = picture;
  return ok_status();
}

void ComparisonFolder::notice(const std::string& text) {
  const auto& notices = record_.notices();
  if (std::find(notices.begin(), notices.end(), text) != notices.end()) return;
  record_.add_notices(text);
  unsaved_ = true;
}

pb::CompareRequest ComparisonFolder::request() const {
  pb::CompareRequest request = request_of(record_);
  if (!request.send_pictures()) return request;
  const int views = view_count(request);
  for (int view = 0; view < views; ++view) {
    pb::CompareRecord::Picture picture;
    picture.set_view(std::uint32_t(view));
    const auto add_done = [&] {
      pb::CompareRequest::PictureName& done = *request.add_pictures_done();
      done.set_reference(picture.reference());
      done.set_mode(picture.mode());
      done.set_view(picture.view());
    };
    picture.set_reference(true);
    if (files_.contains(picture_file(picture))) add_done();
    picture.set_reference(false);
    for (const pb::CompareMode& mode : request.modes()) {
      picture.set_mode(mode.name());
      if (units_.contains({mode.name(), picture.view()}) && files_.contains(picture_file(picture))) add_done();
    }
  }
  if (request.pictures_done_size() == views * (request.modes_size() + 1)) {
    request.set_send_pictures(false);
    request.clear_pictures_done();
  }
  return request;
}

std::vector<std::string> ComparisonFolder::rendered_reference_ids() const {
  std::vector<std::string> ids;
  if (!record_.request().reference().has_rendered()) return ids;
  for (const auto& reference : record_.references()) {
    if (reference.view() != ids.size() || reference.reference_id().empty()) return {};
    ids.push_back(reference.reference_id());
  }
  if (int(ids.size()) != view_count(record_.request())) ids.clear();
  return ids;
}

std::vector<std::string> ComparisonFolder::rendered_reference_files() const {
  std::vector<std::string> files;
  const std::size_t views = rendered_reference_ids().size();
  if (views == 0 || record_.request().modes().empty()) return files;
  const pb::RenderSettings& settings = record_.request().modes(0).settings();
  pb::CompareRecord::Picture picture;
  picture.set_reference(true);
  for (std::size_t view = 0; view < views; ++view) {
    picture.set_view(std::uint32_t(view));
    const std::string file = (folder_ / picture_file(picture)).string();
    if (!files_.contains(picture_file(picture)) || !has_variance(file, settings.width(), settings.height())) return {};
    files.push_back(file);
  }
  return files;
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
  return save_with_tables();
}

Status ComparisonFolder::save_with_tables() {
  if (const Status saved = save(); !saved) return saved;
  if (const Status written = write("units.csv", units_csv(record_)); !written) return written;
  if (const Status written = write("points.csv", points_csv(record_)); !written) return written;
  return write("ratios.csv", ratios_csv(record_));
}

Status ComparisonFolder::interrupted(const std::optional<pb::CompareTable>& partial) {
  if (!made_ || !partial) return unsaved_ ? save() : ok_status();
  *record_.mutable_table() = *partial;
  return save_with_tables();
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
