// What the specification asks of how objects are used together (glTF 2.0, 3.6.2, 3.7.2 and 3.7.3).
#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <map>

#include <spdlog/fmt/fmt.h>

#include "renderer/scene/description/material_slots.h"
#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

namespace {

// A view holds vertices or indices, not both; vertex attributes that share a view need its stride spelled out.
class ViewUses {
 public:
  ViewUses(const Document& document, Diagnostics& diagnostics)
      : document_(document), diagnostics_(diagnostics), uses_(document.views.size()) {
    for (std::size_t i = 0; i < uses_.size(); ++i) uses_[i].target = document.views[i].target;
  }

  void add(int accessor, int target, const std::string& place) {
    if (accessor < 0) return;
    const int view = document_.accessors[std::size_t(accessor)].view;
    if (view < 0 || document_.views[std::size_t(view)].meshopt) return;
    Use& use = uses_[std::size_t(view)];
    if (use.target != 0 && use.target != target)
      diagnostics_.tolerate(place, "uses bufferView " + std::to_string(view) + " for both vertices and indices",
                            "its bytes are read as either");
    use.target = target;
    if (target == kVertices && document_.views[std::size_t(view)].byte_stride == 0) share(use, accessor, view, place);
  }

  static constexpr int kVertices = 34962, kIndices = 34963;

 private:
  struct Use {
    int target = 0;
    std::map<std::uint64_t, std::uint64_t> blocks;  // of accessors: where each begins and ends, none in another
  };

  // Blocks one after the other are beyond doubt. Those that interlock without a byteStride are not: it may be what
  // was forgotten.
  void share(Use& use, int accessor, int view, const std::string& place) {
    const Accessor& a = document_.accessors[std::size_t(accessor)];
    const std::uint64_t begin = a.byte_offset, end = begin + a.count * a.element_size();
    const auto next = use.blocks.lower_bound(begin);
    const auto before = next == use.blocks.begin() ? use.blocks.end() : std::prev(next);
    if (next != use.blocks.end() && next->first == begin && next->second == end) return;  // the same numbers again
    const bool clear = (next == use.blocks.end() || next->first >= end) &&
                       (before == use.blocks.end() || before->second <= begin);
    if (!use.blocks.empty()) {
      const std::string problem = "shares bufferView " + std::to_string(view) +
                                  ", which has no byteStride, with another vertex attribute";
      if (clear)
        diagnostics_.tolerate(place, problem, "each is packed");
      else
        diagnostics_.fail(place, problem);
    }
    if (clear) use.blocks[begin] = end;
  }
  const Document& document_;
  Diagnostics& diagnostics_;
  std::vector<Use> uses_;
};

// A texture coordinate set beyond those the primitive has is an error. A gap in their numbering is a common flaw of
// exporters: the texture then sees (0, 0), and the report says so.
void check_texcoords(const Document& document, const Primitive& primitive, const std::string& place,
                     Diagnostics& diagnostics) {
  if (primitive.material < 0) return;
  int highest = -1;
  for (const Attribute& attribute : primitive.attributes) {
    if (attribute.semantic.starts_with("TEXCOORD_"))
      highest = std::max(highest, std::atoi(attribute.semantic.c_str() + 9));
  }
  for_each_texture_slot(document.materials[std::size_t(primitive.material)], [&](const TextureSlot& slot) {
    // Slots without an image are checked too, when they differ from what is not there at all.
    if (!slot.present() && slot.texcoord == 0) return;
    const std::string wanted = "TEXCOORD_" + std::to_string(slot.texcoord);
    if (primitive.find(wanted) >= 0) return;
    if (slot.texcoord > highest)
      diagnostics.fail(place / "material",
                       "has a texture that needs " + wanted + ", which the primitive does not have");
    else
      diagnostics.tolerate(place / "material",
                           "has a texture that needs " + wanted + ", which the primitive does not have",
                           "(0, 0) is used");
  });
}

void check_meshes(const Document& document, Diagnostics& diagnostics) {
  ViewUses uses(document, diagnostics);
  for (std::size_t m = 0; m < document.meshes.size(); ++m) {
    const Mesh& mesh = document.meshes[m];
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
      const Primitive& primitive = mesh.primitives[p];
      const std::string place = std::string() / "meshes" / m / "primitives" / p;
      for (const Attribute& a : primitive.attributes)
        uses.add(a.accessor, ViewUses::kVertices, place / "attributes" / a.semantic);
      for (std::size_t t = 0; t < primitive.targets.size(); ++t) {
        for (const Attribute& a : primitive.targets[t])
          uses.add(a.accessor, ViewUses::kVertices, place / "targets" / t / a.semantic);
      }
      uses.add(primitive.indices, ViewUses::kIndices, place / "indices");
      check_texcoords(document, primitive, place, diagnostics);
      if (primitive.material >= 0 && document.needs_tangents[std::size_t(primitive.material)] &&
          primitive.find("TANGENT") < 0 && primitive.find("NORMAL") < 0)
        diagnostics.fail(place / "material", "has a clearcoat normal map, but the primitive has no tangent space");
    }
  }
}

// Answers "which tree" and "is it an ancestor" from one depth-first numbering of all nodes.
class Ancestry {
 public:
  explicit Ancestry(const Document& document) : root_(document.nodes.size()), enter_(root_), leave_(root_) {
    int clock = 0;
    for (std::size_t top = 0; top < document.nodes.size(); ++top) {
      if (document.nodes[top].parent >= 0) continue;
      std::vector<std::pair<int, std::size_t>> stack{{int(top), 0}};  // node, next child
      enter_[top] = clock++;
      root_[top] = int(top);
      while (!stack.empty()) {
        auto& [at, next] = stack.back();
        const std::vector<int>& children = document.nodes[std::size_t(at)].children;
        if (next == children.size()) {
          leave_[std::size_t(at)] = clock;
          stack.pop_back();
          continue;
        }
        const int child = children[next++];
        enter_[std::size_t(child)] = clock++;
        root_[std::size_t(child)] = int(top);
        stack.emplace_back(child, 0);
      }
    }
  }

  int root(int node) const { return root_[std::size_t(node)]; }
  bool contains(int ancestor, int node) const {
    return enter_[std::size_t(ancestor)] <= enter_[std::size_t(node)] &&
           enter_[std::size_t(node)] < leave_[std::size_t(ancestor)];
  }

 private:
  std::vector<int> root_, enter_, leave_;
};

void check_skins(const Document& document, Diagnostics& diagnostics) {
  const Ancestry ancestry(document);
  for (std::size_t s = 0; s < document.skins.size(); ++s) {
    const Skin& skin = document.skins[s];
    const std::string place = std::string() / "skins" / s;
    for (const int joint : skin.joints) {
      if (ancestry.root(joint) != ancestry.root(skin.joints.front())) {
        diagnostics.tolerate(place / "joints", "have no common root", "each stands where its own nodes put it");
        break;
      }
    }
    if (skin.skeleton < 0) continue;
    for (const int joint : skin.joints) {
      if (!ancestry.contains(skin.skeleton, joint)) {
        diagnostics.tolerate(place / "skeleton", "is not an ancestor of joint node " + std::to_string(joint),
                             "the joints decide");
        break;
      }
    }
  }

  for (std::size_t n = 0; n < document.nodes.size(); ++n) {
    const Node& node = document.nodes[n];
    if (node.mesh < 0 || node.skin < 0) continue;
    for (const Primitive& primitive : document.meshes[std::size_t(node.mesh)].primitives) {
      if (primitive.find("JOINTS_0") >= 0 && primitive.find("WEIGHTS_0") >= 0) continue;
      diagnostics.fail(std::string() / "nodes" / n, "has a skin, but its mesh has no joints and weights");
      break;
    }
  }

  // Skinned meshes stand in the same scene as their joints.
  for (std::size_t s = 0; s < document.scenes.size(); ++s) {
    std::vector<bool> in_scene(document.nodes.size());
    for (const int root : document.scenes[s].nodes) in_scene[std::size_t(root)] = true;
    for (std::size_t n = 0; n < document.nodes.size(); ++n) {
      const Node& node = document.nodes[n];
      if (node.skin < 0 || !in_scene[std::size_t(ancestry.root(int(n)))]) continue;
      const std::vector<int>& joints = document.skins[std::size_t(node.skin)].joints;
      if (!joints.empty() && !in_scene[std::size_t(ancestry.root(joints.front()))])
        diagnostics.fail(std::string() / "nodes" / n, fmt::format("is skinned by joints that are not in scene {}", s));
    }
    if (s == 63) break;  // one scene is rendered; a file with very many is not worth the quadratic time
  }
}

}  // namespace

void check_consistency(const Document& document, Diagnostics& diagnostics) {
  check_meshes(document, diagnostics);
  check_skins(document, diagnostics);
}

}  // namespace helio::gltf
