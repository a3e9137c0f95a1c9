#include "renderer/scene/gltf/geometry.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "renderer/scene/gltf/draco.h"
#include "renderer/scene/gltf/morph.h"
#include "renderer/scene/gltf/topology.h"

namespace helio::gltf {

namespace {

class PrimitiveLoader {
 public:
  PrimitiveLoader(const Primitive& primitive, const std::string& place, const BufferStore& buffers,
                  AccessorReader& reader, Diagnostics& diagnostics)
      : primitive_(primitive), place_(place), buffers_(buffers), reader_(reader), diagnostics_(diagnostics) {}

  std::optional<PrimitiveGeometry> load(std::span<const float> weights, std::optional<std::size_t> joint_count) {
    if (!has_triangles(primitive_.topology)) {
      diagnostics_.warn(place_, "points and lines are not rendered");
      return std::nullopt;
    }
    if (primitive_.find("POSITION") < 0) {
      diagnostics_.warn(place_, "has no POSITION and is not rendered");
      return std::nullopt;
    }
    if (primitive_.draco && !decode_draco()) return std::nullopt;
    geometry_.mesh.material = primitive_.material;
    if (!read_attributes() || !read_triangles()) return std::nullopt;
    if (is_morphed(weights) && !apply_morph_targets(primitive_, weights, reader_, geometry_.mesh)) return std::nullopt;
    if (joint_count && !read_binding(*joint_count)) return std::nullopt;
    repair_directions(!is_morphed(weights) && !primitive_.draco);
    for (V4f& color : geometry_.mesh.colors)
      for (int c = 0; c < 4; ++c) color[c] = std::clamp(color[c], 0.0f, 1.0f);
    if (geometry_.mesh.indices.empty()) {
      diagnostics_.warn(place_, "has no triangle");
      return std::nullopt;
    }
    return std::move(geometry_);
  }

 private:
  bool decode_draco() {
    const std::string place = place_ / "extensions" / "KHR_draco_mesh_compression";
    const std::span<const std::uint8_t> bytes = buffers_.view(primitive_.draco->view);
    if (bytes.empty()) {
      diagnostics_.fail(place, "has no data: its buffer has no URI");
      return false;
    }
    Result<DracoMesh> decoded = DracoMesh::decode(bytes, reader_.budget());
    if (!decoded.ok()) {
      diagnostics_.fail(place, decoded.error());
      return false;
    }
    const std::uint64_t expected = reader_[primitive_.find("POSITION")].count;
    if (decoded->vertex_count() != expected) {
      diagnostics_.fail(place, "has " + std::to_string(decoded->vertex_count()) + " vertices, the accessors say " +
                                   std::to_string(expected));
      return false;
    }
    draco_ = std::move(*decoded);
    return true;
  }

  // The draco id of an attribute; -1 when it is stored plainly.
  std::int64_t draco_id(std::string_view semantic) const {
    if (!primitive_.draco) return -1;
    for (const auto& [name, id] : primitive_.draco->attributes)
      if (name == semantic) return id;
    return -1;
  }

  // Absent attributes leave `out` empty.
  template <class T>
  bool read(const std::string& semantic, std::vector<T>& out) {
    const int accessor = primitive_.find(semantic);
    if (accessor < 0) return true;
    const std::int64_t id = draco_id(semantic);
    if (id < 0) return reader_.read(accessor, out);
    Result<std::vector<float>> values = draco_->floats(std::uint32_t(id), reader_[accessor]);
    if (!keep(values)) return false;
    if (values->size() != draco_->vertex_count() * (sizeof(T) / sizeof(float))) {
      diagnostics_.fail(place_ / "attributes" / semantic, "has another number of components in its draco form");
      return false;
    }
    out.resize(draco_->vertex_count());
    std::memcpy(static_cast<void*>(out.data()), values->data(), values->size() * sizeof(float));
    return true;
  }

  bool read_integers(const std::string& semantic, std::vector<std::uint32_t>& out) {
    const int accessor = primitive_.find(semantic);
    const std::int64_t id = draco_id(semantic);
    if (id < 0) return reader_.read_unsigned(accessor, out);
    Result<std::vector<std::uint32_t>> values = draco_->integers(std::uint32_t(id), reader_[accessor]);
    if (!keep(values)) return false;
    out = std::move(*values);
    return true;
  }

  // Counts what draco returned; false (and a failure) when there was an error.
  template <class T>
  bool keep(const Result<std::vector<T>>& values) {
    const std::string place = place_ / "extensions" / "KHR_draco_mesh_compression";
    if (!values.ok()) {
      diagnostics_.fail(place, values.error());
      return false;
    }
    if (Status s = reader_.budget().reserve(values->size() * sizeof(T), ""); !s.ok()) {
      diagnostics_.fail(place, s.error());
      return false;
    }
    return true;
  }

  bool read_attributes() {
    TriangleMesh& mesh = geometry_.mesh;
    if (!read("POSITION", mesh.positions) || !read("NORMAL", mesh.normals) || !read("TANGENT", mesh.tangents))
      return false;
    for (int k = 0; k < kMaxTexcoordSets; ++k)
      if (!read("TEXCOORD_" + std::to_string(k), mesh.texcoords[std::size_t(k)])) return false;
    return read_colors();
  }

  bool read_colors() {
    const int accessor = primitive_.find("COLOR_0");
    if (accessor < 0) return true;
    std::vector<V4f>& colors = geometry_.mesh.colors;
    if (reader_[accessor].type == ElementType::vec4) return read("COLOR_0", colors);
    std::vector<V3f> rgb;
    if (!read("COLOR_0", rgb)) return false;
    if (Status s = reader_.budget().reserve(rgb.size() * sizeof(float), ""); !s.ok()) {
      diagnostics_.fail(place_, s.error());
      return false;
    }
    colors.reserve(rgb.size());
    for (const V3f& c : rgb) colors.emplace_back(c.x, c.y, c.z, 1.0f);
    return true;
  }

  bool read_triangles() {
    TriangleMesh& mesh = geometry_.mesh;
    std::vector<std::uint32_t> indices;
    if (primitive_.draco) {
      indices = draco_->indices();
      if (!reserve_indices(indices.size())) return false;
    } else if (primitive_.indices >= 0) {
      if (!reader_.read_unsigned(primitive_.indices, indices) || !check_indices(indices)) return false;
    } else {
      if (!reserve_indices(mesh.positions.size())) return false;
      indices.resize(mesh.positions.size());
      std::iota(indices.begin(), indices.end(), 0u);
    }
    // Draco stores triangles, whatever the mode says the original was.
    if (primitive_.topology == Topology::triangles || primitive_.draco) {
      if (indices.size() % 3 != 0) {
        diagnostics_.warn(place_, "the last " + std::to_string(indices.size() % 3) + " indices make no triangle");
        indices.resize(indices.size() / 3 * 3);
      }
      mesh.indices = std::move(indices);
      return true;
    }
    if (!reserve_indices(3 * triangle_count(primitive_.topology, indices.size()))) return false;
    mesh.indices = to_triangle_list(primitive_.topology, indices);
    reader_.budget().release(indices.size() * sizeof(std::uint32_t));
    return true;
  }

  bool reserve_indices(std::uint64_t count) {
    if (Status s = reader_.budget().reserve(count, sizeof(std::uint32_t), ""); s.ok())
      return true;
    else
      diagnostics_.fail(place_, s.error());
    return false;
  }

  bool check_indices(std::span<const std::uint32_t> indices) {
    const std::size_t vertices = geometry_.mesh.positions.size();
    std::uint32_t highest = 0;
    for (const std::uint32_t index : indices) highest = std::max(highest, index);
    const ComponentType type = reader_[primitive_.indices].component;
    const std::uint32_t restart = type == ComponentType::u8 ? 0xff : type == ComponentType::u16 ? 0xffff : 0xffffffff;
    if (highest < vertices && highest != restart) return true;
    const std::size_t at = std::size_t(std::max_element(indices.begin(), indices.end()) - indices.begin());
    const std::string place = place_ / "indices";
    if (highest == restart)
      diagnostics_.fail(place, "index " + std::to_string(at) + " is the primitive restart value " +
                                   std::to_string(highest) + ", which glTF forbids");
    else
      diagnostics_.fail(place, "index " + std::to_string(at) + " is " + std::to_string(highest) +
                                   ", but the primitive has " + std::to_string(vertices) + " vertices");
    return false;
  }

  bool read_binding(std::size_t joint_count) {
    SkinBinding& skin = geometry_.skin;
    const std::size_t vertices = geometry_.mesh.positions.size();
    std::size_t sets = 0;
    while (primitive_.find("JOINTS_" + std::to_string(sets)) >= 0 &&
           primitive_.find("WEIGHTS_" + std::to_string(sets)) >= 0)
      ++sets;
    skin.per_vertex = 4 * sets;
    if (Status s = reader_.budget().reserve(vertices * skin.per_vertex, 8, ""); !s.ok()) {
      diagnostics_.fail(place_, s.error());
      return false;
    }
    skin.joints.resize(vertices * skin.per_vertex);
    skin.weights.resize(vertices * skin.per_vertex);
    for (std::size_t set = 0; set < sets; ++set) {
      std::vector<std::uint32_t> joints;
      std::vector<V4f> weights;
      if (!read_integers("JOINTS_" + std::to_string(set), joints) || !read("WEIGHTS_" + std::to_string(set), weights))
        return false;
      for (std::size_t v = 0; v < vertices; ++v) {
        for (std::size_t c = 0; c < 4; ++c) {
          const float weight = weights[v][int(c)];
          const std::uint32_t joint = joints[4 * v + c];
          if (weight != 0 && joint >= joint_count) {
            diagnostics_.fail(place_ / "attributes" / ("JOINTS_" + std::to_string(set)),
                              "vertex " + std::to_string(v) + " names joint " + std::to_string(joint) + " of " +
                                  std::to_string(joint_count));
            return false;
          }
          skin.joints[v * skin.per_vertex + 4 * set + c] = weight != 0 ? joint : 0;
          skin.weights[v * skin.per_vertex + 4 * set + c] = std::max(weight, 0.0f);
        }
      }
      reader_.budget().release(vertices * (sizeof(V4f) + 4 * sizeof(std::uint32_t)));
    }
    for (std::size_t v = 0; v < vertices; ++v) {
      const std::span<float> weights = std::span(skin.weights).subspan(v * skin.per_vertex, skin.per_vertex);
      const float sum = std::accumulate(weights.begin(), weights.end(), 0.0f);
      if (sum > 0)
        for (float& weight : weights) weight /= sum;
    }
    return true;
  }

  // ---- unit vectors ------------------------------------------------------------------------------------------------

  // `of_file`: vectors are as the file has them, and it is to blame for their lengths.
  void repair_directions(bool of_file) {
    constexpr float kRounding = 0.05f;
    TriangleMesh& mesh = geometry_.mesh;
    std::vector<std::uint32_t> bad;
    std::size_t off = 0;
    for (std::size_t v = 0; v < mesh.normals.size(); ++v) {
      const float squared = length_squared(mesh.normals[v]);
      if (make_unit(mesh.normals[v]))
        off += std::abs(squared - 1) > 2 * kRounding;
      else
        bad.push_back(std::uint32_t(v));
    }
    const std::string place = place_ / "attributes" / "NORMAL";
    if (off != 0 && of_file)
      diagnostics_.tolerate(place, std::to_string(off) + " normals are not of length 1", "made so");
    if (!bad.empty()) {
      const std::string problem = std::to_string(bad.size()) + " normals of length zero";
      const std::string reading = "they are taken from the triangles instead";
      if (of_file && reader_[primitive_.find("NORMAL")].view >= 0)  // else the format makes them zero
        diagnostics_.tolerate(place, problem, reading);
      else
        diagnostics_.warn(place, problem + "; " + reading);
      replace_normals(bad);
    }
    bool tangents_good = true;
    for (V4f& tangent : mesh.tangents) {
      V3f direction(tangent.x, tangent.y, tangent.z);
      tangents_good &= make_unit(direction);
      tangent = V4f(direction.x, direction.y, direction.z, tangent.w < 0 ? -1.0f : 1.0f);
    }
    if (!tangents_good) {
      diagnostics_.warn(place_ / "attributes" / "TANGENT", "has tangents of length zero; all are derived instead");
      mesh.tangents.clear();
    }
  }

  static bool make_unit(V3f& v) {
    const float squared = length_squared(v);
    if (std::abs(squared - 1) <= 1e-6f) return true;  // as exact as the file's floats are
    const double length = std::sqrt(length_squared(V3d(v)));
    if (!(length > 1e-30)) return false;
    v = V3f(V3d(v) / length);
    return true;
  }

  void replace_normals(const std::vector<std::uint32_t>& bad) {
    TriangleMesh& mesh = geometry_.mesh;
    std::vector<bool> is_bad(mesh.positions.size());
    for (const std::uint32_t v : bad) {
      is_bad[v] = true;
      mesh.normals[v] = V3f(0);
    }
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const std::uint32_t* t = &mesh.indices[i];
      const V3f& a = mesh.positions[t[0]];
      const V3f area = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
      for (int c = 0; c < 3; ++c)
        if (is_bad[t[c]]) mesh.normals[t[c]] += area;
    }
    for (const std::uint32_t v : bad)
      if (!make_unit(mesh.normals[v])) mesh.normals[v] = V3f(0, 0, 1);
  }

  const Primitive& primitive_;
  const std::string& place_;
  const BufferStore& buffers_;
  AccessorReader& reader_;
  Diagnostics& diagnostics_;
  std::optional<DracoMesh> draco_;
  PrimitiveGeometry geometry_;
};

}  // namespace

std::optional<PrimitiveGeometry> read_primitive(const Primitive& primitive, const std::string& place,
                                                std::span<const float> weights, std::optional<std::size_t> joint_count,
                                                const BufferStore& buffers, AccessorReader& reader,
                                                Diagnostics& diagnostics) {
  return PrimitiveLoader(primitive, place, buffers, reader, diagnostics).load(weights, joint_count);
}

}  // namespace helio::gltf
