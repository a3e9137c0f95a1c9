// meshes: primitives with their attributes, morph targets, compression and material variants.
#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

namespace {

// ---- which accessors an attribute may name (glTF 2.0, 3.7.2.1; KHR_mesh_quantization) ------------------------------

struct Format {
  ElementType type;
  ComponentType component;
  bool normalized;
};

using Formats = std::vector<Format>;
constexpr ComponentType kF32 = ComponentType::f32, kU8 = ComponentType::u8, kU16 = ComponentType::u16,
                        kI8 = ComponentType::i8, kI16 = ComponentType::i16;

void add(Formats& formats, ElementType type, std::initializer_list<ComponentType> components, bool normalized) {
  for (const ComponentType component : components) formats.push_back({type, component, normalized});
}

// "TEXCOORD_3" without its number; empty when the number is malformed.
std::string stem_of(const std::string& semantic) {
  const std::size_t underscore = semantic.rfind('_');
  if (underscore == std::string::npos || underscore + 1 == semantic.size() || semantic.size() > underscore + 4)
    return {};
  for (std::size_t i = underscore + 1; i < semantic.size(); ++i)
    if (semantic[i] < '0' || semantic[i] > '9') return {};
  return semantic.substr(0, underscore);
}

// Empty: an attribute that we do not know.
Formats allowed_formats(const std::string& semantic, bool target, bool quantized) {
  Formats formats;
  const std::string stem = stem_of(semantic);
  if (semantic == "POSITION") {
    add(formats, ElementType::vec3, {kF32}, false);
    if (quantized && target) add(formats, ElementType::vec3, {kI8, kI16}, false);
    if (quantized && target) add(formats, ElementType::vec3, {kI8, kI16}, true);
    if (quantized && !target) add(formats, ElementType::vec3, {kI8, kU8, kI16, kU16}, false);
    if (quantized && !target) add(formats, ElementType::vec3, {kI8, kU8, kI16, kU16}, true);
  } else if (semantic == "NORMAL") {
    add(formats, ElementType::vec3, {kF32}, false);
    if (quantized) add(formats, ElementType::vec3, {kI8, kI16}, true);
  } else if (semantic == "TANGENT") {
    const ElementType type = target ? ElementType::vec3 : ElementType::vec4;
    add(formats, type, {kF32}, false);
    if (quantized) add(formats, type, {kI8, kI16}, true);
  } else if (stem == "TEXCOORD") {
    add(formats, ElementType::vec2, {kF32}, false);
    add(formats, ElementType::vec2, {kU8, kU16}, true);
    if (target) add(formats, ElementType::vec2, {kI8, kI16}, true);
    if (quantized) add(formats, ElementType::vec2, {kI8, kU8, kI16, kU16}, false);
    if (quantized) add(formats, ElementType::vec2, {kI8, kI16}, true);
  } else if (stem == "COLOR") {
    for (const ElementType type : {ElementType::vec3, ElementType::vec4}) {
      add(formats, type, {kF32}, false);
      add(formats, type, {kU8, kU16}, true);
      if (target) add(formats, type, {kI8, kI16}, true);
    }
  } else if (stem == "JOINTS" && !target) {
    add(formats, ElementType::vec4, {kU8, kU16}, false);
  } else if (stem == "WEIGHTS" && !target) {
    add(formats, ElementType::vec4, {kF32}, false);
    add(formats, ElementType::vec4, {kU8, kU16}, true);
  }
  return formats;
}

std::string describe(const Accessor& accessor) {
  return std::string(name_of(accessor.type)) + " of " + (accessor.normalized ? "normalized " : "") +
         name_of(accessor.component);
}

class PrimitiveReader {
 public:
  PrimitiveReader(const JsonObject& object, const Document& document, std::size_t material_count,
                  std::size_t variant_count)
      : object_(object), document_(document), material_count_(material_count), variant_count_(variant_count) {}

  Primitive read() {
    object_.only({"attributes", "indices", "material", "mode", "targets"});
    document_.extensions.check(object_, Site::primitive);
    primitive_.material = object_.reference("material", material_count_, "materials");
    primitive_.topology = Topology(object_.count("mode", 4, 0, 6));
    if (!object_.require("attributes")) return std::move(primitive_);
    read_draco(object_.extension("KHR_draco_mesh_compression"));
    const JsonObject attributes = object_.object("attributes");
    primitive_.attributes = read_attributes(attributes, false);
    check_counts(attributes);
    check_numbering(attributes);
    read_indices();
    if (object_.has("targets"))
      object_.each("targets", [&](const JsonObject& target, std::size_t) { read_target(target); });
    read_variants(object_.extension("KHR_materials_variants"));
    return std::move(primitive_);
  }

 private:
  std::vector<Attribute> read_attributes(const JsonObject& object, bool target) {
    std::vector<Attribute> result;
    const bool quantized = document_.extensions.used("KHR_mesh_quantization");
    for (const std::string& semantic : object.keys()) {
      const int index = object.reference(semantic.c_str(), document_.accessors.size(), "accessors");
      if (index < 0) continue;
      const Accessor& accessor = document_.accessors[std::size_t(index)];
      const Formats formats = allowed_formats(semantic, target, quantized);
      const std::string place = object.place() / semantic;
      if (formats.empty()) {
        if (!semantic.starts_with('_')) object.diagnostics().unread(place);
        continue;
      }
      bool fits = false;
      for (const Format& f : formats)
        fits |= f.type == accessor.type && f.component == accessor.component && f.normalized == accessor.normalized;
      if (!fits) {
        const Format& f = formats.front();
        object.diagnostics().fail(place, "names an accessor of " + describe(accessor) +
                                             ", allowed: " + name_of(f.type) + " of " + name_of(f.component) +
                                             (formats.size() > 1 ? " and its quantized forms" : ""));
      }
      if (semantic == "POSITION" && (accessor.min.empty() || accessor.max.empty())) {
        // Bounds are ours to compute; without data either, nothing says what the file meant.
        if (accessor.view < 0 && !accessor.sparse && !primitive_.draco)
          object.diagnostics().fail(place, "names an accessor without min, max and data");
        else
          object.diagnostics().tolerate(place, "names an accessor without min and max", "its data says them");
      }
      result.push_back({semantic, index});
    }
    return result;
  }

  void check_counts(const JsonObject& attributes) {
    if (primitive_.attributes.empty()) return;
    const int position = primitive_.find("POSITION");
    const int first = position >= 0 ? position : primitive_.attributes.front().accessor;
    vertex_count_ = document_.accessors[std::size_t(first)].count;
    for (const Attribute& attribute : primitive_.attributes) check_count(attributes, attribute);
  }

  void check_count(const JsonObject& attributes, const Attribute& attribute) {
    const std::uint64_t count = document_.accessors[std::size_t(attribute.accessor)].count;
    if (count != vertex_count_)
      attributes.diagnostics().fail(attributes.place() / attribute.semantic,
                                    "has " + std::to_string(count) + " elements, the primitive has " +
                                        std::to_string(vertex_count_) + " vertices");
  }

  // Sets of joints and of weights come in pairs.
  void check_numbering(const JsonObject& attributes) {
    std::size_t joints = 0, weights = 0;
    for (const Attribute& a : primitive_.attributes) {
      joints += stem_of(a.semantic) == "JOINTS";
      weights += stem_of(a.semantic) == "WEIGHTS";
    }
    if (joints != weights)
      attributes.diagnostics().fail(attributes.place(), "has " + std::to_string(joints) + " JOINTS and " +
                                                            std::to_string(weights) + " WEIGHTS attributes");
  }

  void read_indices() {
    primitive_.indices = object_.reference("indices", document_.accessors.size(), "accessors");
    if (primitive_.indices < 0) return;
    const Accessor& accessor = document_.accessors[std::size_t(primitive_.indices)];
    Diagnostics& diagnostics = object_.diagnostics();
    const std::string place = object_.place() / "indices";
    if (accessor.type != ElementType::scalar || accessor.normalized ||
        (accessor.component != kU8 && accessor.component != kU16 && accessor.component != ComponentType::u32))
      diagnostics.fail(place, "names an accessor of " + describe(accessor) +
                                  ", allowed: SCALAR of UNSIGNED_BYTE, UNSIGNED_SHORT or UNSIGNED_INT");
    check_no_stride(document_, accessor, place, "indices", diagnostics);
  }

  void read_target(const JsonObject& object) {
    std::vector<Attribute> target = read_attributes(object, true);
    for (const Attribute& attribute : target) {
      if (primitive_.find(attribute.semantic) < 0)
        object.diagnostics().fail(object.place() / attribute.semantic,
                                  "morphs an attribute the primitive does not have");
      else
        check_count(object, attribute);
    }
    primitive_.targets.push_back(std::move(target));
  }

  void read_draco(const JsonObject& object) {
    if (!object.exists()) return;
    object.only({"bufferView", "attributes"});
    if (!object.require({"bufferView", "attributes"})) return;
    DracoPrimitive draco;
    draco.view = object.reference("bufferView", document_.views.size(), "bufferViews");
    const JsonObject attributes = object.object("attributes");
    for (const std::string& semantic : attributes.keys()) {
      const std::uint64_t id = attributes.count(semantic.c_str(), 0, 0, UINT32_MAX);
      draco.attributes.emplace_back(semantic, std::uint32_t(id));
      if (!object_.object("attributes").has(semantic.c_str()))
        object.diagnostics().fail(attributes.place() / semantic, "compresses an attribute the primitive does not have");
    }
    if (primitive_.topology != Topology::triangles && primitive_.topology != Topology::triangle_strip)
      object.diagnostics().fail(object.place(), "compresses a primitive that is neither triangles nor a strip");
    if (draco.view >= 0) primitive_.draco = std::move(draco);
  }

  // The default variant is the primitive's own material: mappings are checked and left alone.
  void read_variants(const JsonObject& object) {
    if (!object.exists() || !object.require("mappings")) return;
    object.only({"mappings"});
    object.each("mappings", [&](const JsonObject& mapping, std::size_t) {
      mapping.only({"material", "variants"});
      if (variant_count_ == 0)
        mapping.diagnostics().fail(mapping.place(), "needs the extension's list of variants at the root");
      if (!mapping.require({"material", "variants"})) return;
      mapping.reference("material", material_count_, "materials");
      mapping.references("variants", variant_count_, "variants");
    });
  }

  JsonObject object_;
  const Document& document_;
  std::size_t material_count_, variant_count_;
  Primitive primitive_;
  std::uint64_t vertex_count_ = 0;
};

}  // namespace

int Primitive::find(std::string_view semantic) const {
  for (const Attribute& attribute : attributes)
    if (attribute.semantic == semantic) return attribute.accessor;
  return -1;
}

void read_meshes(const JsonObject& root, Document& document) {
  const JsonObject variants = root.extension("KHR_materials_variants");
  variants.only({"variants"});
  variants.each("variants", [](const JsonObject& variant, std::size_t) {
    variant.only({});
    if (variant.require("name")) variant.string("name");
  });
  const std::size_t variant_count = variants.array_size("variants");

  root.each("meshes", [&](const JsonObject& object, std::size_t) {
    object.only({"primitives", "weights"});
    document.extensions.check(object, Site::elsewhere);
    Mesh mesh;
    mesh.name = object.string("name");
    object.require("primitives");
    object.each("primitives", [&](const JsonObject& primitive, std::size_t) {
      mesh.primitives.push_back(PrimitiveReader(primitive, document, document.materials.size(), variant_count).read());
    });
    for (std::size_t i = 1; i < mesh.primitives.size(); ++i) {
      if (mesh.primitives[i].targets.size() != mesh.target_count())
        object.diagnostics().fail(object.place() / "primitives" / i / "targets",
                                  "has " + std::to_string(mesh.primitives[i].targets.size()) +
                                      " morph targets, the first primitive has " + std::to_string(mesh.target_count()));
    }
    for (const double weight : object.numbers("weights", 1, SIZE_MAX)) mesh.weights.push_back(float(weight));
    if (!mesh.weights.empty() && mesh.weights.size() != mesh.target_count())
      object.diagnostics().fail(object.place() / "weights", "has " + std::to_string(mesh.weights.size()) +
                                                                " elements, the mesh has " +
                                                                std::to_string(mesh.target_count()) + " morph targets");
    mesh.weights.resize(mesh.target_count());
    document.meshes.push_back(std::move(mesh));
  });
}

}  // namespace helio::gltf
