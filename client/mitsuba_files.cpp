#include "client/mitsuba_files.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <pugixml.hpp>
#include <set>

#include "client/gltf_uris.h"

namespace helio {

namespace {

constexpr int kMaxIncludeDepth = 8;        // as the loader has it
constexpr std::size_t kMaxText = 1 << 16;  // defaults of defaults could double without end

class Finder {
 public:
  explicit Finder(const std::string& folder) : folder_(folder) {}

  void read(const std::string& path, int depth) {
    pugi::xml_document document;
    if (depth > kMaxIncludeDepth || !read_.insert(path).second || !document.load_file(path.c_str())) return;
    std::vector<std::string> included;
    Walker walker{*this, included};
    document.traverse(walker);
    for (const std::string& name : included) {
      if (const auto relative = relative_path_of(name)) read(folder_ + *relative, depth + 1);
      for (const std::string& prefix : prefixes_)
        if (const auto relative = relative_path_of(prefix + name)) read(folder_ + *relative, depth + 1);
    }
  }

  std::vector<std::string> files;

 private:
  struct Walker : pugi::xml_tree_walker {
    Walker(Finder& f, std::vector<std::string>& i) : finder(f), included(i) {}
    bool for_each(pugi::xml_node& node) override {
      const std::string tag = node.name();
      const std::string value = finder.replaced(node.attribute("value").value());
      if (tag == "path") {
        finder.add_prefix(value);
      } else if (tag == "default") {
        finder.parameters_.try_emplace(node.attribute("name").value(), value);
      } else if (tag == "include") {
        included.push_back(finder.replaced(node.attribute("filename").value()));
        finder.add(included.back());
      } else if (std::string(node.attribute("name").value()) == "filename") {
        finder.add(value);
      }
      return true;
    }
    Finder& finder;
    std::vector<std::string>& included;
  };

  std::string replaced(std::string text) const {
    // Longer names first: $width before $w.
    for (auto p = parameters_.rbegin(); p != parameters_.rend(); ++p) {
      const std::string key = "$" + p->first;
      for (std::size_t at = text.find(key); at != std::string::npos && text.size() <= kMaxText;
           at = text.find(key, at + p->second.size()))
        text.replace(at, key.size(), p->second);
    }
    return text;
  }

  void add_prefix(std::string prefix) {
    if (!prefix.empty() && prefix.back() != '/') prefix += '/';
    prefixes_.push_back(prefix);
  }

  // The name, and where it lies below a <path>.
  void add(const std::string& name) {
    if (name.empty()) return;
    add_file(name);
    for (const std::string& prefix : prefixes_) {
      const auto relative = relative_path_of(prefix + name);
      if (relative && std::filesystem::is_regular_file(folder_ + *relative)) add_file(*relative);
    }
  }

  void add_file(const std::string& name) {
    if (std::find(files.begin(), files.end(), name) == files.end()) files.push_back(name);
  }

  std::string folder_;
  std::vector<std::string> prefixes_;  // of <path>, with a slash at their ends
  std::map<std::string, std::string> parameters_;
  std::set<std::string> read_;
};

}  // namespace

std::vector<std::string> find_mitsuba_files(const std::string& scene_path, const std::string& folder) {
  Finder finder(folder);
  finder.read(scene_path, 0);
  return std::move(finder.files);
}

}  // namespace helio
