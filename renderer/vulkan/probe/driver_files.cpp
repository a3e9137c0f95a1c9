#include "renderer/vulkan/probe/driver_files.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>

#include "renderer/base/hash.h"

namespace helio::vulkan {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostManifests = 64, kLargestManifest = 64 << 10;

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::vector<std::string> colon_separated(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(':', begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

void add_manifests(const fs::path& place, std::set<fs::path>& manifests) {
  std::error_code error;
  if (!fs::is_directory(place, error)) {
    if (manifests.size() < kMostManifests && fs::exists(place, error)) manifests.insert(place);
    return;
  }
  for (fs::directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".json" && manifests.size() < kMostManifests) manifests.insert(entry->path());
  }
}

void add_folders(const std::string& bases, std::set<fs::path>& manifests) {
  for (const std::string& base : colon_separated(bases)) add_manifests(fs::path(base) / "vulkan/icd.d", manifests);
}

std::string or_else(std::string value, const std::string& otherwise) {
  return value.empty() ? otherwise : value;
}

std::set<fs::path> driver_manifests() {
  std::set<fs::path> manifests;
  const std::string chosen = or_else(variable("VK_DRIVER_FILES"), variable("VK_ICD_FILENAMES"));
  for (const std::string& place : colon_separated(or_else(chosen, variable("VK_ADD_DRIVER_FILES"))))
    add_manifests(place, manifests);
  if (!chosen.empty()) return manifests;
  const std::string home = variable("HOME");
  add_folders(or_else(variable("XDG_CONFIG_HOME"), home + "/.config"), manifests);
  add_folders(or_else(variable("XDG_CONFIG_DIRS"), "/etc/xdg"), manifests);
  add_folders("/usr/local/etc:/etc", manifests);
  add_folders(or_else(variable("XDG_DATA_HOME"), home + "/.local/share"), manifests);
  add_folders(or_else(variable("XDG_DATA_DIRS"), "/usr/local/share:/usr/share"), manifests);
  return manifests;
}

// The library that a manifest names; empty where it names none, or one that is not where the dynamic linker usually
// looks.
fs::path library_of(const fs::path& manifest) {
  std::error_code error;
  if (!fs::is_regular_file(manifest, error) || fs::file_size(manifest, error) > kLargestManifest) return {};
  std::ifstream in(manifest);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("ICD") || !json["ICD"].is_object()) return {};
  const auto name = json["ICD"].find("library_path");
  if (name == json["ICD"].end() || !name->is_string()) return {};
  const fs::path library = name->get<std::string>();
  if (library.is_absolute()) return library;
  if (library.has_parent_path()) return manifest.parent_path() / library;
  const std::string usual = ":/usr/lib/" HELIO_LIBRARY_ARCHITECTURE ":/lib/" HELIO_LIBRARY_ARCHITECTURE
                            ":/usr/local/lib:/usr/lib64:/lib64:/usr/lib:/lib";
  for (const std::string& folder : colon_separated(variable("LD_LIBRARY_PATH") + usual)) {
    if (fs::exists(fs::path(folder) / library, error)) return fs::path(folder) / library;
  }
  return {};
}

std::uint64_t add(std::uint64_t hash, std::string_view text) {
  for (const char c : text) hash = fnv1a(hash, static_cast<unsigned char>(c));
  return fnv1a(hash, 0x100);  // an end that no character has
}

}  // namespace

std::vector<fs::path> driver_files() {
  std::set<fs::path> files = driver_manifests();
  for (const fs::path& manifest : std::set<fs::path>(files)) {
    if (const fs::path library = library_of(manifest); !library.empty()) files.insert(library);
  }
  return {files.begin(), files.end()};
}

std::uint64_t driver_fingerprint() {
  std::uint64_t hash = kFnv1aStart;
  for (const fs::path& file : driver_files()) {
    hash = add(hash, file.native());
    struct stat status;
    if (stat(file.c_str(), &status) != 0) continue;
    for (const auto part : {status.st_mtim.tv_sec, status.st_mtim.tv_nsec, static_cast<time_t>(status.st_size)})
      hash = fnv1a(hash, static_cast<std::uint64_t>(part));
  }
  for (const char* name : {"VK_LOADER_DRIVERS_SELECT", "VK_LOADER_DRIVERS_DISABLE", "VK_INSTANCE_LAYERS",
                           "LD_LIBRARY_PATH", "LP_NATIVE_VECTOR_WIDTH", "LP_PERF", "GALLIVM_PERF"})
    hash = add(add(hash, name), variable(name));
  return hash64(hash);
}

}  // namespace helio::vulkan
