#include "renderer/vulkan/scene/bvh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "renderer/trace/accel/bvh_builder.h"

namespace helio::vulkan {
namespace {

constexpr std::uint32_t kLeafSize = 4;
static_assert(kLeafSize <= kBvhCountMask);
// Levels of the binary trees: over the flat parts, the instances and the parts of an object. Two of them make a level
// of ours, which leaves three references on the traversal's stack; the one of join() leaves one.
constexpr std::uint32_t kFlatDepth = 44, kInstanceDepth = 26, kObjectDepth = 36;
constexpr std::uint32_t stack_of(std::uint32_t depth) {
  return 3 * ((depth + 1) / 2);
}
static_assert(stack_of(kFlatDepth) + 1 <= kBvhStackSize);
static_assert(stack_of(kInstanceDepth) + stack_of(kObjectDepth) + 1 <= kBvhStackSize);

constexpr float kLargest = std::numeric_limits<float>::max();

// The next floats further out by a few units, for boxes whose faces are results of arithmetic.
Box3f widened(const V3d& lower, const V3d& upper) {
  Box3f box;
  for (int axis = 0; axis < 3; ++axis) {
    const double margin = 0x1p-22 * std::max(std::abs(lower[axis]), std::abs(upper[axis]));
    box.min[axis] = std::nextafter(float(lower[axis] - margin), -kLargest);
    box.max[axis] = std::nextafter(float(upper[axis] + margin), kLargest);
  }
  return box;
}

Box3f sphere_box(const PartTable& part) {
  const V3d center(part.center), radius{double(part.radius)};
  return widened(center - radius, center + radius);
}

Box3f triangle_box(const TriangleMesh& mesh, std::size_t triangle) {
  Box3f box;
  for (std::size_t k = 0; k < 3; ++k) box.extendBy(mesh.positions[mesh.indices[3 * triangle + k]]);
  return box;
}

bool is_finite(const Box3f& box) {
  return helio::is_finite(box.min) && helio::is_finite(box.max);
}

float largest_coordinate(const Box3f& box) {
  float largest = 0;
  if (box.isEmpty()) return largest;
  for (int axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, std::abs(box.min[axis]), std::abs(box.max[axis])});
  }
  return largest;
}

// The least power of two of which 255 cover `extent`, as the biased exponent of a float.
std::uint32_t exponent_for(double extent) {
  int exponent = 0;
  const double mantissa = std::frexp(extent / 255, &exponent);  // in [0.5, 1)
  if (mantissa == 0.5) --exponent;
  return extent > 0 ? std::uint32_t(std::clamp(exponent + 127, 1, 254)) : 1u;
}

BvhNode make_node(std::span<const Box3f> boxes, std::span<const std::uint32_t> references) {
  Box3f all;
  for (const Box3f& box : boxes) all.extendBy(box);
  BvhNode node{};
  node.origin = all.min;
  for (std::uint32_t& child : node.children) child = kBvhEmpty;
  std::copy(references.begin(), references.end(), node.children);
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t exponent = exponent_for(double(all.max[axis]) - double(all.min[axis]));
    const double unit = std::ldexp(1.0, int(exponent) - 127);
    node.exponents |= exponent << 8 * axis;
    for (std::size_t i = 0; i < 4; ++i) {
      std::uint32_t lower = 255, upper = 0;  // nothing
      if (i < boxes.size()) {
        lower = std::uint32_t(std::floor((double(boxes[i].min[axis]) - double(all.min[axis])) / unit));
        upper = std::uint32_t(std::ceil((double(boxes[i].max[axis]) - double(all.min[axis])) / unit));
      }
      node.lower[axis] |= lower << 8 * i;
      node.upper[axis] |= upper << 8 * i;
    }
  }
  return node;
}

struct Tree {
  std::uint32_t root = kBvhEmpty;
  Box3f box;
};

class Building {
 public:
  Building(SceneGeometry& geometry, const SceneBvhOptions& options) : geometry_(geometry), options_(options) {}

  Result<SceneBvh> run() {
    std::uint64_t primitives = 0;
    for (std::size_t i = 0; i < geometry_.parts.size(); ++i) {
      primitives += geometry_.meshes[i] ? geometry_.meshes[i]->triangle_count() : 1;
    }
    if (primitives > kBvhFirstMask) {
      return Error{ErrorCode::resource_exhausted,
                   std::to_string(primitives) + " triangles and spheres; allowed: at most " +
                       std::to_string(kBvhFirstMask) + " in a scene that a device's compute shaders trace",
                   {}};
    }
    auto flat = build_parts(0, geometry_.flat_count, kFlatDepth);
    if (!flat) return std::move(flat).error();
    auto instances = build_instances();
    if (!instances) return std::move(instances).error();
    const Tree top = join(*flat, *instances);
    geometry_.tables.bvh_root = top.root;
    geometry_.tables.bvh_slack = largest_coordinate(top.box);
    return std::move(bvh_);
  }

 private:
  struct Primitive {
    std::uint32_t part, primitive;  // index into SceneGeometry::parts
  };

  // A tree over the parts [first, first + count).
  Result<Tree> build_parts(std::uint32_t first, std::uint32_t count, std::uint32_t depth) {
    std::size_t total = 0;
    for (std::uint32_t part = first; part < first + count; ++part) {
      total += geometry_.meshes[part] ? geometry_.meshes[part]->triangle_count() : 1;
    }
    std::vector<BvhPrimitive> boxes;
    std::vector<Primitive> primitives;
    boxes.reserve(total);
    primitives.reserve(total);
    const auto add = [&](const Box3f& box, const Primitive& primitive) {
      if (!is_finite(box)) return;  // no ray meets it
      boxes.push_back({box.min, 0, box.max, std::uint32_t(primitives.size())});
      primitives.push_back(primitive);
    };
    for (std::uint32_t part = first; part < first + count; ++part) {
      if (!geometry_.traced[part]) continue;
      const TriangleMesh* const mesh = geometry_.meshes[part];
      if (!mesh) {
        add(sphere_box(geometry_.parts[part]), {part, 0});
        continue;
      }
      for (std::uint32_t triangle = 0; triangle < mesh->triangle_count(); ++triangle) {
        add(triangle_box(*mesh, triangle), {part, triangle});
      }
    }
    auto built = build_binary_bvh(boxes, build_options(kLeafSize, depth));
    if (!built) return std::move(built).error();
    std::vector<BvhPrimitive>().swap(boxes);
    const std::uint32_t first_triangle = std::uint32_t(bvh_.triangles.size());
    bvh_.triangles.reserve(bvh_.triangles.size() + built->order.size());
    for (const std::uint32_t number : built->order) {
      const Primitive& p = primitives[number];
      bvh_.triangles.push_back(leaf_triangle(p, p.part - first));
    }
    return append(*built, [&](const BinaryBvh::Child& leaf) {
      return kBvhLeaf | leaf.count << kBvhCountShift | (first_triangle + leaf.first);
    });
  }

  BvhTriangle leaf_triangle(const Primitive& p, std::uint32_t part) const {
    const PartTable& table = geometry_.parts[p.part];
    BvhTriangle triangle{};
    triangle.part = part;
    triangle.primitive = p.primitive;
    if (table.flags & kPartAlpha) triangle.part |= kBvhAlpha;
    if (const TriangleMesh* const mesh = geometry_.meshes[p.part]) {
      const std::uint32_t* const i = &mesh->indices[3 * std::size_t(p.primitive)];
      triangle.a = mesh->positions[i[0]];
      triangle.b = mesh->positions[i[1]];
      triangle.c = mesh->positions[i[2]];
    } else {
      triangle.part |= kBvhSphere;
      triangle.a = table.center;
      triangle.b = V3f(table.radius, 0, 0);
      triangle.c = V3f(0, 0, 0);
    }
    return triangle;
  }

  Result<Tree> build_instances() {
    std::vector<Tree> objects;
    objects.reserve(geometry_.object_count);
    for (const std::uint32_t instance : geometry_.first_instances()) {
      auto tree = build_parts(geometry_.instances[instance].first_part, geometry_.part_counts[instance], kObjectDepth);
      if (!tree) return tree;
      objects.push_back(*tree);
    }
    std::vector<BvhPrimitive> boxes;
    for (std::size_t i = 0; i < geometry_.instances.size(); ++i) {
      InstanceTable& instance = geometry_.instances[i];
      const Tree& object = objects[geometry_.objects[i]];
      instance.bvh_root = object.root;
      instance.bvh_slack = largest_coordinate(object.box);
      const Box3f box = placed_box(object.box, instance);
      if (!object.box.isEmpty() && is_finite(box)) boxes.push_back({box.min, 0, box.max, std::uint32_t(i)});
    }
    auto built = build_binary_bvh(boxes, build_options(1, kInstanceDepth));
    if (!built) return std::move(built).error();
    return append(*built, [&](const BinaryBvh::Child& leaf) { return kBvhInstance | built->order[leaf.first]; });
  }

  static Box3f placed_box(const Box3f& box, const InstanceTable& instance) {
    V3d lower{double(kLargest)}, upper{-double(kLargest)};
    for (int corner = 0; corner < 8; ++corner) {
      V3d p(instance.to_world[3]);
      for (int axis = 0; axis < 3; ++axis) {
        p += V3d(instance.to_world[axis]) * double((corner >> axis & 1 ? box.max : box.min)[axis]);
      }
      for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = std::min(lower[axis], p[axis]);
        upper[axis] = std::max(upper[axis], p[axis]);
      }
    }
    return widened(lower, upper);
  }

  BvhBuildOptions build_options(std::uint32_t leaf_size, std::uint32_t depth) const {
    BvhBuildOptions build;
    build.leaf_size = leaf_size;
    build.max_depth = depth;
    build.threads = options_.threads;
    build.cancel = options_.cancel;
    return build;
  }

  // Appends the nodes of a binary tree, every second level left out; `leaf_reference` makes references to leaves.
  template <class LeafReference>
  Tree append(const BinaryBvh& built, const LeafReference& leaf_reference) {
    if (built.order.empty()) return {};
    bvh_.nodes.reserve(bvh_.nodes.size() + built.nodes.size() / 2 + 2);
    const auto add = [&](const auto& self, const BinaryBvh::Child& child) -> std::uint32_t {
      if (child.count > 0) return leaf_reference(child);
      BinaryBvh::Child below[4];
      std::size_t count = 0;
      for (const BinaryBvh::Child& middle : built.nodes[child.first].children) {
        if (middle.count > 0) {
          below[count++] = middle;
        } else {
          for (const BinaryBvh::Child& lower : built.nodes[middle.first].children) below[count++] = lower;
        }
      }
      const auto index = std::uint32_t(bvh_.nodes.size());
      bvh_.nodes.emplace_back();
      Box3f boxes[4];
      std::uint32_t references[4];
      for (std::size_t i = 0; i < count; ++i) {
        boxes[i] = below[i].box;
        references[i] = self(self, below[i]);
      }
      bvh_.nodes[index] = make_node(std::span(boxes, count), std::span(references, count));
      return index;
    };
    const std::uint32_t root = add(add, built.root);
    return {root, built.root.box};
  }

  Tree join(const Tree& first, const Tree& second) {
    if (second.box.isEmpty()) return first;
    if (first.box.isEmpty()) return second;
    const Box3f boxes[2] = {first.box, second.box};
    const std::uint32_t references[2] = {first.root, second.root};
    Tree both;
    both.root = std::uint32_t(bvh_.nodes.size());
    both.box = first.box;
    both.box.extendBy(second.box);
    bvh_.nodes.push_back(make_node(boxes, references));
    return both;
  }

  SceneGeometry& geometry_;
  const SceneBvhOptions& options_;
  SceneBvh bvh_;
};

}  // namespace

Result<SceneBvh> build_bvh(SceneGeometry& geometry, const SceneBvhOptions& options) {
  return Building(geometry, options).run();
}

Status upload_bvh(const SceneBvh& bvh, SceneGeometry& geometry, Arena& arena) {
  auto nodes = arena.upload(std::as_bytes(std::span(bvh.nodes)), 64, "BVH nodes");
  if (!nodes) return std::move(nodes).error();
  auto triangles = arena.upload(std::as_bytes(std::span(bvh.triangles)), 16, "BVH triangles");
  if (!triangles) return std::move(triangles).error();
  geometry.tables.bvh_nodes = *nodes;
  geometry.tables.bvh_triangles = *triangles;
  return ok_status();
}

}  // namespace helio::vulkan
