// KHR_draco_mesh_compression: one compressed primitive to plain arrays.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/description/memory_budget.h"
#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

class DracoMesh {
 public:
  // Decodes within `budget`, which is asked before the decoder may allocate by the counts of the stream's header.
  // Errors (without `where`): invalid_argument, resource_exhausted.
  static Result<DracoMesh> decode(std::span<const std::uint8_t> compressed, MemoryBudget& budget);

  DracoMesh(DracoMesh&&) noexcept;
  DracoMesh& operator=(DracoMesh&&) noexcept;
  ~DracoMesh();

  std::uint64_t vertex_count() const;
  std::vector<std::uint32_t> indices() const;  // three per triangle, each below vertex_count()

  // The attribute with draco's unique id as `components` floats per vertex, normalised as `accessor` says.
  // Errors (without `where`): invalid_argument when it is missing or has another number of components.
  Result<std::vector<float>> floats(std::uint32_t unique_id, const Accessor& accessor) const;
  Result<std::vector<std::uint32_t>> integers(std::uint32_t unique_id, const Accessor& accessor) const;

 private:
  struct State;
  explicit DracoMesh(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace helio::gltf
