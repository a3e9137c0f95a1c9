// The directories that jobs may write their pictures to.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/open_beneath.h"
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

  // Of a file that file_of() told: a folder on its way that became a link meanwhile is permission_denied.
  // Writes it whole or not at all. Without `replace` a file that is there stays, also one that came a moment ago:
  // failed_precondition.
  Status write(const std::string& file, std::span<const std::uint8_t> bytes, bool replace) const;
  // For reading; never a link. None and errno where it cannot be opened.
  FileDescriptor open(const std::string& file) const;

 private:
  // The root that the path lies in; null: none.
  const std::string* root_of(const std::string& path) const;

  std::vector<std::string> roots_;
};

}  // namespace helio
