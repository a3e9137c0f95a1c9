#include "server/base/build_info.h"

#include <elf.h>
#include <link.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "renderer/trace/accel/traversal_isa.h"

namespace helio {
namespace {

constexpr std::size_t kIdBytes = 5;  // of the 20 that the linker writes

// Of a segment of notes; empty: none of them is a build id.
std::string find_build_id(const unsigned char* notes, std::size_t bytes, std::size_t alignment) {
  const auto padded = [alignment](std::size_t size) { return (size + alignment - 1) / alignment * alignment; };
  std::size_t at = 0;
  ElfW(Nhdr) note{};
  while (at + sizeof note <= bytes) {
    std::memcpy(&note, notes + at, sizeof note);
    const std::size_t name = at + sizeof note, content = name + padded(note.n_namesz);
    if (content > bytes || note.n_descsz > bytes - content) break;
    if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(notes + name, "GNU", 4) == 0) {
      std::string id;
      for (std::size_t i = 0; i < std::min<std::size_t>(note.n_descsz, kIdBytes); ++i) {
        const unsigned byte = notes[content + i];
        id += "0123456789abcdef"[byte >> 4];
        id += "0123456789abcdef"[byte & 15];
      }
      return id;
    }
    at = content + padded(note.n_descsz);
  }
  return {};
}

// The program itself comes first: the answer 1 ends the iteration with it.
int read_program(dl_phdr_info* program, std::size_t, void* id) {
  for (int i = 0; i < program->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = program->dlpi_phdr[i];
    if (segment.p_type != PT_NOTE) continue;
    const auto* notes = reinterpret_cast<const unsigned char*>(std::uintptr_t(program->dlpi_addr + segment.p_vaddr));
    std::string& found = *static_cast<std::string*>(id);
    found = find_build_id(notes, segment.p_memsz, segment.p_align == 8 ? 8 : 4);
    if (!found.empty()) break;
  }
  return 1;
}

std::string describe() {
#if defined(__clang__)
  std::string text = "clang " __clang_version__ ", " HELIO_BUILD_TYPE;
#else
  std::string text = "g++ " __VERSION__ ", " HELIO_BUILD_TYPE;
#endif
  if (!build_id().empty()) text += ", " + build_id();
  return text;
}

}  // namespace

const char* build_version() {
  return HELIO_VERSION;
}

const std::string& build_id() {
  static const std::string id = [] {
    std::string found;
    dl_iterate_phdr(read_program, &found);
    return found;
  }();
  return id;
}

const std::string& build_description() {
  static const std::string description = describe();
  return description;
}

const char* build_isa() {
#if defined(__AVX512F__)
  return "avx512";
#elif defined(__AVX2__)
  return "avx2";
#elif defined(__AVX__)
  return "avx";
#elif defined(__SSE2__)
  return "sse2";
#elif defined(__ARM_NEON)
  return "neon";
#else
  return "generic";
#endif
}

std::string rendering_isa() {
  return std::string(build_isa()) + ", traversal by " + traversal_isa();
}

std::vector<std::pair<std::string, std::string>> build_libraries() {
  return {{"Embree", HELIO_EMBREE_VERSION}, {"OpenEXR", HELIO_OPENEXR_VERSION}, {"OpenImageIO", HELIO_OIIO_VERSION},
          {"TBB", HELIO_TBB_VERSION},       {"gRPC", HELIO_GRPC_VERSION},       {"Protobuf", HELIO_PROTOBUF_VERSION},
          {"SQLite", HELIO_SQLITE_VERSION}};
}

}  // namespace helio
