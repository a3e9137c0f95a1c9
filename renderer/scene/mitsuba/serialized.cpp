// Mitsuba's serialized meshes: at the end of the file a directory of offsets, per mesh a header and a zlib stream of
// flags, name, counts, positions, normals, texture coordinates, colours and indices; all little endian.
#include <zlib.h>

#include <cstring>

#include "renderer/scene/mitsuba/meshes.h"

namespace helio::mitsuba {

namespace {

enum Flags : std::uint32_t { kNormals = 0x1, kTexcoords = 0x2, kColors = 0x8, kDouble = 0x2000 };

Error broken(const std::string& what) {
  return {ErrorCode::invalid_argument, what, ""};
}

template <class T>
bool read_at(std::span<const std::uint8_t> bytes, std::uint64_t at, T& out) {
  if (at > bytes.size() || bytes.size() - at < sizeof(T)) return false;
  std::memcpy(&out, bytes.data() + at, sizeof(T));
  return true;
}

// Inflates piece by piece, so that memory follows what was asked for and not what the stream claims.
class Inflater {
 public:
  explicit Inflater(std::span<const std::uint8_t> bytes) {
    stream_.next_in = const_cast<Bytef*>(bytes.data());
    stream_.avail_in = uInt(std::min<std::size_t>(bytes.size(), UINT32_MAX));
    ready_ = inflateInit(&stream_) == Z_OK;
  }
  ~Inflater() {
    if (ready_) inflateEnd(&stream_);
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  bool read(void* out, std::size_t bytes) {
    auto* at = static_cast<Bytef*>(out);
    while (ready_ && bytes > 0) {
      const uInt piece = uInt(std::min<std::size_t>(bytes, 1u << 30));
      stream_.next_out = at;
      stream_.avail_out = piece;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      const uInt got = piece - stream_.avail_out;
      at += got;
      bytes -= got;
      if (bytes > 0 && (code != Z_OK || got == 0)) return false;
    }
    return ready_;
  }
  template <class T>
  bool read(T& out) {
    return read(&out, sizeof(T));
  }

 private:
  z_stream stream_{};
  bool ready_ = false;
};

template <class Vector>
bool read_vectors(Inflater& in, std::uint64_t count, bool doubles, std::vector<Vector>& out) {
  constexpr unsigned kN = Vector::dimensions();
  out.resize(std::size_t(count));
  for (Vector& v : out) {
    for (unsigned k = 0; k < kN; ++k) {
      double wide = 0;
      float narrow = 0;
      if (!(doubles ? in.read(wide) : in.read(narrow))) return false;
      v[int(k)] = doubles ? float(wide) : narrow;
    }
  }
  return true;
}

Result<TriangleMesh> read_mesh(std::span<const std::uint8_t> stream, int version, MemoryBudget& budget) {
  const Error truncated = broken("the compressed data of the mesh is broken or ends early");
  Inflater in(stream);
  std::uint32_t flags = 0;
  if (!in.read(flags)) return truncated;
  if (version >= 4) {
    char c = 1;
    for (int i = 0; c != 0; ++i) {
      if (i > 4096) return broken("the mesh's name is longer than 4096 bytes");
      if (!in.read(c)) return truncated;
    }
  }
  std::uint64_t vertices = 0, triangles = 0;
  if (!in.read(vertices) || !in.read(triangles)) return truncated;
  if (vertices > UINT32_MAX || triangles > UINT32_MAX / 3)
    return broken("has " + std::to_string(vertices) + " vertices and " + std::to_string(triangles) +
                  " triangles, allowed: 2^32 indices");
  if (Status s = budget.reserve(vertices, 32, ""); !s.ok()) return s.error();
  if (Status s = budget.reserve(triangles, 12, ""); !s.ok()) return s.error();
  TriangleMesh mesh;
  const bool doubles = flags & kDouble;
  if (!read_vectors(in, vertices, doubles, mesh.positions)) return truncated;
  if ((flags & kNormals) && !read_vectors(in, vertices, doubles, mesh.normals)) return truncated;
  if ((flags & kTexcoords) && !read_vectors(in, vertices, doubles, mesh.texcoords[0])) return truncated;
  if (flags & kColors) {
    std::vector<V3f> colors;
    if (!read_vectors(in, vertices, doubles, colors)) return truncated;
  }
  mesh.indices.resize(std::size_t(triangles) * 3);
  if (!in.read(mesh.indices.data(), mesh.indices.size() * 4)) return truncated;
  return mesh;
}

}  // namespace

Result<TriangleMesh> parse_serialized(std::span<const std::uint8_t> bytes, int shape_index, MemoryBudget& budget) {
  std::uint16_t magic = 0, version = 0;
  if (!read_at(bytes, 0, magic) || !read_at(bytes, 2, version) || magic != 0x041C)
    return broken("does not begin with the serialized format's number 0x041C");
  if (version != 3 && version != 4)
    return broken("has format version " + std::to_string(version) + ", allowed: 3 and 4");
  std::uint32_t count = 0;
  if (bytes.size() < 8 || !read_at(bytes, bytes.size() - 4, count) || count == 0) return broken("holds no mesh");
  const std::uint64_t entry = version == 4 ? 8 : 4;
  if (count > (bytes.size() - 4) / entry) return broken("its directory is larger than the file");
  if (shape_index < 0 || std::uint64_t(shape_index) >= count)
    return broken("shape_index is " + std::to_string(shape_index) + ", allowed: 0 to " + std::to_string(count - 1));
  const std::uint64_t directory = bytes.size() - 4 - entry * count;
  const std::uint64_t slot = directory + entry * std::uint64_t(shape_index);
  std::uint64_t offset = 0;
  std::uint32_t narrow = 0;
  if (version == 4)
    read_at(bytes, slot, offset);
  else if (read_at(bytes, slot, narrow))
    offset = narrow;
  if (offset > directory || directory - offset < 4)
    return broken("mesh " + std::to_string(shape_index) + " begins at byte " + std::to_string(offset) + " of " +
                  std::to_string(directory));
  return read_mesh(bytes.subspan(offset + 4, directory - offset - 4), version, budget);
}

}  // namespace helio::mitsuba
