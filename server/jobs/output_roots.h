// The directories that jobs may write their pictures to.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

class OutputRoots {
 public:
  // Every directory must exist; links in them are resolved once, here.
  static Result<OutputRoots> open(const std::vector<std::string>& directories);

  // JobOutput.path, for so many views: form, length, ending, {view} where it is needed.
  static void check(const std::string& path, std::uint32_t views, const std::string& where, Problems& problems);
  // The file of a view: absolute, without links. permission_denied: outside the roots, by a link or "..", or there are
  // none; not_found: its folder is gone. Precondition: check() found nothing.
  Result<std::string> file_of(const std::string& path, std::uint32_t view, const std::string& where) const;

 private:
  std::vector<std::string> roots_;
};

}  // namespace helio
