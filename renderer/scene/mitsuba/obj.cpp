// Wavefront OBJ: v, vt, vn and f; everything else (groups, materials, smoothing) is skipped.
#include <charconv>
#include <map>
#include <string_view>

#include "renderer/scene/mitsuba/meshes.h"

namespace helio::mitsuba {

namespace {

class ObjParser {
 public:
  explicit ObjParser(MemoryBudget& budget) : budget_(budget) {}

  Result<TriangleMesh> parse(std::string_view text) {
    // Each byte of text becomes at most a few bytes of arrays.
    if (Status s = budget_.reserve(text.size(), 16, ""); !s.ok()) return s.error();
    while (!text.empty()) {
      ++line_;
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      if (const char* problem = read_line(line))
        return Error{ErrorCode::invalid_argument, "line " + std::to_string(line_) + ": " + problem, ""};
    }
    if (mesh_.indices.empty()) return Error{ErrorCode::invalid_argument, "holds no face", ""};
    if (!has_normals_) mesh_.normals.clear();
    if (!has_uvs_) mesh_.texcoords[0].clear();
    return std::move(mesh_);
  }

 private:
  using Corner = std::array<std::int64_t, 3>;  // position, uv, normal; -1: none

  static std::string_view next(std::string_view& line) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t\r"), line.size());
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(end);
    return word;
  }

  template <int N>
  static bool numbers(std::string_view line, float* out) {
    for (int i = 0; i < N; ++i) {
      std::string_view word = next(line);
      if (!word.empty() && word.front() == '+') word.remove_prefix(1);
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out[i]);
      if (error == std::errc::result_out_of_range) out[i] = 0;  // denormal
      else if (error != std::errc() || end != word.data() + word.size()) return false;
    }
    return true;
  }

  const char* read_line(std::string_view line) {
    const std::string_view key = next(line);
    float v[3];
    if (key == "v") {
      if (!numbers<3>(line, v)) return "a vertex needs three numbers";
      positions_.emplace_back(v[0], v[1], v[2]);
    } else if (key == "vt") {
      if (!numbers<2>(line, v)) return "a texture coordinate needs two numbers";
      uvs_.emplace_back(v[0], v[1]);
    } else if (key == "vn") {
      if (!numbers<3>(line, v)) return "a normal needs three numbers";
      normals_.emplace_back(v[0], v[1], v[2]);
    } else if (key == "f") {
      return read_face(line);
    }
    return nullptr;
  }

  const char* read_face(std::string_view line) {
    std::uint32_t first = 0, previous = 0;
    int count = 0;
    for (std::string_view word = next(line); !word.empty(); word = next(line)) {
      Corner corner{-1, -1, -1};
      const std::size_t sizes[3] = {positions_.size(), uvs_.size(), normals_.size()};
      for (int k = 0; k < 3; ++k) {
        const std::size_t end = std::min(word.find('/'), word.size());
        const std::string_view number = word.substr(0, end);
        word.remove_prefix(std::min(end + 1, word.size()));
        if (number.empty()) continue;
        std::int64_t index = 0;
        const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), index);
        if (error != std::errc() || stop != number.data() + number.size()) return "a face's index is not a number";
        corner[std::size_t(k)] = index < 0 ? std::int64_t(sizes[k]) + index : index - 1;
        if (corner[std::size_t(k)] < 0 || corner[std::size_t(k)] >= std::int64_t(sizes[k]))
          return "a face's index is outside of what came before it";
      }
      if (corner[0] < 0) return "a face's corner has no vertex";
      const std::uint32_t vertex = vertex_of(corner);
      if (++count == 1) first = vertex;
      if (count >= 3) mesh_.indices.insert(mesh_.indices.end(), {first, previous, vertex});
      previous = vertex;
    }
    return count < 3 ? "a face needs three corners" : nullptr;
  }

  std::uint32_t vertex_of(const Corner& corner) {
    const auto [found, added] = vertices_.try_emplace(corner, std::uint32_t(mesh_.positions.size()));
    if (!added) return found->second;
    mesh_.positions.push_back(positions_[std::size_t(corner[0])]);
    // Corners without texture coordinates or normals beside others that have them: (0, 0), and flat (check_mesh).
    mesh_.texcoords[0].push_back(corner[1] < 0 ? V2f(0, 0) : uvs_[std::size_t(corner[1])]);
    mesh_.normals.push_back(corner[2] < 0 ? V3f(0, 0, 0) : normals_[std::size_t(corner[2])]);
    has_uvs_ |= corner[1] >= 0;
    has_normals_ |= corner[2] >= 0;
    return found->second;
  }

  MemoryBudget& budget_;
  TriangleMesh mesh_;
  std::vector<V3f> positions_, normals_;
  std::vector<V2f> uvs_;
  std::map<Corner, std::uint32_t> vertices_;
  std::size_t line_ = 0;
  bool has_uvs_ = false, has_normals_ = false;
};

}  // namespace

Result<TriangleMesh> parse_obj(std::span<const std::uint8_t> bytes, MemoryBudget& budget) {
  return ObjParser(budget).parse({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace helio::mitsuba
