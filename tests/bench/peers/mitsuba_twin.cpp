#include "tests/bench/peers/mitsuba_twin.h"

#include <vector>

#include "tests/bench/peers/child_process.h"

namespace helio::bench {

Result<std::filesystem::path> write_mitsuba_twin(const std::string& python, const TwinRequest& request,
                                                 const std::filesystem::path& folder) {
  std::vector<std::string> arguments{python,
                                     "-B",
                                     HELIO_BENCH_FOLDER "/peers/mitsuba_twin.py",
                                     request.glb.string(),
                                     folder.string(),
                                     std::to_string(request.width),
                                     std::to_string(request.height)};
  if (!request.sky.empty()) arguments.push_back(request.sky);
  auto process = ChildProcess::start(arguments);
  if (!process) return process.error();
  if (const int code = (*process)->wait(); code != 0)
    return Error{ErrorCode::failed_precondition, "mitsuba_twin.py ended with " + std::to_string(code),
                 request.glb.string()};
  return folder / "scene.xml";
}

}  // namespace helio::bench
