// The folder in which a comparison is kept, and which grows while one runs.
//
//   comparison.json                      the record (CompareRecord), replaced whole, at most once a second
//   pictures/reference.view0.exr         the reference of a view: R, G, B, variance.R, variance.G, variance.B, float
//   pictures/MODE.view0.exr              of the mode, the first seed and the last budget
//   units.csv, points.csv, ratios.csv    once the table is there
//   comparison.lock                      while a call writes to it
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/frame_assembler.h"
#include "client/render_client.h"
#include "heliograph/v1/compare.pb.h"

namespace helio {

// The record that the folder holds; none: there is none. invalid_argument: a file of that name that is no record.
Result<std::optional<heliograph::v1::CompareRecord>> read_comparison_folder(const std::filesystem::path& folder);

// "pictures/bdpt.view3.exr", relative to the folder.
std::string picture_file(const heliograph::v1::CompareRecord::Picture& picture);

// Keeps other processes, and others of this one, from writing to the folder. Calls that grow one record at the same
// time would overwrite each other's units.
class ComparisonLock {
 public:
  // Makes the folder where it does not exist; its parent must. failed_precondition: another one holds the lock, which
  // the message names. internal: the file of the lock cannot be made.
  static Result<ComparisonLock> take(const std::filesystem::path& folder);
  ComparisonLock(ComparisonLock&& other) noexcept;
  ComparisonLock& operator=(ComparisonLock&& other) noexcept;
  ~ComparisonLock();  // removes its file, and the folder that it made where nothing else lies in it

  // False: the file system knows no locks, and nothing keeps others from writing.
  bool effective() const { return effective_; }

 private:
  ComparisonLock(std::filesystem::path folder, int file, bool made, bool effective)
      : folder_(std::move(folder)), file_(file), made_(made), effective_(effective) {}

  std::filesystem::path folder_;
  int file_ = -1;
  bool made_ = false, effective_ = false;
};

// Keeps what a call of RenderClient::compare tells. Not thread safe.
class ComparisonFolder {
 public:
  // `record` has the call already (extend_record). `control`: cancelled when a file cannot be written, or a tile is
  // broken; failure() says so then.
  ComparisonFolder(std::filesystem::path folder, heliograph::v1::CompareRecord record, CallControl& control);
  ComparisonFolder(const ComparisonFolder&) = delete;
  ComparisonFolder& operator=(const ComparisonFolder&) = delete;

  // Makes the folder where it does not exist. Until then nothing is written: a call that is refused changes nothing.
  void accepted(const heliograph::v1::CompareResponse::Accepted& accepted);
  void progress();  // saves what is due
  void reference(const heliograph::v1::CompareResponse::Reference& reference);
  void unit(const heliograph::v1::CompareUnit& unit);
  // Written once its last tile has come. The picture of a unit that the record had before stays as it is.
  void picture(heliograph::v1::CompareResponse::Picture picture);
  // The references of the views were loaded, and have these ids.
  void set_reference_ids(const std::vector<std::string>& ids);
  // Into the record, once.
  void notice(const std::string& text);

  // request_of() the record, with the pictures that are there as pictures_done; without send_pictures where none is
  // missing.
  heliograph::v1::CompareRequest request() const;

  // Rendered references that an earlier call left, of every view; empty: not of every view.
  std::vector<std::string> rendered_reference_ids() const;    // by which the daemon that rendered them may have them
  std::vector<std::string> rendered_reference_files() const;  // with variance, so that they can be loaded instead
  // References that come from now on are those files: the record goes on to name them by the ids above.
  void use_reference_files() { own_references_ = true; }

  // One of these ends it: the record is whole on the disk afterwards, and with a table so are the CSV files. `partial`:
  // of the units so far; it is left out of a call that was not accepted, which changes nothing.
  Status finish(const heliograph::v1::CompareResponse::Result& result);
  Status interrupted(const std::optional<heliograph::v1::CompareTable>& partial = std::nullopt);

  const heliograph::v1::CompareRecord& record() const { return record_; }
  const std::optional<Error>& failure() const { return failure_; }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  void note(const Status& status);
  void save_when_due();
  Status save();
  Status save_with_tables();
  Status write(const std::string& file, const std::string& text);
  Status keep_picture(const heliograph::v1::CompareRecord::Picture& picture);
  bool is_last_of_first_seed(std::uint32_t seed_number, std::uint32_t budget) const;
  heliograph::v1::CompareRecord::Call& call();

  std::filesystem::path folder_;
  heliograph::v1::CompareRecord record_;
  CallControl& control_;
  std::optional<Error> failure_;
  FrameAssembler assembler_;
  bool in_picture_ = false;  // tiles of one are coming
  bool unsaved_ = false, made_ = false;
  bool own_references_ = false;
  std::set<std::pair<std::string, std::uint32_t>> units_;  // by mode and view, of the first seed and the last budget
  std::set<std::string> files_;                            // of pictures of those, and of references, that are there
  double begun_s_ = 0, next_save_s_ = 0;
};

}  // namespace helio
