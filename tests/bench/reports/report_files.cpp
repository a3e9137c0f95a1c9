#include "tests/bench/reports/report_files.h"

#include <filesystem>

#include "renderer/codec/atomic_file.h"

namespace helio::bench {

Status write_reports(const std::string& folder, const std::vector<std::pair<std::string, std::string>>& files) {
  if (folder.empty()) return ok_status();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{ErrorCode::permission_denied, "cannot be made: " + error.message(), folder};
  for (const auto& [name, text] : files) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    const Status written = write_file_atomically((std::filesystem::path(folder) / name).string(), {bytes, text.size()});
    if (!written) return written;
  }
  return ok_status();
}

}  // namespace helio::bench
