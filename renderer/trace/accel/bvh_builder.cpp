#include "renderer/trace/accel/bvh_builder.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "renderer/trace/accel/build_arena.h"
#include "renderer/trace/accel/embree.h"

namespace helio {
namespace {

static_assert(sizeof(BvhPrimitive) == sizeof(RTCBuildPrimitive) && alignof(BvhPrimitive) == alignof(RTCBuildPrimitive));

// What the builder makes. A pointer to a leaf has its lowest bit set.
struct BuiltNode {
  RTCBounds bounds[2];
  void* children[2];
};
struct BuiltLeaf {
  RTCBounds bounds;
  std::uint32_t count;
  std::uint32_t numbers[RTC_BUILD_MAX_PRIMITIVES_PER_LEAF];  // `count` of them
};
constexpr std::uintptr_t kLeafBit = 1;

void* create_node(RTCThreadLocalAllocator allocator, unsigned, void*) {
  return rtcThreadLocalAlloc(allocator, sizeof(BuiltNode), 16);
}
void set_children(void* node, void** children, unsigned count, void*) {
  std::copy_n(children, count, static_cast<BuiltNode*>(node)->children);
}
void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i) static_cast<BuiltNode*>(node)->bounds[i] = *bounds[i];
}
void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
  const std::size_t bytes = offsetof(BuiltLeaf, numbers) + count * sizeof(std::uint32_t);
  auto* leaf = static_cast<BuiltLeaf*>(rtcThreadLocalAlloc(allocator, bytes, 16));
  leaf->count = std::uint32_t(count);
  RTCBounds& b = leaf->bounds;
  b = {primitives[0].lower_x, primitives[0].lower_y, primitives[0].lower_z, 0,
       primitives[0].upper_x, primitives[0].upper_y, primitives[0].upper_z, 0};
  for (std::size_t i = 0; i < count; ++i) {
    const RTCBuildPrimitive& p = primitives[i];
    b.lower_x = std::min(b.lower_x, p.lower_x);
    b.lower_y = std::min(b.lower_y, p.lower_y);
    b.lower_z = std::min(b.lower_z, p.lower_z);
    b.upper_x = std::max(b.upper_x, p.upper_x);
    b.upper_y = std::max(b.upper_y, p.upper_y);
    b.upper_z = std::max(b.upper_z, p.upper_z);
    leaf->numbers[i] = p.primID;
  }
  return reinterpret_cast<void*>(reinterpret_cast<std::uintptr_t>(leaf) | kLeafBit);
}
bool go_on(void* cancel, double) {
  const auto* token = static_cast<const CancelToken*>(cancel);
  return !token || !token->cancelled();
}

Box3f to_box(const RTCBounds& b) {
  return {V3f(b.lower_x, b.lower_y, b.lower_z), V3f(b.upper_x, b.upper_y, b.upper_z)};
}

// Depth first, the first child right behind its parent.
class Flattening {
 public:
  explicit Flattening(BinaryBvh& bvh) : bvh_(bvh) {}

  void run(void* root) {
    bvh_.root = child(root, {});
    if (bvh_.root.count == 0) {
      for (const BinaryBvh::Child& top : bvh_.nodes[bvh_.root.first].children) bvh_.root.box.extendBy(top.box);
    }
  }

 private:
  // Recursion is as deep as the tree, which BvhBuildOptions::max_depth bounds.
  BinaryBvh::Child child(void* built, const Box3f& box, std::uint32_t depth = 1) {
    bvh_.depth = std::max(bvh_.depth, depth);
    BinaryBvh::Child result;
    result.box = box;
    const auto bits = reinterpret_cast<std::uintptr_t>(built);
    if (bits & kLeafBit) {
      const auto* leaf = reinterpret_cast<const BuiltLeaf*>(bits & ~kLeafBit);
      result.box = to_box(leaf->bounds);
      result.first = std::uint32_t(bvh_.order.size());
      result.count = leaf->count;
      bvh_.order.insert(bvh_.order.end(), leaf->numbers, leaf->numbers + leaf->count);
      return result;
    }
    const auto* node = static_cast<const BuiltNode*>(built);
    result.first = std::uint32_t(bvh_.nodes.size());
    bvh_.nodes.emplace_back();
    for (int i = 0; i < 2; ++i) {
      const BinaryBvh::Child below = child(node->children[i], to_box(node->bounds[i]), depth + 1);
      bvh_.nodes[result.first].children[i] = below;
    }
    return result;
  }

  BinaryBvh& bvh_;
};

struct ReleaseBvh {
  void operator()(RTCBVHTy* bvh) const { rtcReleaseBVH(bvh); }
};

// Embree's tree, flattened. RTC_ERROR_UNKNOWN: it would be deeper than allowed.
RTCError build_by_cost(std::vector<BvhPrimitive> primitives, const BvhBuildOptions& options, RTCDevice device,
                       BinaryBvh& result) {
  const std::size_t count = primitives.size();
  rtcGetDeviceError(device);
  const std::unique_ptr<RTCBVHTy, ReleaseBvh> bvh(rtcNewBVH(device));
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = options.max_depth;
  arguments.maxLeafSize = options.leaf_size;
  arguments.intersectionCost = options.intersection_cost;
  arguments.bvh = bvh.get();
  arguments.primitives = reinterpret_cast<RTCBuildPrimitive*>(primitives.data());
  arguments.primitiveCount = count;
  arguments.primitiveArrayCapacity = count;
  arguments.createNode = create_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = create_leaf;
  arguments.buildProgress = go_on;
  arguments.userPtr = const_cast<CancelToken*>(options.cancel);
  void* const root = rtcBuildBVH(&arguments);
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) return error;
  if (!root) return RTC_ERROR_UNKNOWN;
  std::vector<BvhPrimitive>().swap(primitives);
  result.nodes.reserve(count);
  result.order.reserve(count);
  Flattening(result).run(root);
  return RTC_ERROR_NONE;
}

// Halves of equal number, along the axis in which the centres spread most.
class Halving {
 public:
  Halving(std::vector<BvhPrimitive> primitives, const BvhBuildOptions& options, BinaryBvh& bvh)
      : primitives_(std::move(primitives)), options_(options), bvh_(bvh) {}

  void run() { bvh_.root = split(0, primitives_.size(), 1); }

 private:
  static V3f center(const BvhPrimitive& p) { return p.lower * 0.5f + p.upper * 0.5f; }

  BinaryBvh::Child split(std::size_t begin, std::size_t end, std::uint32_t depth) {
    BinaryBvh::Child child;
    Box3f centers;
    for (std::size_t i = begin; i < end; ++i) {
      child.box.extendBy(Box3f(primitives_[i].lower, primitives_[i].upper));
      centers.extendBy(center(primitives_[i]));
    }
    bvh_.depth = std::max(bvh_.depth, depth);
    if (end - begin <= options_.leaf_size || (options_.cancel && options_.cancel->cancelled())) {
      child.first = std::uint32_t(bvh_.order.size());
      child.count = std::uint32_t(end - begin);
      for (std::size_t i = begin; i < end; ++i) bvh_.order.push_back(primitives_[i].number);
      return child;
    }
    const auto axis = int(centers.majorAxis());
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t i) { return primitives_.begin() + std::ptrdiff_t(i); };
    std::nth_element(at(begin), at(middle), at(end), [axis](const BvhPrimitive& a, const BvhPrimitive& b) {
      return center(a)[axis] < center(b)[axis];
    });
    child.first = std::uint32_t(bvh_.nodes.size());
    bvh_.nodes.emplace_back();
    const BinaryBvh::Child first = split(begin, middle, depth + 1), second = split(middle, end, depth + 1);
    bvh_.nodes[child.first] = {{first, second}};
    return child;
  }

  std::vector<BvhPrimitive> primitives_;
  const BvhBuildOptions& options_;
  BinaryBvh& bvh_;
};

// Levels that Halving makes of so many primitives.
std::uint32_t halving_depth(std::size_t count, std::uint32_t leaf_size) {
  std::uint32_t depth = 1;
  for (; count > leaf_size; count = (count + 1) / 2) ++depth;
  return depth;
}

}  // namespace

Result<BinaryBvh> build_binary_bvh(const std::vector<BvhPrimitive>& primitives, const BvhBuildOptions& options) {
  BinaryBvh result;
  if (primitives.empty()) return result;
  const std::string count = std::to_string(primitives.size());
  if (primitives.size() > kMostBvhPrimitives ||
      halving_depth(primitives.size(), options.leaf_size) > options.max_depth) {
    return Error{ErrorCode::resource_exhausted, count + " primitives are too many for one BVH", {}};
  }
  const RTCDevice device = embree::device();
  if (!device) return Error{ErrorCode::internal, "Embree cannot create a device", {}};
  RTCError error = RTC_ERROR_NONE;
  tbb::task_arena arena(build_concurrency(options.threads));
  arena.initialize();
  {
    const NiceBuildWorkers nice(arena);
    arena.execute([&] { error = build_by_cost(primitives, options, device, result); });
  }
  const auto cancelled = [&] { return options.cancel && options.cancel->cancelled(); };
  if (error == RTC_ERROR_UNKNOWN && !cancelled()) {
    result = {};
    Halving(primitives, options, result).run();
    error = RTC_ERROR_NONE;
  }
  if (cancelled()) return Error{ErrorCode::cancelled, "the build was cancelled", {}};
  if (error == RTC_ERROR_NONE) return result;
  return Error{error == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::resource_exhausted : ErrorCode::internal,
               "building a BVH of " + count + " primitives failed: Embree error " + std::to_string(int(error)),
               {}};
}

}  // namespace helio
