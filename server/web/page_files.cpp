#include "server/web/page_files.h"

#include <libdeflate.h>

#include <memory>

#include "renderer/codec/sha256.h"
#include "server/web/protocol_table.h"

namespace helio {
namespace {

constexpr int kLevel = 11;  // 3 % smaller than by 9, in some 60 ms instead of 20

std::string_view type_of(std::string_view path) {
  struct Kind {
    std::string_view ending, type;
  };
  static constexpr Kind kKinds[] = {
      {".html", "text/html; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
  };
  for (const Kind& kind : kKinds) {
    if (path.ends_with(kind.ending)) return kind.type;
  }
  return "text/plain; charset=utf-8";
}

std::string compress(std::string_view bytes) {
  struct Free {
    void operator()(libdeflate_compressor* compressor) const { libdeflate_free_compressor(compressor); }
  };
  const std::unique_ptr<libdeflate_compressor, Free> compressor(libdeflate_alloc_compressor(kLevel));
  if (!compressor || bytes.empty()) return {};
  std::string out(bytes.size() - 1, '\0');  // no room for what is no smaller
  out.resize(libdeflate_gzip_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
  return out;
}

}  // namespace

PageFiles::PageFiles() : protocol_(protocol_table()) {
  for (const EmbeddedFile& file : embedded_files()) {
    add(file.path, {file.begin, std::size_t(file.end - file.begin)});
  }
  add("protocol.json", protocol_);
}

void PageFiles::add(const std::string& path, std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  files_[path] = {type_of(path), bytes, compress(bytes), "\"" + to_hex(hash.finish()).substr(0, 32) + "\""};
}

const PageFile* PageFiles::find(std::string_view path) const {
  const auto found = files_.find(path.empty() ? "index.html" : path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace helio
