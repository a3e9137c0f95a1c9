// The folder in which a comparison is kept, and which grows while one runs.
//
//   comparison.json                      the record (CompareRecord), replaced whole, at most once a second
//   pictures/reference.view0.exr         the reference of a view: R, G, B, float
//   pictures/MODE.view0.exr              of the mode, the first seed and the last budget
//   units.csv, points.csv, ratios.csv    once the table is there
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "client/frame_assembler.h"
#include "client/render_client.h"
#include "heliograph/v1/compare.pb.h"

namespace helio {

// The record that the folder holds; none: there is none. invalid_argument: a file of that name that is no record.
Result<std::optional<heliograph::v1::CompareRecord>> read_comparison_folder(const std::filesystem::path& folder);

// "pictures/bdpt.view3.exr", relative to the folder.
std::string picture_file(const heliograph::v1::CompareRecord::Picture& picture);

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
  void picture(heliograph::v1::CompareResponse::Picture picture);
  // The references of the views were loaded, and have these ids.
  void set_reference_ids(const std::vector<std::string>& ids);

  // One of these ends it: the record is whole on the disk afterwards, and with a result so are the tables.
  Status finish(const heliograph::v1::CompareResponse::Result& result);
  Status interrupted();

  const heliograph::v1::CompareRecord& record() const { return record_; }
  const std::optional<Error>& failure() const { return failure_; }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  void note(const Status& status);
  void save_when_due();
  Status save();
  Status write(const std::string& file, const std::string& text);
  Status keep_picture(const heliograph::v1::CompareRecord::Picture& picture);
  heliograph::v1::CompareRecord::Call& call();

  std::filesystem::path folder_;
  heliograph::v1::CompareRecord record_;
  CallControl& control_;
  std::optional<Error> failure_;
  FrameAssembler assembler_;
  bool in_picture_ = false;  // tiles of one are coming
  bool unsaved_ = false, made_ = false;
  double begun_s_ = 0, next_save_s_ = 0;
};

}  // namespace helio
