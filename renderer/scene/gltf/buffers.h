// The bytes behind buffers and buffer views: GLB chunk, data URIs, other files, decompressed views.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "renderer/scene/description/file_source.h"
#include "renderer/scene/description/load_diagnostics.h"
#include "renderer/scene/description/memory_budget.h"
#include "renderer/scene/gltf/document/container.h"
#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

class BufferStore {
 public:
  // Reads every buffer and decodes every compressed view; failures go to `diagnostics`. The GLB's chunk is not copied:
  // the container's file must outlive the store.
  BufferStore(const Document& document, const Container& container, const FileSource& source,
              const std::string& scene_file, MemoryBudget& budget, Diagnostics& diagnostics);

  // The bytes of a view, byte_length of them; empty when nothing backs it (a buffer without URI).
  std::span<const std::uint8_t> view(int index) const { return views_[std::size_t(index)]; }

 private:
  struct Bytes {
    std::span<const std::uint8_t> bytes;
    std::vector<std::uint8_t> owned;
  };
  void load(std::size_t index, const Buffer& buffer, const Container& container, const FileSource& source,
            const std::string& scene_file, MemoryBudget& budget, Diagnostics& diagnostics, bool used);
  void decode(std::size_t index, const MeshoptView& view, MemoryBudget& budget, Diagnostics& diagnostics);

  std::vector<Bytes> buffers_;
  std::vector<std::vector<std::uint8_t>> decoded_;
  std::vector<std::span<const std::uint8_t>> views_;
};

// Reads another file of the scene, counting it in the budget. Errors have `where` empty.
Result<std::vector<std::uint8_t>> read_other_file(const FileSource& source, const std::string& scene_file,
                                                  const std::string& uri, MemoryBudget& budget);

}  // namespace helio::gltf
