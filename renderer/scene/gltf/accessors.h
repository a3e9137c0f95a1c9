// Accessors to arrays: type conversion, normalisation, interleaving, sparse patches.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/gltf/buffers.h"

namespace helio::gltf {

class AccessorReader {
 public:
  AccessorReader(const Document& document, const BufferStore& buffers, MemoryBudget& budget, Diagnostics& diagnostics)
      : document_(document), buffers_(buffers), budget_(budget), diagnostics_(diagnostics) {}

  // Looks at the data of every accessor, used or not: no NaN or infinity, integers within the declared bounds, sparse
  // indices ascending and inside. Failures name the accessor.
  void check_all();

  // All elements as floats; normalized integers become [0, 1] or [-1, 1] (glTF 2.0, 3.11). T is float, V2f, V3f or V4f
  // and must have as many components as the accessor. The memory is reserved and stays so. False after a failure.
  template <class T>
  bool read(int accessor, std::vector<T>& out) {
    return read_floats(accessor, sizeof(T) / sizeof(float), out);
  }
  // Sixteen floats per element.
  bool read_matrices(int accessor, std::vector<std::array<float, 16>>& out) { return read_floats(accessor, 16, out); }
  // Elements of an unsigned integer accessor, components interleaved.
  bool read_unsigned(int accessor, std::vector<std::uint32_t>& out);

  const Accessor& operator[](int accessor) const { return document_.accessors[std::size_t(accessor)]; }
  MemoryBudget& budget() const { return budget_; }

 private:
  template <class T>
  bool read_floats(int accessor, std::size_t components, std::vector<T>& out) {
    const Accessor& a = document_.accessors[std::size_t(accessor)];
    if (!prepare(accessor, components, a.count * sizeof(T))) return false;
    out.resize(a.count);
    fill(a, reinterpret_cast<float*>(out.data()));
    return true;
  }
  bool prepare(int accessor, std::size_t components, std::uint64_t bytes);
  // Counts bytes that are looked at. Accessors may overlap and be read many times: the sum is held to a multiple of the
  // memory limit, so that a small file cannot keep the loader busy. False after a failure.
  bool count_work(std::uint64_t bytes, int accessor);
  void fill(const Accessor& accessor, float* out) const;
  void check_sparse(int accessor);
  void check_values(int accessor);

  const Document& document_;
  const BufferStore& buffers_;
  MemoryBudget& budget_;
  Diagnostics& diagnostics_;
  std::uint64_t work_ = 0;
};

}  // namespace helio::gltf
