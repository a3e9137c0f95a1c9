// The directories that LoadScene may read from.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

class SceneRoots {
 public:
  // Every directory must exist; links in them are resolved once, here.
  static Result<SceneRoots> open(const std::vector<std::string>& directories);

  struct Location {
    std::string root;      // one of the roots, absolute, without links
    std::string relative;  // '/'-separated, below root, without links and ".."
  };
  // A regular file below a root, given relative to one (the first that has it wins) or absolute. permission_denied when
  // `..` or a link leads outside, whether or not something exists there; not_found when there is no such file.
  Result<Location> find(std::string_view path, const std::string& where) const;

  struct Entry {
    std::string path;  // for find() and list()
    bool folder = false;
    std::uint64_t bytes = 0;   // of a file
    bool environment = false;  // a map; false: a scene, or a folder
  };
  struct List {
    std::vector<Entry> entries;  // folders first, then by path; the first kMaxListed
    std::size_t total = 0;
  };
  static constexpr std::size_t kMaxListed = 4096;
  // What loads may name in a folder of the roots (those that more than one has: of all together): folders, scenes and
  // environment maps, by their names' endings. "": the roots themselves. Hidden ones, and links that lead outside, are
  // left out. Takes as long as the disk does. Errors: those of find().
  Result<List> list(std::string_view folder, const std::string& where) const;

 private:
  std::vector<std::string> roots_;
};

}  // namespace helio
