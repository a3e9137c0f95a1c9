// The folder in which one daemon keeps what survives it.
//
//   DIR/lock                held (flock) by the daemon that uses the folder; the text is its process id
//   DIR/jobs.sqlite         JobTable
//   DIR/checkpoints/        CheckpointFiles
//   DIR/scenes/             SceneStore
//   DIR/sessions/           CheckpointFiles, of sessions between two daemons
//   DIR/results/JOB/        pictures of jobs that name no place of their own
#pragma once

#include <string>

#include "renderer/base/result.h"

namespace helio {

// $XDG_STATE_HOME/heliograph, else $HOME/.local/state/heliograph. failed_precondition: neither variable is set to an
// absolute path.
Result<std::string> default_state_folder();

// Holds the lock as long as it lives.
class StateFolder {
 public:
  // Makes what is missing, for the owner alone (mode 0700), takes the lock and writes a file to see that it can.
  // failed_precondition: another process, which the message names, uses the folder. unavailable: it cannot be made or
  // written (read-only, full, no permission). Each message is a sentence that names the folder.
  static Result<StateFolder> open(const std::string& directory);
  StateFolder(StateFolder&& other) noexcept;
  StateFolder& operator=(StateFolder&& other) noexcept;
  ~StateFolder();

  const std::string& path() const { return path_; }  // absolute
  std::string jobs_file() const { return path_ + "/jobs.sqlite"; }
  std::string checkpoints() const { return path_ + "/checkpoints"; }
  std::string scenes() const { return path_ + "/scenes"; }
  std::string sessions() const { return path_ + "/sessions"; }
  std::string results() const { return path_ + "/results"; }

 private:
  StateFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::string path_;
  int lock_ = -1;  // descriptor
};

}  // namespace helio
