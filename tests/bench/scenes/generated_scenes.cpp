#include "tests/bench/scenes/generated_scenes.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "tests/bench/peers/child_process.h"
#include "tests/bench/reports/checksum64.h"

namespace helio::bench {

namespace fs = std::filesystem;

namespace {

Result<std::uint64_t> generator_checksum(const fs::path& generator) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(generator, error)) {
    if (entry.path().extension() == ".py") files.push_back(entry.path());
  }
  if (files.empty()) return Error{ErrorCode::not_found, "holds no scene generator", generator.string()};
  std::sort(files.begin(), files.end());
  Checksum64 sum;
  for (const fs::path& file : files) {
    std::ifstream bytes(file, std::ios::binary);
    sum.add_text(std::string{std::istreambuf_iterator<char>(bytes), {}});
  }
  return sum.value();
}

}  // namespace

const std::vector<std::string>& generated_scenes() {
  static const std::vector<std::string> names = {"box-area",  "box-point",         "box-directional", "box-69k",
                                                 "box-1m",    "box-low-roughness", "box-glass",       "box-glossy",
                                                 "highlight", "courtyard"};
  return names;
}

Result<fs::path> generate_scene(const fs::path& folder, const std::string& name) {
  const fs::path generator = HELIO_SOURCE_DIR "/scenes/generate";
  const auto checksum = generator_checksum(generator);
  if (!checksum) return checksum.error();
  const fs::path place = folder / fmt::format("{:016x}", *checksum), file = place / (name + ".glb");
  if (fs::exists(file)) return file;
  std::error_code error;
  fs::create_directories(place, error);
  if (error) return Error{ErrorCode::permission_denied, "cannot be made: " + error.message(), place.string()};
  // Under another name first: a run beside this one, or one that is broken off, leaves no half a scene.
  const fs::path unfinished = place / fmt::format("{}.{}.glb", name, getpid());
  auto process =
      ChildProcess::start({"python3", "-B", generator.string(), "--scene", name, "--output", unfinished.string()});
  if (!process || (*process)->wait() != 0) {
    fs::remove(unfinished, error);
    return Error{ErrorCode::failed_precondition,
                 "'python3 " + generator.string() + " --scene " + name + "' failed; it needs Python 3.8 or later",
                 "scene " + name};
  }
  fs::rename(unfinished, file, error);
  if (error) return Error{ErrorCode::permission_denied, "cannot be written: " + error.message(), file.string()};
  return file;
}

}  // namespace helio::bench
