#include "client/local_scene.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>

#include "client/environment_text.h"
#include "client/gltf_uris.h"
#include "client/mitsuba_files.h"

namespace helio {

namespace fs = std::filesystem;

namespace {

constexpr std::array<char, 4> kGlbMagic = {'g', 'l', 'T', 'F'};
constexpr std::uint32_t kGlbJsonChunk = 0x4E4F534A;  // "JSON", little endian
constexpr std::uint64_t kGlbHeaderBytes = 20;        // file header and the first chunk's

std::uint32_t little_endian(const char* at) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(at);
  return bytes[0] | bytes[1] << 8 | bytes[2] << 16 | std::uint32_t(bytes[3]) << 24;
}

// Names in the JSON of a glTF file, whichever of the two containers it is, or in Mitsuba's XML; nothing for other
// formats.
std::vector<std::string> uris_of(const std::string& path, std::uint64_t bytes) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kGlbHeaderBytes> header{};
  file.read(header.data(), header.size());
  if (file.gcount() == std::streamsize(header.size()) &&
      std::equal(kGlbMagic.begin(), kGlbMagic.end(), header.begin())) {
    const std::uint64_t length = little_endian(&header[12]);
    if (little_endian(&header[16]) != kGlbJsonChunk || length > bytes - kGlbHeaderBytes) return {};
    std::string json(length, '\0');
    file.read(json.data(), static_cast<std::streamsize>(length));
    std::istringstream stream(std::move(json));
    return find_gltf_uris(stream);
  }
  file.clear();
  file.seekg(0);
  file >> std::ws;
  if (static_cast<unsigned char>(file.peek()) == 0xEF) file.ignore(3);  // byte order mark
  file >> std::ws;
  if (file.peek() == '<') {
    const std::string folder = fs::path(path).parent_path().string();
    return find_mitsuba_files(path, folder.empty() ? "" : folder + "/");
  }
  return file.peek() == '{' ? find_gltf_uris(file) : std::vector<std::string>{};
}

// The size of a regular file; none when there is no such file.
std::optional<std::uint64_t> regular_file_size(const fs::path& path) {
  std::error_code problem;
  if (!fs::is_regular_file(path, problem) || problem) return std::nullopt;
  const std::uint64_t bytes = fs::file_size(path, problem);
  if (problem) return std::nullopt;
  return bytes;
}

bool contains(const LocalScene& local, const std::string& name) {
  return std::any_of(local.files.begin(), local.files.end(), [&](const LocalSceneFile& f) { return f.name == name; });
}

void add_referenced_file(LocalScene& local, const fs::path& folder, const std::string& uri) {
  const std::optional<std::string> name = relative_path_of(uri);
  if (!name || contains(local, *name)) return;
  // Some exporters leave a '%' of the name as it is: the file itself decides.
  for (const std::string& candidate : {*name, uri}) {
    const fs::path path = folder / candidate;
    if (candidate.find("..") != std::string::npos) continue;
    if (const auto bytes = regular_file_size(path)) {
      local.files.push_back({*name, path.string(), *bytes});
      return;
    }
  }
}

}  // namespace

std::uint64_t LocalScene::total_bytes() const {
  std::uint64_t total = 0;
  for (const LocalSceneFile& file : files) total += file.bytes;
  return total;
}

Result<LocalScene> collect_local_scene(const std::string& scene_path, const std::string& environment) {
  const fs::path scene(scene_path);
  const auto bytes = regular_file_size(scene);
  if (!bytes) {
    std::error_code problem;
    const bool exists = fs::exists(scene, problem);
    return Error{ErrorCode::not_found, exists ? "is not a regular file" : "no such file", scene_path};
  }
  if (!std::ifstream(scene_path, std::ios::binary)) return Error{ErrorCode::not_found, "cannot be opened", scene_path};

  LocalScene local;
  local.main_file = scene.filename().string();
  local.files.push_back({local.main_file, scene_path, *bytes});
  for (const std::string& uri : uris_of(scene_path, *bytes)) add_referenced_file(local, scene.parent_path(), uri);

  const Result<bool> names_map = names_environment_map(environment);
  if (!names_map) return names_map.error();
  if (!*names_map) {
    local.environment = environment;
    return local;
  }
  const auto map_bytes = regular_file_size(environment);
  if (!map_bytes) {
    return Error{ErrorCode::invalid_argument, "'" + environment + "' is neither a file nor R,G,B", "environment"};
  }
  std::string name = fs::path(environment).filename().string();
  while (contains(local, name)) name = "environment/" + name;
  local.files.push_back({name, environment, *map_bytes});
  local.environment = name;
  return local;
}

}  // namespace helio
