// Surface points of many vertices, each made once for all questions.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "renderer/trace/scene/shading_point.h"

namespace helio {

// A place for each vertex's point, by number: at most 2,048 of some 2 KB, which stay with the store.
class PointStore {
 public:
  // Points of this number and above are not kept: the room is bounded.
  static constexpr std::size_t kMost = 2048;

  // Room for the point of vertex `number`, which holds none.
  Late<ShadingPoint>& room(std::size_t number) {
    if (number >= kMost) number = kMost;  // the place of all that are not kept
    while (number >= blocks_.size() * kBlock) blocks_.push_back(std::make_unique<Block>());
    Late<ShadingPoint>& point = blocks_[number / kBlock]->points[number % kBlock];
    point.reset();
    return point;
  }

  // Null: none was made, or it was not kept. Precondition: room() of this number was asked for.
  const ShadingPoint* at(std::size_t number) const {
    return number < kMost ? blocks_[number / kBlock]->points[number % kBlock].get() : nullptr;
  }

 private:
  static constexpr std::size_t kBlock = 64;
  struct Block {
    Late<ShadingPoint> points[kBlock];
  };
  std::vector<std::unique_ptr<Block>> blocks_;
};

}  // namespace helio
