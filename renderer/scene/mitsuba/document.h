// A Mitsuba scene file as a tree of plain elements: includes in place, $parameters replaced, names of 0.5 and 0.6 files
// turned into those of version 3. What the elements mean is for the other mitsuba_* files.
//
// Every element knows its place ("scene.xml:12") and whether somebody read it, so that what nobody understood can be
// reported.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/description/file_source.h"
#include "renderer/scene/description/load_diagnostics.h"
#include "renderer/scene/description/memory_budget.h"

namespace helio::mitsuba {

struct Element {
  std::string tag;   // "bsdf", "float", "transform", "ref", ...
  std::string type;  // of plugins: "diffuse"
  std::string id, name;
  std::map<std::string, std::string> attributes;  // all others
  std::string place;                              // "file.xml:line"
  std::vector<Element> children;
  mutable bool read = false;

  // The attribute, or `fallback` where there is none.
  const std::string& attribute(const char* key, const std::string& fallback = kNone) const;
  static const std::string kNone;
};

struct Document {
  std::string file;  // main file, as given
  Element root;
  std::map<std::string, const Element*> ids;
  std::vector<std::string> folders;  // where files are looked for, in this order: "" or "a/b/"
};

// Limits of what a file may ask for; beyond them it is refused.
inline constexpr int kMaxElementDepth = 32, kMaxIncludeDepth = 8;

// Reads `bytes` and the files it includes. Problems go to `diagnostics`; the result then is incomplete. ids holds
// pointers into `document`, which must not be moved afterwards.
void read_document(std::span<const std::uint8_t> bytes, const std::string& file, const FileSource& source,
                   MemoryBudget& budget, Diagnostics& diagnostics, Document& document);

// Names of the other files that this one file names (includes, meshes, textures): relative to its folder, unique, in
// order. Parameters with a default are replaced. Errors: invalid_argument (not well-formed XML).
Result<std::vector<std::string>> mitsuba_file_names(std::span<const std::uint8_t> bytes, const std::string& file);

// The bytes of `name`, looked for in the document's folders. Errors: those of the first folder's FileSource::read.
struct FoundFile {
  std::string path;
  std::vector<std::uint8_t> bytes;
};
Result<FoundFile> find_file(const Document& document, const FileSource& source, const std::string& name,
                            MemoryBudget& budget);

}  // namespace helio::mitsuba
