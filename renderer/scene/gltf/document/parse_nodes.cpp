// nodes (with lights, EXT_mesh_gpu_instancing and spheres), skins and scenes.
#include <algorithm>

#include "renderer/scene/gltf/document/document.h"
#include "renderer/scene/gltf/document/extras.h"

namespace helio::gltf {

namespace {

// How far from unit length a rotation may be before it is a slip, and before it counts as something else.
constexpr double kUnitRounding = 0.0077, kQuaternionTolerance = 0.05;
// How far numbers of transforms may be off by rounding, relative to the largest.
constexpr double kTransformRounding = 1e-4;

void read_trs(const JsonObject& object, Trs& trs) {
  if (const std::vector<double> t = object.numbers("translation", 3, 3); !t.empty())
    trs.translation = V3d(t[0], t[1], t[2]);
  if (const std::vector<double> s = object.numbers("scale", 3, 3); !s.empty()) trs.scale = V3d(s[0], s[1], s[2]);
  if (const std::vector<double> q = object.numbers("rotation", 4, 4); !q.empty()) {
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const std::string problem = "has length " + std::to_string(length) + ", expected 1";
    if (!(std::abs(length - 1) <= kQuaternionTolerance)) {
      object.diagnostics().fail(object.place() / "rotation", problem);
      return;
    }
    if (std::abs(length - 1) > kUnitRounding)
      object.diagnostics().tolerate(object.place() / "rotation", problem, "made so");
    for (std::size_t i = 0; i < 4; ++i) trs.rotation[i] = q[i] / length;
  }
}

double largest_number(const M44d& m) {
  double largest = 0;
  for (int i = 0; i < 16; ++i) largest = std::max(largest, std::abs(m[i / 4][i % 4]));
  return largest;
}

bool say_the_same(const M44d& a, const M44d& b) {
  return a.equalWithAbsError(b, kTransformRounding * std::max(largest_number(a), largest_number(b)));
}

// The last row for column vectors is the last column here.
void check_last_row(const JsonObject& object, M44d& matrix) {
  const double wanted[4] = {0, 0, 0, 1};
  double off = 0;
  for (int i = 0; i < 4; ++i) off = std::max(off, std::abs(matrix[i][3] - wanted[i]));
  if (off == 0) return;
  const std::string problem = "is not an affine transform: its last row is not 0 0 0 1";
  if (off <= kTransformRounding)
    object.diagnostics().tolerate(object.place() / "matrix", problem, "read as 0 0 0 1");
  else
    object.diagnostics().fail(object.place() / "matrix", problem);
  for (int i = 0; i < 4; ++i) matrix[i][3] = wanted[i];
}

void read_transform(const JsonObject& object, Node& node) {
  Diagnostics& diagnostics = object.diagnostics();
  if (object.has("matrix")) {
    const std::vector<double> m = object.numbers("matrix", 16, 16);
    // Column-major for column vectors is row-major for row vectors.
    M44d matrix;
    for (std::size_t i = 0; i < m.size(); ++i) matrix[int(i) / 4][int(i) % 4] = m[i];
    check_last_row(object, matrix);
    if (object.has("translation") || object.has("rotation") || object.has("scale")) {
      read_trs(object, node.trs);
      const std::string problem = "stands beside translation, rotation or scale";
      if (!m.empty() && say_the_same(matrix, to_matrix(node.trs))) {
        diagnostics.tolerate(object.place() / "matrix", problem, "both say the same");
        return;  // the parts can be animated
      }
      diagnostics.fail(object.place() / "matrix", problem + ", which say another transform");
    }
    if (!m.empty()) node.matrix = matrix;
    return;
  }
  read_trs(object, node.trs);
}

void read_instancing(const JsonObject& object, const Document& document, Node& node) {
  if (!object.exists() || !object.require("attributes")) return;
  object.only({"attributes"});
  Diagnostics& diagnostics = object.diagnostics();
  const JsonObject attributes = object.object("attributes");
  GpuInstancing result;
  bool first = true;
  for (const std::string& semantic : attributes.keys()) {
    const int index = attributes.reference(semantic.c_str(), document.accessors.size(), "accessors");
    if (index < 0) continue;
    const Accessor& accessor = document.accessors[std::size_t(index)];
    const std::string place = attributes.place() / semantic;
    if (first) result.count = accessor.count;
    first = false;
    if (accessor.count != result.count)
      diagnostics.fail(place, "has " + std::to_string(accessor.count) + " elements, other attributes have " +
                                  std::to_string(result.count));
    const bool is_float = accessor.component == ComponentType::f32;
    const bool is_short_rotation =
        accessor.normalized && (accessor.component == ComponentType::i8 || accessor.component == ComponentType::i16);
    bool fits = true;
    if (semantic == "TRANSLATION") {
      result.translation = index;
      fits = accessor.type == ElementType::vec3 && is_float;
    } else if (semantic == "SCALE") {
      result.scale = index;
      fits = accessor.type == ElementType::vec3 && is_float;
    } else if (semantic == "ROTATION") {
      result.rotation = index;
      fits = accessor.type == ElementType::vec4 && (is_float || is_short_rotation);
    } else if (!semantic.starts_with('_')) {
      diagnostics.unread(place);
    }
    if (!fits)
      diagnostics.fail(place, semantic == "ROTATION"
                                  ? "must name an accessor of VEC4 of FLOAT or normalized BYTE or SHORT"
                                  : "must name an accessor of VEC3 of FLOAT");
  }
  if (first) diagnostics.fail(attributes.place(), "is empty: nothing says how many instances there are");
  node.instancing = result;
}

void check_tree(const JsonObject& root, Document& document) {
  Diagnostics& diagnostics = root.diagnostics();
  std::vector<Node>& nodes = document.nodes;
  const std::string place = root.place() / "nodes";
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (std::size_t k = 0; k < nodes[i].children.size(); ++k) {
      Node& child = nodes[std::size_t(nodes[i].children[k])];
      if (child.parent >= 0)
        diagnostics.fail(place / i / "children" / k, "names node " + std::to_string(nodes[i].children[k]) +
                                                         ", which is already a child of node " +
                                                         std::to_string(child.parent));
      else
        child.parent = int(i);
    }
  }
  // With one parent each, a node is in a loop exactly when its ancestors do not end. Each node is walked once.
  std::vector<std::uint8_t> state(nodes.size());  // 0: unseen, 1: on the current walk, 2: known to end
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::vector<std::size_t> walk;
    std::size_t at = i;
    while (state[at] == 0) {
      state[at] = 1;
      walk.push_back(at);
      if (nodes[at].parent < 0) break;
      at = std::size_t(nodes[at].parent);
    }
    if (state[at] == 1 && nodes[at].parent >= 0) diagnostics.fail(place / at, "is its own ancestor");
    for (const std::size_t walked : walk) state[walked] = 2;
  }
}

}  // namespace

void read_nodes(const JsonObject& root, Document& document) {
  const std::size_t node_count = root.array_size("nodes"), skin_count = root.array_size("skins");
  root.each("nodes", [&](const JsonObject& object, std::size_t) {
    Diagnostics& diagnostics = object.diagnostics();
    object.only({"camera", "children", "skin", "matrix", "mesh", "rotation", "scale", "translation", "weights"});
    document.extensions.check(object, Site::node);
    Node node;
    node.name = object.string("name");
    node.children = object.references("children", node_count, "nodes");
    node.mesh = object.reference("mesh", document.meshes.size(), "meshes");
    node.skin = object.reference("skin", skin_count, "skins");
    node.camera = object.reference("camera", document.cameras.size(), "cameras");
    read_transform(object, node);

    if (object.has("skin") && !object.has("mesh"))
      diagnostics.tolerate(object.place() / "skin", "needs a mesh beside it", "it moves nothing");
    for (const double w : object.numbers("weights", 1, SIZE_MAX)) node.weights.push_back(float(w));
    if (object.has("weights") && node.mesh < 0)
      diagnostics.tolerate(object.place() / "weights", "needs a mesh beside it", "they morph nothing");
    if (!node.weights.empty() && node.mesh >= 0) {
      const std::size_t targets = document.meshes[std::size_t(node.mesh)].target_count();
      if (node.weights.size() != targets)
        diagnostics.fail(object.place() / "weights", "has " + std::to_string(node.weights.size()) +
                                                         " elements, the mesh has " + std::to_string(targets) +
                                                         " morph targets");
    }
    if (const JsonObject light = object.extension("KHR_lights_punctual"); light.exists()) {
      light.only({"light"});
      if (light.require("light"))
        node.light = light.reference("light", document.lights.size(), "lights in the extension at the root");
    }
    read_instancing(object.extension("EXT_mesh_gpu_instancing"), document, node);
    node.sphere = read_sphere_extras(object, document);
    document.nodes.push_back(std::move(node));
  });
  check_tree(root, document);
}

void read_skins(const JsonObject& root, Document& document) {
  root.each("skins", [&](const JsonObject& object, std::size_t) {
    Diagnostics& diagnostics = object.diagnostics();
    object.only({"inverseBindMatrices", "skeleton", "joints"});
    document.extensions.check(object, Site::elsewhere);
    Skin skin;
    object.require("joints");
    skin.joints = object.references("joints", document.nodes.size(), "nodes");
    if (object.has("joints") && object.array_size("joints") == 0)
      diagnostics.fail(object.place() / "joints", "is empty: a skin needs a joint");
    skin.skeleton = object.reference("skeleton", document.nodes.size(), "nodes");
    skin.inverse_bind_matrices = object.reference("inverseBindMatrices", document.accessors.size(), "accessors");
    if (skin.inverse_bind_matrices >= 0) {
      const Accessor& accessor = document.accessors[std::size_t(skin.inverse_bind_matrices)];
      const std::string place = object.place() / "inverseBindMatrices";
      if (accessor.type != ElementType::mat4 || accessor.component != ComponentType::f32)
        diagnostics.fail(place, std::string("names an accessor of ") + name_of(accessor.type) + " of " +
                                    name_of(accessor.component) + ", allowed: MAT4 of FLOAT");
      if (accessor.count < skin.joints.size())
        diagnostics.fail(place, "has " + std::to_string(accessor.count) + " matrices for " +
                                    std::to_string(skin.joints.size()) + " joints");
      check_no_stride(document, accessor, place, "matrices", diagnostics);
    }
    document.skins.push_back(std::move(skin));
  });
}

void read_scenes(const JsonObject& root, Document& document) {
  root.each("scenes", [&](const JsonObject& object, std::size_t) {
    object.only({"nodes"});
    document.extensions.check(object, Site::elsewhere);
    SceneRoot scene;
    scene.name = object.string("name");
    scene.nodes = object.references("nodes", document.nodes.size(), "nodes");
    for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
      if (document.nodes[std::size_t(scene.nodes[i])].parent >= 0)
        object.diagnostics().fail(object.place() / "nodes" / i,
                                  "names node " + std::to_string(scene.nodes[i]) + ", which has a parent");
    }
    document.scenes.push_back(std::move(scene));
  });
  document.scene = root.reference("scene", document.scenes.size(), "scenes");
}

}  // namespace helio::gltf
