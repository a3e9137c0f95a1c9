// Keeps what a command writes away from what it reads, and each of its files from the others.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "client/cli/commands/picture_files.h"
#include "client/cli/options.h"
#include "client/cli/scene_options.h"

namespace helio::cli {

// A problem for a picture's file that is named as if it had another format; `hint` follows what is allowed.
void check_exr_name(const std::string& option, const std::string& path, const std::string& hint, Problems& problems);

class OutputCheck {
 public:
  // A file that is read; `what` it is, for messages: "the scene". One that does not exist does not count.
  void add_input(const std::string& path, const std::string& what);
  // The scene, all files of its bundle, and the environment map.
  void add_inputs(const SceneChoice& choice);

  // A problem for each name that is, by whatever path or link, a file that is read or one named before.
  void check(const FileNames& names, Problems& problems);
  void check(const std::string& option, const std::string& path, Problems& problems);

 private:
  using FileId = std::pair<std::uint64_t, std::uint64_t>;  // device, inode

  std::string place_of(const std::string& path);

  std::map<FileId, std::string> inputs_;
  std::map<std::string, std::string> folders_;  // as written -> without links
  std::map<std::string, std::string> outputs_;  // where the file will be -> the option that named it
};

}  // namespace helio::cli
