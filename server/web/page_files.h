// The viewer's files (client/web), which are part of the program: there is no path to lose.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>

namespace helio {

struct EmbeddedFile {
  const char* path;  // below client/web
  const char *begin, *end;
};
// Made by server/web/CMakeLists.txt.
std::span<const EmbeddedFile> embedded_files();

struct PageFile {
  std::string_view type;  // of its content, as HTTP has it
  std::string_view bytes;
  std::string gzip;  // the same, compressed; empty where that is no smaller
  std::string tag;   // changes with the bytes
};

class PageFiles {
 public:
  PageFiles();  // compresses them: some 60 ms

  // By path without a slash in front, "" being index.html; "protocol.json" is made from the descriptors. Null: none.
  const PageFile* find(std::string_view path) const;

 private:
  void add(const std::string& path, std::string_view bytes);

  std::string protocol_;
  std::map<std::string, PageFile, std::less<>> files_;
};

}  // namespace helio
