#include "renderer/scene/gltf/draco.h"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>

#include <limits>
#include <new>

namespace helio::gltf {

namespace {

Error broken(const std::string& why) {
  return {ErrorCode::invalid_argument, "the draco-compressed data is broken: " + why, {}};
}

// Reads the counts that the decoder will allocate by (Draco bitstream specification 2.2, sections 2, 3.2 and 4.1).
class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::uint64_t u8() {
    if (at_ >= bytes_.size()) {
      failed_ = true;
      return 0;
    }
    return bytes_[at_++];
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      const std::uint64_t byte = u8();
      value |= (byte & 0x7f) << shift;
      if (!(byte & 0x80)) return value;
    }
    failed_ = true;
    return value;
  }
  void skip(std::size_t count) { at_ += count; }
  bool failed() const { return failed_ || at_ > bytes_.size(); }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

struct Counts {
  std::uint64_t faces = 0, points = 0;
};

Result<Counts> read_counts(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kMagic = "DRACO";
  if (bytes.size() < 11 || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
    return broken("its header is missing");
  HeaderReader reader(bytes);
  reader.skip(5);
  const std::uint64_t major = reader.u8(), minor = reader.u8(), geometry = reader.u8(), method = reader.u8();
  reader.skip(2);  // flags
  if (major != 2 || minor < 2)
    return broken("bitstream version " + std::to_string(major) + "." + std::to_string(minor) + ", supported: 2.2");
  if (geometry != 1) return broken("it is not a triangle mesh");
  Counts counts;
  if (method == 0) {  // sequential: num_faces, num_points
    counts.faces = reader.varint();
    counts.points = reader.varint();
  } else if (method == 1) {  // edgebreaker: traversal type, num_encoded_vertices, num_faces
    reader.u8();
    counts.points = reader.varint();
    counts.faces = reader.varint();
    // A point is a corner's vertex with one set of attributes: seams split vertices, but never beyond the corners.
    counts.points = std::max(counts.points, std::min(3 * counts.faces, 4 * counts.points + 64));
  } else {
    return broken("encoding method " + std::to_string(method) + ", allowed: 0 or 1");
  }
  if (reader.failed()) return broken("its header ends early");
  return counts;
}

// What the decoder holds per face (corner table, traversal, connectivity) and per point (maps, portable and final
// values of a usual set of attributes), measured generously.
constexpr std::uint64_t kBytesPerFace = 128, kBytesPerPoint = 128;

}  // namespace

struct DracoMesh::State {
  std::unique_ptr<draco::Mesh> mesh;
};

DracoMesh::DracoMesh(std::unique_ptr<State> state) : state_(std::move(state)) {}
DracoMesh::DracoMesh(DracoMesh&&) noexcept = default;
DracoMesh& DracoMesh::operator=(DracoMesh&&) noexcept = default;
DracoMesh::~DracoMesh() = default;

Result<DracoMesh> DracoMesh::decode(std::span<const std::uint8_t> compressed, MemoryBudget& budget) {
  const Result<Counts> counts = read_counts(compressed);
  if (!counts.ok()) return counts.error();
  // varint keeps counts below 2^35: no overflow.
  const std::uint64_t need = counts->faces * kBytesPerFace + counts->points * kBytesPerPoint;
  if (Status s = budget.reserve(need, ""); !s.ok()) return s.error();

  auto state = std::make_unique<State>();
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(compressed.data()), compressed.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return broken(decoded.status().error_msg_string());
    state->mesh = std::move(decoded).value();
  } catch (const std::bad_alloc&) {
    return broken("it asks for more memory than there is");
  } catch (const std::length_error&) {
    return broken("it asks for more memory than there is");
  }
  budget.release(need);
  if (!state->mesh) return broken("nothing was decoded");
  const std::uint32_t points = state->mesh->num_points();
  for (draco::FaceIndex f(0); f < state->mesh->num_faces(); ++f) {
    for (int corner = 0; corner < 3; ++corner)
      if (state->mesh->face(f)[std::size_t(corner)].value() >= points) return broken("a face names a missing vertex");
  }
  return DracoMesh(std::move(state));
}

std::uint64_t DracoMesh::vertex_count() const {
  return state_->mesh->num_points();
}

std::vector<std::uint32_t> DracoMesh::indices() const {
  std::vector<std::uint32_t> indices;
  indices.reserve(std::size_t(state_->mesh->num_faces()) * 3);
  for (draco::FaceIndex f(0); f < state_->mesh->num_faces(); ++f) {
    for (int corner = 0; corner < 3; ++corner) indices.push_back(state_->mesh->face(f)[std::size_t(corner)].value());
  }
  return indices;
}

namespace {

Result<const draco::PointAttribute*> find_attribute(const draco::Mesh& mesh, std::uint32_t unique_id,
                                                    const Accessor& accessor) {
  const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(unique_id);
  if (!attribute) return broken("it has no attribute with id " + std::to_string(unique_id));
  if (int(attribute->num_components()) != component_count(accessor.type))
    return broken("attribute " + std::to_string(unique_id) + " has " + std::to_string(attribute->num_components()) +
                  " components, the accessor has " + std::to_string(component_count(accessor.type)));
  return attribute;
}

// One value per point; `out` has num_points * components entries. False when the map leaves the attribute.
template <class T>
bool convert_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute, std::size_t components, T* out) {
  for (draco::PointIndex p(0); p < mesh.num_points(); ++p) {
    const draco::AttributeValueIndex value = attribute.mapped_index(p);
    if (value.value() >= attribute.size()) return false;
    if (!attribute.ConvertValue<T>(value, std::int8_t(components), out + p.value() * components)) return false;
  }
  return true;
}

}  // namespace

Result<std::vector<float>> DracoMesh::floats(std::uint32_t unique_id, const Accessor& accessor) const {
  const draco::Mesh& mesh = *state_->mesh;
  const auto attribute = find_attribute(mesh, unique_id, accessor);
  if (!attribute.ok()) return attribute.error();
  const std::size_t components = std::size_t(component_count(accessor.type));
  std::vector<float> values(std::size_t(mesh.num_points()) * components);
  if (!convert_values(mesh, **attribute, components, values.data())) return broken("an attribute cannot be read");
  // draco divides by the maximum itself when its own flag says so.
  if (accessor.normalized && !(*attribute)->normalized() && (*attribute)->data_type() != draco::DT_FLOAT32) {
    float scale = 1;
    switch (accessor.component) {
      case ComponentType::i8:
        scale = 1 / 127.0f;
        break;
      case ComponentType::u8:
        scale = 1 / 255.0f;
        break;
      case ComponentType::i16:
        scale = 1 / 32767.0f;
        break;
      case ComponentType::u16:
        scale = 1 / 65535.0f;
        break;
      default:
        break;
    }
    for (float& value : values) value = std::max(value * scale, -1.0f);
  }
  for (const float value : values)
    if (!std::isfinite(value))
      return broken("attribute " + std::to_string(unique_id) + " has a value that is not finite");
  return values;
}

Result<std::vector<std::uint32_t>> DracoMesh::integers(std::uint32_t unique_id, const Accessor& accessor) const {
  const draco::Mesh& mesh = *state_->mesh;
  const auto attribute = find_attribute(mesh, unique_id, accessor);
  if (!attribute.ok()) return attribute.error();
  const std::size_t components = std::size_t(component_count(accessor.type));
  std::vector<std::uint32_t> values(std::size_t(mesh.num_points()) * components);
  if (!convert_values(mesh, **attribute, components, values.data())) return broken("an attribute cannot be read");
  return values;
}

}  // namespace helio::gltf
