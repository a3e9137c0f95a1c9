// Libraries depend downward only: greps every #include of the tree against ARCHITECTURE.md's table.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>

namespace {

namespace fs = std::filesystem;

// Which of our folders a folder may include besides itself.
const std::map<std::string, std::set<std::string>> kAllowed = {
    {"renderer/base", {}},
    {"renderer/codec", {"renderer/base"}},
    {"renderer/film", {"renderer/base"}},
    {"renderer/metrics", {"renderer/base"}},
    {"renderer/scene", {"renderer/base"}},
    {"renderer/trace", {"renderer/base", "renderer/scene", "renderer/film"}},
    {"renderer/frame", {"renderer/base", "renderer/scene", "renderer/film", "renderer/trace", "renderer/metrics"}},
    {"server",
     {"renderer/base", "renderer/scene", "renderer/film", "renderer/trace", "renderer/metrics", "renderer/frame",
      "renderer/codec", "proto"}},
    {"client", {"renderer/base", "renderer/codec", "proto"}},
    {"client/cli",
     {"renderer/base", "renderer/codec", "renderer/scene", "renderer/trace", "renderer/film", "client", "server",
      "proto"}},
};

// Libraries that only some folders may see, by the beginning of the included path.
const std::map<std::string, std::set<std::string>> kForeign = {
    {"embree", {"renderer/trace"}},
    {"OpenImageIO", {"renderer/scene", "renderer/codec"}},
    {"OpenEXR", {"renderer/codec"}},
    {"Imf", {"renderer/codec"}},
    {"grpc", {"server", "client", "client/cli"}},
    {"google/protobuf", {"server", "client", "client/cli"}},
};

std::string folder_of(const std::string& path) {
  std::string best;
  for (const auto& [folder, unused] : kAllowed) {
    if (path.rfind(folder + "/", 0) == 0 && folder.size() > best.size()) best = folder;
  }
  if (path.rfind("heliograph/v1/", 0) == 0) return "proto";
  return best;
}

TEST(IncludeRules, DependDownwardOnly) {
  const fs::path root = HELIO_SOURCE_DIR;
  int files = 0;
  for (const char* top : {"renderer", "server", "client"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      ++files;
      const std::string path = fs::relative(entry.path(), root).string(), folder = folder_of(path);
      ASSERT_FALSE(folder.empty()) << path << " is in no known folder";
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        if (line.rfind("#include ", 0) != 0 || line.size() < 12) continue;
        const std::string included = line.substr(10, line.find_last_of("\">") - 10);
        const std::string target = folder_of(included);
        if (!target.empty() && target != folder) {
          EXPECT_TRUE(kAllowed.at(folder).count(target)) << path << " includes " << included;
        }
        for (const auto& [prefix, folders] : kForeign) {
          if (included.rfind(prefix, 0) == 0) {
            EXPECT_TRUE(folders.count(folder)) << path << " includes " << included;
          }
        }
      }
    }
  }
  EXPECT_GT(files, 100);
}

}  // namespace
