#include "renderer/scene/mitsuba/document.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <pugixml.hpp>

#include "renderer/scene/description/load_options.h"

namespace helio::mitsuba {

const std::string Element::kNone;

const std::string& Element::attribute(const char* key, const std::string& fallback) const {
  const auto found = attributes.find(key);
  return found == attributes.end() ? fallback : found->second;
}

namespace {

using Parameters = std::map<std::string, std::string>;

// Defaults that name defaults could double without end.
constexpr std::size_t kMaxText = 1 << 16;

std::string line_place(std::string_view text, const std::string& file, std::ptrdiff_t offset) {
  const auto end = text.begin() + std::clamp<std::ptrdiff_t>(offset, 0, std::ptrdiff_t(text.size()));
  return file + ":" + std::to_string(1 + std::count(text.begin(), end, '\n'));
}

std::string normalized(const std::string& path) {
  return std::filesystem::path(path).lexically_normal().generic_string();
}

std::string folder_of(const std::string& file) {
  const std::size_t slash = file.rfind('/');
  return slash == std::string::npos ? "" : file.substr(0, slash + 1);
}

// "$name" by the parameter's value; the longest name that fits counts. Returns an unknown name, or "".
std::string replace_parameters(std::string& text, const Parameters& parameters) {
  for (std::size_t at = text.find('$'); at != std::string::npos; at = text.find('$', at)) {
    const std::string* best = nullptr;
    std::size_t length = 0;
    for (const auto& [name, value] : parameters) {
      if (name.size() >= length && text.compare(at + 1, name.size(), name) == 0) {
        best = &value;
        length = name.size();
      }
    }
    if (!best) return text.substr(at);
    text.replace(at, length + 1, *best);
    at += best->size();
    if (text.size() > kMaxText) return {};
  }
  return {};
}

// Files before version 2 write toWorld and intIOR where later ones write to_world and int_ior; capitals that follow no
// small letter stay.
std::string snake_case(const std::string& name) {
  std::string out;
  const auto is_upper = [&](std::size_t i) { return std::isupper(static_cast<unsigned char>(name[i])) != 0; };
  const auto is_lower = [&](std::size_t i) { return std::islower(static_cast<unsigned char>(name[i])) != 0; };
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!(i > 0 && is_upper(i) && is_lower(i - 1))) {
      out += name[i];
      continue;
    }
    out += '_';
    for (; i < name.size() && is_upper(i); ++i) out += char(std::tolower(static_cast<unsigned char>(name[i])));
    --i;
  }
  return out;
}

class Reader {
 public:
  Reader(const FileSource* source, MemoryBudget& budget, Diagnostics& diagnostics, Document& document)
      : source_(source), budget_(budget), diagnostics_(diagnostics), document_(document) {}

  void read_file(std::span<const std::uint8_t> bytes, const std::string& file, int include_depth, Element& root) {
    // The tree, the parser's and ours, is larger than its text.
    if (Status s = budget_.reserve(bytes.size(), 32, file); !s.ok()) return diagnostics_.fail(file, s.error());
    pugi::xml_document xml;
    const pugi::xml_parse_result parsed = xml.load_buffer(bytes.data(), bytes.size());
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!parsed)
      return diagnostics_.fail(line_place(text, file, parsed.offset),
                               std::string("is not well-formed XML: ") + parsed.description());
    const pugi::xml_node scene = xml.document_element();
    const std::string tag = scene.name();
    if (tag != "scene" && include_depth == 0)
      return diagnostics_.fail(file + ":1", "the outermost element is <" + tag + ">, allowed: <scene>");
    lines_.clear();
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') lines_.push_back(std::ptrdiff_t(i));
    const std::string version = scene.attribute("version").value();
    if (version.empty() && include_depth == 0)
      diagnostics_.warn(place_of(scene, file), "has no version; it is read as version 3");
    const bool old_before = old_;
    if (!version.empty()) old_ = version.starts_with("0.") || version.starts_with("1.");
    if (tag == "scene") {
      root.tag = "scene";
      root.place = place_of(scene, file);
      read_children(scene, file, 0, include_depth, root);
    } else {
      read_child(scene, file, 0, include_depth, root);
    }
    old_ = old_before;
  }

  const std::vector<std::string>& names() const { return names_; }

 private:
  std::string place_of(const pugi::xml_node& node, const std::string& file) const {
    const auto line = std::upper_bound(lines_.begin(), lines_.end(), node.offset_debug()) - lines_.begin();
    return file + ":" + std::to_string(line + 1);
  }

  void read_children(const pugi::xml_node& node, const std::string& file, int depth, int include_depth,
                     Element& element) {
    for (const pugi::xml_node& child : node.children()) {
      if (child.type() == pugi::node_element) read_child(child, file, depth + 1, include_depth, element);
    }
  }

  void read_child(const pugi::xml_node& node, const std::string& file, int depth, int include_depth, Element& parent) {
    Element element;
    element.tag = node.name();
    element.place = place_of(node, file);
    if (depth > kMaxElementDepth)
      return diagnostics_.fail(element.place,
                               "lies deeper than " + std::to_string(kMaxElementDepth) + " elements, the most allowed");
    const bool is_default = element.tag == "default";
    for (const pugi::xml_attribute& attribute : node.attributes()) {
      const std::string key = attribute.name();
      std::string value = attribute.value();
      const std::string unknown = replace_parameters(value, parameters_);
      if (value.size() > kMaxText) {
        diagnostics_.fail(element.place, key + " has more than " + std::to_string(kMaxText) + " characters");
        value.clear();
      } else if (!unknown.empty() && !is_default) {
        diagnostics_.fail(element.place, "names the parameter " + unknown.substr(0, 64) + ", which has no default");
      }
      if (key == "type")
        element.type = value;
      else if (key == "id")
        element.id = value;
      else if (key == "name")
        element.name = old_ && !is_default ? snake_case(value) : value;
      else
        element.attributes[key] = value;
    }
    if (element.tag == "lookAt") element.tag = "lookat";
    if (is_default) {
      parameters_.try_emplace(element.name, element.attribute("value"));
      return;
    }
    if (element.tag == "path") return add_folder(element, file);
    if (element.tag == "include") return include(element, include_depth, parent);
    if (element.tag == "alias") return add_alias(element);
    if (element.name == "filename") add_name(element.attribute("value"));
    read_children(node, file, depth, include_depth, element);
    if (element.tag == "texture" && old_) upgrade_texture(element);
    if (element.tag == "bsdf" && element.type == "diffuse" && old_) upgrade_diffuse(element);
    if (element.tag == "bsdf" && element.type.ends_with("conductor") && old_) check_conductor(element);
    parent.children.push_back(std::move(element));
  }

  static void upgrade_diffuse(Element& bsdf) {
    for (Element& child : bsdf.children)
      if (child.name == "diffuse_reflectance") child.name = "reflectance";
  }

  // Mitsuba 3 takes its own default for files of all versions.
  void check_conductor(const Element& bsdf) {
    const auto says_metal = [](const Element& child) {
      return child.name == "material" || child.name == "eta" || child.name == "k";
    };
    if (std::none_of(bsdf.children.begin(), bsdf.children.end(), says_metal))
      diagnostics_.warn(bsdf.place,
                        "bsdf \"" + bsdf.type +
                            "\" names no material: it is a perfect mirror, as in Mitsuba 3, where the file's "
                            "own version took copper");
  }

  // uscale, vscale, uoffset and voffset became the transform to_uv, which offsets before it scales.
  static void upgrade_texture(Element& texture) {
    Element scale, translate;
    scale.tag = "scale";
    translate.tag = "translate";
    bool any = false;
    std::erase_if(texture.children, [&](const Element& child) {
      const std::string& n = child.name;
      if (n != "uscale" && n != "vscale" && n != "uoffset" && n != "voffset") return false;
      (n.ends_with("scale") ? scale : translate).attributes[n[0] == 'u' ? "x" : "y"] = child.attribute("value");
      any = true;
      return true;
    });
    if (!any) return;
    Element transform;
    transform.tag = "transform";
    transform.name = "to_uv";
    transform.place = scale.place = translate.place = texture.place;
    transform.children = {translate, scale};
    texture.children.push_back(std::move(transform));
  }

  void add_folder(const Element& element, const std::string& file) {
    std::string folder = element.attribute("value");
    if (!folder.empty() && folder.back() != '/') folder += '/';
    document_.folders.insert(document_.folders.begin(), normalized(folder_of(file) + folder));
  }

  void add_alias(const Element& element) {
    document_.root.attributes["alias:" + element.attribute("as")] = element.id;
  }

  void include(const Element& element, int include_depth, Element& parent) {
    const std::string& name = element.attribute("filename");
    add_name(name);
    if (!source_) return;
    if (include_depth + 1 > kMaxIncludeDepth)
      return diagnostics_.fail(element.place, "includes deeper than " + std::to_string(kMaxIncludeDepth) +
                                                  " files, the most allowed: does it include itself?");
    Result<FoundFile> file = find_file(document_, *source_, name, budget_);
    if (!file.ok()) return diagnostics_.fail(element.place, file.error());
    const auto lines = std::move(lines_);
    Element included;
    read_file(file->bytes, file->path, include_depth + 1, included);
    lines_ = lines;
    for (Element& child : included.children) parent.children.push_back(std::move(child));
  }

  void add_name(const std::string& name) {
    if (!name.empty() && std::find(names_.begin(), names_.end(), name) == names_.end()) names_.push_back(name);
  }

  const FileSource* source_;  // null: included files are only named
  MemoryBudget& budget_;
  Diagnostics& diagnostics_;
  Document& document_;
  Parameters parameters_;
  std::vector<std::ptrdiff_t> lines_;  // offsets of the newlines of the file being read
  std::vector<std::string> names_;
  bool old_ = false;
};

void collect_ids(const Element& element, Document& document, Diagnostics& diagnostics) {
  if (!element.id.empty() && element.tag != "ref" && !document.ids.emplace(element.id, &element).second)
    diagnostics.fail(element.place, "the id \"" + element.id + "\" is taken by another element");
  for (const Element& child : element.children) collect_ids(child, document, diagnostics);
}

}  // namespace

void read_document(std::span<const std::uint8_t> bytes, const std::string& file, const FileSource& source,
                   MemoryBudget& budget, Diagnostics& diagnostics, Document& document) {
  document.file = file;
  document.folders = {folder_of(file)};
  Reader(&source, budget, diagnostics, document).read_file(bytes, file, 0, document.root);
  if (diagnostics.failed()) return;
  collect_ids(document.root, document, diagnostics);
  for (const auto& [key, id] : document.root.attributes) {
    if (!key.starts_with("alias:")) continue;
    if (const auto found = document.ids.find(id); found != document.ids.end())
      document.ids.emplace(key.substr(6), found->second);
  }
}

Result<std::vector<std::string>> mitsuba_file_names(std::span<const std::uint8_t> bytes, const std::string& file) {
  MemoryBudget budget(SceneLoadOptions{}.max_memory_bytes);
  budget.add_source_file(file, bytes.size());
  Diagnostics diagnostics("");
  Document document;
  document.folders = {""};
  Reader reader(nullptr, budget, diagnostics, document);
  reader.read_file(bytes, file, 0, document.root);
  if (diagnostics.failed()) return diagnostics.to_error();
  return reader.names();
}

Result<FoundFile> find_file(const Document& document, const FileSource& source, const std::string& name,
                            MemoryBudget& budget) {
  if (name.empty()) return Error{ErrorCode::invalid_argument, "names no file", ""};
  Error first;
  for (std::size_t i = 0; i < document.folders.size(); ++i) {
    const bool absolute = name.front() == '/' || name.front() == '\\';
    const std::string path = absolute ? name : normalized(document.folders[i] + name);
    Result<std::vector<std::uint8_t>> bytes = source.read(path, budget.remaining_configured());
    if (bytes.ok()) {
      budget.add_source_file(path, bytes->size());
      return FoundFile{path, std::move(*bytes)};
    }
    if (i == 0 || bytes.error().code != ErrorCode::not_found) first = bytes.error();
  }
  return first;
}

}  // namespace helio::mitsuba
