#include "renderer/scene/gltf_pose.h"

#include "renderer/base/camera_limits.h"
#include "renderer/scene/gltf_animation.h"

namespace helio::gltf {

M44d to_matrix(const Trs& trs) {
  const auto [x, y, z, w] = trs.rotation;
  M44d m;  // rows: images of the axes
  m[0][0] = 1 - 2 * (y * y + z * z), m[0][1] = 2 * (x * y + z * w), m[0][2] = 2 * (x * z - y * w);
  m[1][0] = 2 * (x * y - z * w), m[1][1] = 1 - 2 * (x * x + z * z), m[1][2] = 2 * (y * z + x * w);
  m[2][0] = 2 * (x * z + y * w), m[2][1] = 2 * (y * z - x * w), m[2][2] = 1 - 2 * (x * x + y * y);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) m[row][column] *= trs.scale[row];
  for (int column = 0; column < 3; ++column) m[3][column] = trs.translation[column];
  return m;
}

Pose evaluate_pose(const Document& document, double time_s, AccessorReader& reader, Diagnostics& diagnostics) {
  const std::size_t count = document.nodes.size();
  Pose pose;
  std::uint64_t weight_count = 0;  // nodes times targets: quadratic in the size of the file
  for (const Node& node : document.nodes)
    if (node.mesh >= 0) weight_count += document.meshes[std::size_t(node.mesh)].target_count();
  if (Status s = reader.budget().reserve(weight_count, sizeof(float), ""); !s.ok()) {
    diagnostics.fail("/nodes", s.error());
    return pose;
  }
  std::vector<Trs> trs(count);
  pose.weights.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Node& node = document.nodes[i];
    trs[i] = node.trs;
    if (node.mesh >= 0)
      pose.weights[i] = node.weights.empty() ? document.meshes[std::size_t(node.mesh)].weights : node.weights;
  }
  apply_animations(document, time_s, reader, diagnostics, trs, pose.weights);
  if (diagnostics.failed()) return pose;

  pose.to_world.resize(count);
  std::vector<int> stack;
  for (std::size_t top = 0; top < count; ++top) {
    if (document.nodes[top].parent >= 0) continue;
    stack.push_back(int(top));
    while (!stack.empty()) {
      const std::size_t at = std::size_t(stack.back());
      stack.pop_back();
      const Node& node = document.nodes[at];
      const M44d local = node.matrix ? *node.matrix : to_matrix(trs[at]);
      M44d& world = pose.to_world[at];
      world = node.parent >= 0 ? local * pose.to_world[std::size_t(node.parent)] : local;
      for (int i = 0; i < 16; ++i) {
        if (!(std::abs(world[i / 4][i % 4]) <= kMaxCoordinate)) {
          diagnostics.fail(std::string() / "nodes" / at, "its world transform has a number beyond 1e12");
          return pose;
        }
      }
      stack.insert(stack.end(), node.children.begin(), node.children.end());
    }
  }
  return pose;
}

}  // namespace helio::gltf
