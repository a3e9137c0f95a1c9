#include "renderer/scene/gltf/pose.h"

#include "renderer/base/camera_limits.h"
#include "renderer/scene/gltf/animation.h"

namespace helio::gltf {

namespace {

// Every node after its parent.
std::vector<std::size_t> from_the_roots(const Document& document) {
  std::vector<std::size_t> order;
  order.reserve(document.nodes.size());
  for (std::size_t top = 0; top < document.nodes.size(); ++top)
    if (document.nodes[top].parent < 0) order.push_back(top);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (const int child : document.nodes[order[i]].children) order.push_back(std::size_t(child));
  return order;
}

}  // namespace

std::vector<M44d> unflattened(const Document& document, const Pose& pose) {
  std::vector<M44d> world(document.nodes.size());
  for (const std::size_t at : from_the_roots(document)) {
    const Node& node = document.nodes[at];
    Trs trs = pose.trs[at];
    for (int axis = 0; axis < 3; ++axis)
      if (trs.scale[axis] == 0) trs.scale[axis] = 1;
    const M44d local = node.matrix ? *node.matrix : to_matrix(trs);
    world[at] = node.parent >= 0 ? local * world[std::size_t(node.parent)] : local;
  }
  return world;
}

Pose evaluate_pose(const Document& document, int animation, double time_s, AccessorReader& reader,
                   Diagnostics& diagnostics) {
  const std::size_t count = document.nodes.size();
  Pose pose;
  std::uint64_t weight_count = 0;  // nodes times targets: quadratic in the size of the file
  for (const Node& node : document.nodes)
    if (node.mesh >= 0) weight_count += document.meshes[std::size_t(node.mesh)].target_count();
  if (Status s = reader.budget().reserve(weight_count, sizeof(float), ""); !s.ok()) {
    diagnostics.fail("/nodes", s.error());
    return pose;
  }
  std::vector<Trs>& trs = pose.trs;
  trs.resize(count);
  pose.weights.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Node& node = document.nodes[i];
    trs[i] = node.trs;
    if (node.mesh >= 0)
      pose.weights[i] = node.weights.empty() ? document.meshes[std::size_t(node.mesh)].weights : node.weights;
  }
  apply_animation(document, animation, time_s, reader, diagnostics, trs, pose.weights);
  if (diagnostics.failed()) return pose;

  pose.to_world.resize(count);
  pose.mirrored.resize(count);
  for (const std::size_t at : from_the_roots(document)) {
    const Node& node = document.nodes[at];
    const M44d local = node.matrix ? *node.matrix : to_matrix(trs[at]);
    M44d& world = pose.to_world[at];
    world = node.parent >= 0 ? local * pose.to_world[std::size_t(node.parent)] : local;
    const bool mirrors = node.matrix ? node.matrix->determinant() < 0 : is_mirrored(trs[at]);
    pose.mirrored[at] = mirrors != (node.parent >= 0 && pose.mirrored[std::size_t(node.parent)]);
    for (int i = 0; i < 16; ++i) {
      if (!(std::abs(world[i / 4][i % 4]) <= kMaxCoordinate)) {
        diagnostics.fail(std::string() / "nodes" / at, "its world transform has a number beyond 1e12");
        return pose;
      }
    }
  }
  return pose;
}

}  // namespace helio::gltf
