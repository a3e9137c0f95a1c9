#include "server/jobs/leftovers.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <system_error>

#include "heliograph/v1/durable_job.pb.h"

namespace helio {
namespace {

namespace fs = std::filesystem;

bool all_of(std::string_view text, std::string_view characters) {
  return !text.empty() && text.find_first_not_of(characters) == std::string_view::npos;
}
constexpr std::string_view kDigits = "0123456789";

// FILE.tmp-PROCESS-NUMBER, as AtomicFile names it.
struct TemporaryName {
  std::string file, process;
};
std::optional<TemporaryName> parse_temporary(const std::string& name) {
  static constexpr std::string_view kMark = ".tmp-";
  const std::size_t mark = name.rfind(kMark);
  if (mark == std::string::npos || mark == 0) return std::nullopt;
  const std::string_view rest = std::string_view(name).substr(mark + kMark.size());
  const std::size_t dash = rest.find('-');
  if (dash == std::string_view::npos || !all_of(rest.substr(0, dash), kDigits) ||
      !all_of(rest.substr(dash + 1), kDigits)) {
    return std::nullopt;
  }
  return TemporaryName{name.substr(0, mark), std::string(rest.substr(0, dash))};
}

// VIEW.exr
bool is_view_file(std::string_view name) {
  static constexpr std::string_view kEnding = ".exr";
  return name.size() > kEnding.size() && name.ends_with(kEnding) &&
         all_of(name.substr(0, name.size() - kEnding.size()), kDigits);
}

// As make_id("j-") makes them.
bool is_job_id(std::string_view name) {
  return name.starts_with("j-") && name.size() == 26 && all_of(name.substr(2), "0123456789abcdef");
}

// Calls use(path, name) for each entry; a folder that cannot be read has none.
template <class Use>
void for_entries(const fs::path& folder, const Use& use) {
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed))
    use(entry->path(), entry->path().filename().string());
}

}  // namespace

void clear_results(const std::string& results, const JobTable& table, double keep_days,
                   std::vector<std::string>& notices) {
  const auto oldest = fs::file_time_type::clock::now() -
                      std::chrono::duration_cast<fs::file_time_type::duration>(
                          std::chrono::duration<double>(keep_days * 86400));
  std::size_t unknown = 0;
  for_entries(results, [&](const fs::path& folder, const std::string& job) {
    std::error_code ignored;
    if (!is_job_id(job) || !fs::is_directory(fs::symlink_status(folder, ignored))) return;
    bool ours = true, old = true;
    for_entries(folder, [&](const fs::path& file, const std::string& name) {
      const auto temporary = parse_temporary(name);
      if (temporary && is_view_file(temporary->file)) {
        fs::remove(file, ignored);
        return;
      }
      ours &= is_view_file(name);
      std::error_code failed;
      old &= fs::last_write_time(file, failed) < oldest && !failed;
    });
    const auto known = table.get(job);
    if (known || known.error().code != ErrorCode::not_found) return;
    if (ours && old) {
      fs::remove_all(folder, ignored);
      spdlog::info("pictures of job {}, which is forgotten, are removed", job);
    } else {
      ++unknown;
    }
  });
  if (unknown == 0) return;
  notices.push_back(fmt::format("'{}' has pictures of {} jobs that are not known any more; each folder is removed once "
                                "it is {:g} days old (keep-jobs)",
                                results, unknown, keep_days));
}

void clear_outputs(const OutputRoots& outputs, std::span<const JobRecord> unfinished) {
  std::map<std::string, std::set<std::string>> names;  // of files to be written, by folder
  for (const JobRecord& job : unfinished) {
    heliograph::v1::SubmitJobRequest request;
    if (!request.ParseFromString(job.summary) || !request.has_output() || job.views_done >= job.views) continue;
    const auto file = outputs.file_of(request.output().path(), job.views_done, "output.path");
    if (file) names[fs::path(*file).parent_path().string()].insert(fs::path(*file).filename().string());
  }
  for (const auto& [folder, files] : names) {
    for_entries(folder, [&, &wanted = files](const fs::path& path, const std::string& name) {
      const auto temporary = parse_temporary(name);
      std::error_code ignored;
      if (!temporary || !wanted.contains(temporary->file)) return;
      // In a container each daemon has the same number, and this one has written nothing so far.
      const bool own = temporary->process == std::to_string(getpid());
      if (!own && fs::exists("/proc/" + temporary->process, ignored)) return;
      if (fs::remove(path, ignored))
        spdlog::info("'{}', which a daemon that was killed has left, is removed", path.string());
    });
  }
}

}  // namespace helio
