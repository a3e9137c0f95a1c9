// buffers, bufferViews (with EXT_meshopt_compression) and accessors.
#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

namespace {

constexpr std::uint64_t kMinStride = 4, kMaxStride = 252;
constexpr const char* kInPlace = "read from there";

// Fails when [offset, offset + length) leaves an object of `size` bytes.
void check_extent(const JsonObject& object, std::uint64_t offset, std::uint64_t length, std::uint64_t size,
                  const char* what) {
  if (offset > size || length > size - offset)
    object.diagnostics().fail(object.place(), "covers bytes " + std::to_string(offset) + " to " +
                                                  std::to_string(offset + length) + " of a " + what + " of " +
                                                  std::to_string(size));
}

std::optional<MeshoptView> read_meshopt(const JsonObject& object, const Document& document, const BufferView& view) {
  object.only({"buffer", "byteOffset", "byteLength", "byteStride", "count", "mode", "filter"});
  if (!object.require({"buffer", "byteLength", "byteStride", "count", "mode"})) return std::nullopt;
  MeshoptView result;
  Diagnostics& diagnostics = object.diagnostics();
  result.buffer = object.reference("buffer", document.buffers.size(), "buffers");
  result.byte_offset = object.count("byteOffset", 0);
  result.byte_length = object.count("byteLength", 1, 1);
  result.count = object.count("count", 1, 1, UINT32_MAX);
  result.byte_stride = object.count("byteStride", 4, 1, 256);

  const std::string mode = object.string("mode");
  if (mode == "ATTRIBUTES")
    result.mode = MeshoptMode::attributes;
  else if (mode == "TRIANGLES")
    result.mode = MeshoptMode::triangles;
  else if (mode == "INDICES")
    result.mode = MeshoptMode::indices;
  else
    diagnostics.fail(object.place() / "mode", "is \"" + mode + "\", allowed: ATTRIBUTES, TRIANGLES, INDICES");

  const std::string filter = object.string("filter", "NONE");
  if (filter == "NONE")
    result.filter = MeshoptFilter::none;
  else if (filter == "OCTAHEDRAL")
    result.filter = MeshoptFilter::octahedral;
  else if (filter == "QUATERNION")
    result.filter = MeshoptFilter::quaternion;
  else if (filter == "EXPONENTIAL")
    result.filter = MeshoptFilter::exponential;
  else
    diagnostics.fail(object.place() / "filter",
                     "is \"" + filter + "\", allowed: NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL");

  // Table "Compressed data" of the extension: what each mode and filter may be used with.
  const std::uint64_t stride = result.byte_stride;
  if (result.mode == MeshoptMode::attributes) {
    if (stride % 4 != 0)
      diagnostics.fail(object.place() / "byteStride", "is " + std::to_string(stride) + ", allowed: multiples of 4");
  } else {
    if (stride != 2 && stride != 4)
      diagnostics.fail(object.place() / "byteStride", "is " + std::to_string(stride) + ", allowed: 2 or 4");
    if (result.filter != MeshoptFilter::none) diagnostics.fail(object.place() / "filter", "must be NONE for indices");
    if (result.mode == MeshoptMode::triangles && result.count % 3 != 0)
      diagnostics.fail(object.place() / "count", "is " + std::to_string(result.count) + ", allowed: multiples of 3");
  }
  if ((result.filter == MeshoptFilter::octahedral && stride != 4 && stride != 8) ||
      (result.filter == MeshoptFilter::quaternion && stride != 8))
    diagnostics.fail(object.place() / "byteStride",
                     "is " + std::to_string(stride) + ", which the filter " + filter + " cannot decode");
  if (result.count > UINT64_MAX / stride || result.count * stride != view.byte_length)
    diagnostics.fail(object.place() / "count",
                     "times byteStride is not the view's byteLength " + std::to_string(view.byte_length));
  if (result.buffer < 0) return std::nullopt;
  check_extent(object, result.byte_offset, result.byte_length, document.buffers[result.buffer].byte_length, "buffer");
  return result;
}

ComponentType read_component(const JsonObject& object, const char* key, bool indices_only) {
  const std::uint64_t value = object.count(key, 5126);
  switch (value) {
    case 5121:
    case 5123:
    case 5125:
      return ComponentType(value);
    case 5120:
    case 5122:
    case 5126:
      if (!indices_only) return ComponentType(value);
      break;
    default:
      break;
  }
  object.diagnostics().fail(object.place() / key,
                            "is " + std::to_string(value) + ", allowed: " +
                                (indices_only ? "5121, 5123, 5125" : "5120, 5121, 5122, 5123, 5125, 5126"));
  return indices_only ? ComponentType::u32 : ComponentType::f32;
}

ElementType read_element(const JsonObject& object) {
  const std::string name = object.string("type");
  for (const ElementType type : {ElementType::scalar, ElementType::vec2, ElementType::vec3, ElementType::vec4,
                                 ElementType::mat2, ElementType::mat3, ElementType::mat4}) {
    if (name == name_of(type)) return type;
  }
  object.diagnostics().fail(object.place() / "type",
                            "is \"" + name + "\", allowed: SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3, MAT4");
  return ElementType::scalar;
}

// `count` elements of `size` bytes, `stride` apart, `offset` bytes into a view. Alignment as in glTF 2.0, 3.6.2.4.
void check_layout(const JsonObject& object, const BufferView& view, std::uint64_t offset, std::uint64_t count,
                  std::uint64_t size, std::uint64_t stride, std::uint64_t alignment) {
  Diagnostics& diagnostics = object.diagnostics();
  // Alignment is for readers that map bytes as they are; the numbers are where the file says.
  if (offset % alignment != 0)
    diagnostics.tolerate(object.place() / "byteOffset",
                         "is " + std::to_string(offset) + ", not a multiple of " + std::to_string(alignment), kInPlace);
  else if ((view.byte_offset + offset) % alignment != 0)
    diagnostics.tolerate(object.place(),
                         "starts at byte " + std::to_string(view.byte_offset + offset) +
                             " of the buffer, not a multiple of " + std::to_string(alignment),
                         kInPlace);
  if (stride % alignment != 0)
    diagnostics.tolerate(object.place(), "byteStride " + std::to_string(stride) +
                                             " of its view is not a multiple of " + std::to_string(alignment),
                         kInPlace);
  if (stride < size)
    diagnostics.fail(object.place(),
                     "elements of " + std::to_string(size) + " bytes overlap at byteStride " + std::to_string(stride));
  // count and stride are below 2^53 and 2^8: no overflow.
  const std::uint64_t length = count == 0 ? 0 : stride * (count - 1) + size;
  if (offset > view.byte_length || length > view.byte_length - offset)
    diagnostics.fail(object.place(), std::to_string(count) + " elements need " + std::to_string(length) +
                                         " bytes from byte " + std::to_string(offset) + " of a view of " +
                                         std::to_string(view.byte_length));
}

void read_sparse(const JsonObject& object, const Document& document, Accessor& accessor) {
  object.only({"count", "indices", "values"});
  if (!object.require({"count", "indices", "values"})) return;
  SparsePatch sparse;
  Diagnostics& diagnostics = object.diagnostics();
  sparse.count = object.count("count", 1, 1);
  if (sparse.count > accessor.count)
    diagnostics.fail(object.place() / "count",
                     "replaces " + std::to_string(sparse.count) + " elements of " + std::to_string(accessor.count));
  const JsonObject indices = object.object("indices"), values = object.object("values");
  indices.only({"bufferView", "byteOffset", "componentType"});
  values.only({"bufferView", "byteOffset"});
  const bool indices_complete = indices.require({"bufferView", "componentType"});
  if (!values.require("bufferView") || !indices_complete) return;
  sparse.index_view = indices.reference("bufferView", document.views.size(), "bufferViews");
  sparse.value_view = values.reference("bufferView", document.views.size(), "bufferViews");
  sparse.index_offset = indices.count("byteOffset", 0);
  sparse.value_offset = values.count("byteOffset", 0);
  sparse.index_type = read_component(indices, "componentType", true);
  if (sparse.index_view < 0 || sparse.value_view < 0) return;

  const auto check_view = [&](const JsonObject& part, int index, std::uint64_t offset, std::uint64_t size,
                              std::uint64_t alignment) {
    const BufferView& view = document.views[index];
    if (view.byte_stride != 0)
      diagnostics.fail(part.place() / "bufferView", "names a view with byteStride, which sparse data cannot have");
    check_layout(part, view, offset, sparse.count, size, size, alignment);
  };
  check_view(indices, sparse.index_view, sparse.index_offset, component_size(sparse.index_type),
             component_size(sparse.index_type));
  check_view(values, sparse.value_view, sparse.value_offset, accessor.element_size(),
             component_size(accessor.component));
  accessor.sparse = sparse;
}

Accessor read_accessor(const JsonObject& object, const Document& document) {
  Accessor accessor;
  object.only({"bufferView", "byteOffset", "componentType", "normalized", "count", "type", "max", "min", "sparse"});
  document.extensions.check(object, Site::elsewhere);
  if (!object.require({"componentType", "count", "type"})) return accessor;
  Diagnostics& diagnostics = object.diagnostics();
  accessor.view = object.reference("bufferView", document.views.size(), "bufferViews");
  accessor.byte_offset = object.count("byteOffset", 0);
  accessor.component = read_component(object, "componentType", false);
  accessor.type = read_element(object);
  accessor.count = object.count("count", 1, 1, UINT32_MAX);
  accessor.normalized = object.boolean("normalized", false);
  if (accessor.normalized && accessor.component == ComponentType::f32) {
    diagnostics.tolerate(object.place() / "normalized", "is true, allowed: false for FLOAT", "read as false");
    accessor.normalized = false;
  } else if (accessor.normalized && accessor.component == ComponentType::u32) {
    diagnostics.fail(object.place() / "normalized", "must be false for UNSIGNED_INT");
  }
  const std::size_t components = std::size_t(component_count(accessor.type));
  accessor.min = object.numbers("min", components, components);
  accessor.max = object.numbers("max", components, components);

  if (accessor.view >= 0) {
    const BufferView& view = document.views[accessor.view];
    const bool matrix = accessor.type >= ElementType::mat2;
    const std::uint64_t size = accessor.element_size();
    if (matrix && accessor.byte_offset % 4 != 0)
      diagnostics.tolerate(object.place() / "byteOffset",
                           "is " + std::to_string(accessor.byte_offset) +
                               ", not a multiple of 4, as matrices must start at",
                           kInPlace);
    // Neither the last element's padding nor that of a matrix's last column need be there.
    const std::uint64_t rows = accessor.type == ElementType::mat2 ? 2 : accessor.type == ElementType::mat3 ? 3 : 4;
    const std::uint64_t padding = matrix ? (4 - rows * component_size(accessor.component) % 4) % 4 : 0;
    check_layout(object, view, accessor.byte_offset, accessor.count, size - padding,
                 view.byte_stride != 0 ? view.byte_stride : size, component_size(accessor.component));
  } else if (object.has("byteOffset") && !object.has("bufferView")) {
    diagnostics.fail(object.place() / "byteOffset", "needs a bufferView");
  }
  if (object.has("sparse")) read_sparse(object.object("sparse"), document, accessor);
  return accessor;
}

}  // namespace

std::uint64_t component_size(ComponentType type) {
  switch (type) {
    case ComponentType::i8:
    case ComponentType::u8:
      return 1;
    case ComponentType::i16:
    case ComponentType::u16:
      return 2;
    default:
      return 4;
  }
}

int component_count(ElementType type) {
  constexpr int kCounts[] = {1, 2, 3, 4, 4, 9, 16};
  return kCounts[int(type)];
}

const char* name_of(ComponentType type) {
  switch (type) {
    case ComponentType::i8:
      return "BYTE";
    case ComponentType::u8:
      return "UNSIGNED_BYTE";
    case ComponentType::i16:
      return "SHORT";
    case ComponentType::u16:
      return "UNSIGNED_SHORT";
    case ComponentType::u32:
      return "UNSIGNED_INT";
    default:
      return "FLOAT";
  }
}

const char* name_of(ElementType type) {
  constexpr const char* kNames[] = {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
  return kNames[int(type)];
}

std::uint64_t Accessor::element_size() const {
  const std::uint64_t component_bytes = component_size(component);
  const auto column = [&](std::uint64_t rows) { return (rows * component_bytes + 3) / 4 * 4; };
  switch (type) {
    case ElementType::mat2:
      return 2 * column(2);
    case ElementType::mat3:
      return 3 * column(3);
    case ElementType::mat4:
      return 4 * column(4);
    default:
      return std::uint64_t(component_count(type)) * component_bytes;
  }
}

void check_no_stride(const Document& document, const Accessor& accessor, const std::string& place, const char* what,
                     Diagnostics& diagnostics) {
  if (accessor.view < 0) return;
  const BufferView& view = document.views[std::size_t(accessor.view)];
  if (view.byte_stride == 0 || view.meshopt) return;
  const std::string problem = std::string("names an accessor whose view has byteStride, which ") + what + " cannot have";
  if (view.byte_stride == accessor.element_size())
    diagnostics.tolerate(place, problem, "they are packed all the same");
  else
    diagnostics.fail(place, problem);
}

void read_buffers(const JsonObject& root, Document& document) {
  root.each("buffers", [&](const JsonObject& object, std::size_t) {
    object.only({"uri", "byteLength"});
    document.extensions.check(object, Site::buffer);
    Buffer buffer;
    object.require("byteLength");
    buffer.byte_length = object.count("byteLength", 1);
    if (buffer.byte_length == 0)
      object.diagnostics().tolerate(object.place() / "byteLength", "is 0, allowed: at least 1", "it holds nothing");
    if (object.has("uri")) buffer.uri = object.string("uri");
    const JsonObject meshopt = object.extension("EXT_meshopt_compression");
    meshopt.only({"fallback"});
    buffer.is_fallback = meshopt.boolean("fallback", false);
    document.buffers.push_back(std::move(buffer));
  });
  root.each("bufferViews", [&](const JsonObject& object, std::size_t) {
    object.only({"buffer", "byteOffset", "byteLength", "byteStride", "target"});
    document.extensions.check(object, Site::buffer_view);
    BufferView view;
    if (object.require({"buffer", "byteLength"})) {
      view.buffer = object.reference("buffer", document.buffers.size(), "buffers");
      view.byte_offset = object.count("byteOffset", 0);
      view.byte_length = object.count("byteLength", 1);
      if (view.byte_length == 0)
        object.diagnostics().tolerate(object.place() / "byteLength", "is 0, allowed: at least 1", "it holds nothing");
      view.byte_stride = object.count("byteStride", 0, 0, kMaxStride);
      if (object.has("byteStride") && view.byte_stride == 0)
        object.diagnostics().tolerate(object.place() / "byteStride", "is 0, allowed: 4 to 252", "read as absent");
      else if (object.has("byteStride") && view.byte_stride < kMinStride)
        object.diagnostics().fail(object.place() / "byteStride",
                                  "is " + std::to_string(view.byte_stride) + ", allowed: 4 to 252");
      view.target = int(object.count("target", 0, 0, INT32_MAX));
      if (object.has("target") && view.target != 34962 && view.target != 34963) {
        object.diagnostics().tolerate(object.place() / "target",
                                      "is " + std::to_string(view.target) + ", allowed: 34962 or 34963",
                                      "the accessors decide");
        view.target = 0;
      }
      if (view.byte_stride % 4 != 0)
        object.diagnostics().tolerate(object.place() / "byteStride",
                                      "is " + std::to_string(view.byte_stride) + ", allowed: multiples of 4", kInPlace);
      if (view.buffer >= 0)
        check_extent(object, view.byte_offset, view.byte_length, document.buffers[view.buffer].byte_length, "buffer");
      const JsonObject meshopt = object.extension("EXT_meshopt_compression");
      if (meshopt.exists()) view.meshopt = read_meshopt(meshopt, document, view);
    }
    document.views.push_back(view);
  });
}

void read_accessors(const JsonObject& root, Document& document) {
  root.each("accessors", [&](const JsonObject& object, std::size_t) {
    document.accessors.push_back(read_accessor(object, document));
  });
}

}  // namespace helio::gltf
