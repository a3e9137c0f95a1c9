// The newest two checkpoints of every job of a state folder, as files that are whole or not there. Sessions that a
// daemon keeps for the next one have such files, too, one each, in a folder of their own.
//
// A file: magic, version, number, lengths, job id, the writer's header, a CRC-32 for each MiB of the body, a CRC-32 of
// all that; then the body. Written to a temporary file, flushed, renamed, folder flushed. The two files of a job,
// JOB.a and JOB.b, take turns, so that the one before is there until the next is whole.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

struct CheckpointFile {
  std::uint64_t number = 0;  // counts those of its job, from 1
  std::string header;        // serialized: what the writer says of it (view, build, settings); at most 16 MiB
  std::vector<std::uint8_t> body;
};

// Thread safe for different jobs: calls for one job come one after the other.
class CheckpointFiles {
 public:
  explicit CheckpointFiles(std::string folder) : folder_(std::move(folder)) {}
  // Makes the folder and removes what interrupted writes left. unavailable: it cannot be made.
  Status open();

  // The body comes in spans, written one behind the other. On failure the checkpoints before stay. Job ids: 1 to 128
  // letters, digits, '-' and '_', else invalid_argument. Errors besides: those of write_file_atomically(), naming the
  // file.
  Status write(const std::string& job_id, const std::string& header,
               std::span<const std::span<const std::uint8_t>> body);
  struct Newest {
    std::optional<CheckpointFile> file;  // none: there is none that is whole
    std::vector<std::string> damaged;    // a sentence for each file that could not be used
  };
  // The newest whole one; max_bytes bounds the size of a file that is read.
  Newest read(const std::string& job_id, std::uint64_t max_bytes) const;
  // The same for whoever looks on while the job's own thread may write.
  Newest look(const std::string& job_id, std::uint64_t max_bytes) const;
  // The newest whole one whose number is below `number`: for a caller that found the body of that one useless.
  Newest read_before(const std::string& job_id, std::uint64_t number, std::uint64_t max_bytes) const;
  // The same without the body, which is not looked at: `file` has none.
  Newest read_head(const std::string& job_id) const;
  void remove(const std::string& job_id);
  // Of whatever file there is, in alphabetical order.
  std::vector<std::string> job_ids() const;

 private:
  std::string file(const std::string& job_id, int slot) const;
  Newest find(const std::string& job_id, std::uint64_t below, std::uint64_t max_bytes, bool note) const;

  const std::string folder_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, int> newest_;  // by job: slot of the newest that is known to be whole
};

}  // namespace helio
