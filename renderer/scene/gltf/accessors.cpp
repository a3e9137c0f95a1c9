#include "renderer/scene/gltf/accessors.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

namespace helio::gltf {

namespace {

// Calls visit with a value of the component's C++ type.
template <class Visit>
decltype(auto) with_type(ComponentType type, Visit&& visit) {
  switch (type) {
    case ComponentType::i8:
      return visit(std::int8_t{});
    case ComponentType::u8:
      return visit(std::uint8_t{});
    case ComponentType::i16:
      return visit(std::int16_t{});
    case ComponentType::u16:
      return visit(std::uint16_t{});
    case ComponentType::u32:
      return visit(std::uint32_t{});
    default:
      return visit(float{});
  }
}

template <class T>
T load(const std::uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

// glTF 2.0, 3.11: f = c / max, and max(c / max, -1) for signed types.
template <class T>
float to_float(T value, bool normalized) {
  if constexpr (std::is_same_v<T, float> || std::is_same_v<T, std::uint32_t>) {
    return float(value);
  } else {
    if (!normalized) return float(value);
    return std::max(float(value) / float(std::numeric_limits<T>::max()), -1.0f);
  }
}

template <class T, class Out, class Convert>
void convert_all(const std::uint8_t* base, std::size_t stride, std::size_t count, std::size_t components, Out* out,
                 Convert&& convert) {
  if constexpr (std::is_same_v<T, Out>) {
    if (stride == components * sizeof(T)) {
      std::memcpy(out, base, count * stride);
      return;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* element = base + i * stride;
    for (std::size_t c = 0; c < components; ++c) *out++ = convert(load<T>(element + c * sizeof(T)));
  }
}

// Writes the patched elements over `out`. The indices have been checked.
template <class T, class Out, class Convert>
void patch(const Accessor& accessor, const std::uint8_t* indices, const std::uint8_t* values, Out* out,
           Convert&& convert) {
  const SparsePatch& sparse = *accessor.sparse;
  const std::size_t components = std::size_t(component_count(accessor.type));
  with_type(sparse.index_type, [&](auto type) {
    using Index = decltype(type);
    for (std::size_t i = 0; i < sparse.count; ++i) {
      const std::size_t at = std::size_t(load<Index>(indices + i * sizeof(Index)));
      const std::uint8_t* element = values + i * components * sizeof(T);
      for (std::size_t c = 0; c < components; ++c) out[at * components + c] = convert(load<T>(element + c * sizeof(T)));
    }
  });
}

std::size_t stride_of(const Document& document, const Accessor& accessor) {
  const std::uint64_t stride = document.views[std::size_t(accessor.view)].byte_stride;
  return stride != 0 ? stride : accessor.element_size();
}

// First component that is NaN or infinite, or count * components.
std::size_t find_non_finite(const std::uint8_t* base, std::size_t stride, std::size_t count, std::size_t components) {
  constexpr std::uint32_t kExponent = 0x7f800000;
  if (stride == components * sizeof(float)) {
    std::uint32_t any = 0;  // branch-free, so that the common case runs at memory speed
    for (std::size_t i = 0; i < count * components; ++i)
      any |= std::uint32_t((load<std::uint32_t>(base + i * sizeof(float)) & kExponent) == kExponent);
    if (!any) return count * components;
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < components; ++c) {
      if ((load<std::uint32_t>(base + i * stride + c * sizeof(float)) & kExponent) == kExponent)
        return i * components + c;
    }
  }
  return count * components;
}

}  // namespace

void AccessorReader::check_all() {
  for (std::size_t i = 0; i < document_.accessors.size() && !diagnostics_.crowded(); ++i) {
    if (document_.accessors[i].sparse) check_sparse(int(i));
    check_values(int(i));
  }
}

void AccessorReader::check_sparse(int index) {
  const Accessor& accessor = (*this)[index];
  const SparsePatch& sparse = *accessor.sparse;
  const std::span<const std::uint8_t> view = buffers_.view(sparse.index_view);
  if (view.empty()) return;
  with_type(sparse.index_type, [&](auto type) {
    using Index = decltype(type);
    double previous = -1;
    for (std::size_t i = 0; i < sparse.count; ++i) {
      const double at = double(load<Index>(view.data() + sparse.index_offset + i * sizeof(Index)));
      if (at <= previous || at >= double(accessor.count)) {
        diagnostics_.fail(std::string() / "accessors" / std::size_t(index) / "sparse" / "indices",
                          "index " + std::to_string(i) + " is " + std::to_string(std::uint64_t(at)) +
                              ", allowed: above the one before and below " + std::to_string(accessor.count));
        return;
      }
      previous = at;
    }
  });
  const std::span<const std::uint8_t> values = buffers_.view(sparse.value_view);
  if (values.empty() || accessor.component != ComponentType::f32) return;
  const std::size_t components = std::size_t(component_count(accessor.type));
  const std::size_t at =
      find_non_finite(values.data() + sparse.value_offset, components * sizeof(float), sparse.count, components);
  if (at < sparse.count * components)
    diagnostics_.fail(std::string() / "accessors" / std::size_t(index) / "sparse" / "values",
                      "element " + std::to_string(at / components) + " is not finite");
}

void AccessorReader::check_values(int index) {
  const Accessor& accessor = (*this)[index];
  if (accessor.view < 0) return;
  const std::span<const std::uint8_t> view = buffers_.view(accessor.view);
  if (view.empty()) return;
  const std::uint8_t* base = view.data() + accessor.byte_offset;
  const std::size_t stride = stride_of(document_, accessor);
  const std::size_t components = std::size_t(component_count(accessor.type));
  const std::string place = std::string() / "accessors" / std::size_t(index);
  if (!count_work(accessor.count * accessor.element_size(), index)) return;
  if (accessor.component == ComponentType::f32) {
    const std::size_t at = find_non_finite(base, stride, accessor.count, components);
    if (at < accessor.count * components)
      diagnostics_.fail(place, "element " + std::to_string(at / components) + " is not finite");
    return;
  }
  // Integers have no excuse for leaving their declared bounds; floats may have been rounded by a tool.
  if (accessor.sparse || accessor.type >= ElementType::mat2 || (accessor.min.empty() && accessor.max.empty())) return;
  with_type(accessor.component, [&](auto type) {
    using T = decltype(type);
    std::array<T, 4> low, high;
    low.fill(std::numeric_limits<T>::max());
    high.fill(std::numeric_limits<T>::lowest());
    for (std::size_t i = 0; i < accessor.count; ++i) {
      for (std::size_t c = 0; c < components; ++c) {
        const T value = load<T>(base + i * stride + c * sizeof(T));
        low[c] = std::min(low[c], value);
        high[c] = std::max(high[c], value);
      }
    }
    for (std::size_t c = 0; c < components; ++c) {
      if (!accessor.min.empty() && double(low[c]) < accessor.min[c])
        diagnostics_.fail(place / "min" / c, "is " + std::to_string(std::int64_t(accessor.min[c])) +
                                                 ", but the data goes down to " + std::to_string(low[c]));
      if (!accessor.max.empty() && double(high[c]) > accessor.max[c])
        diagnostics_.fail(place / "max" / c, "is " + std::to_string(std::int64_t(accessor.max[c])) +
                                                 ", but the data goes up to " + std::to_string(high[c]));
    }
  });
}

bool AccessorReader::count_work(std::uint64_t bytes, int accessor) {
  constexpr std::uint64_t kReadings = 4;
  work_ += bytes;
  if (work_ / kReadings <= budget_.limit()) return true;
  diagnostics_.fail(
      std::string() / "accessors" / std::size_t(accessor),
      "accessors have been read for " + std::to_string(work_) + " bytes in all, out of proportion to the file",
      ErrorCode::resource_exhausted);
  return false;
}

bool AccessorReader::prepare(int index, std::size_t components, std::uint64_t bytes) {
  const Accessor& accessor = (*this)[index];
  const std::string place = std::string() / "accessors" / std::size_t(index);
  if (std::size_t(component_count(accessor.type)) != components) {
    diagnostics_.fail(place, std::string("is ") + name_of(accessor.type) + " where " + std::to_string(components) +
                                 " components are needed");
    return false;
  }
  if ((accessor.view >= 0 && buffers_.view(accessor.view).empty()) ||
      (accessor.sparse &&
       (buffers_.view(accessor.sparse->index_view).empty() || buffers_.view(accessor.sparse->value_view).empty()))) {
    diagnostics_.fail(place, "has no data: its buffer has no URI");
    return false;
  }
  if (Status s = budget_.reserve(bytes, ""); !s.ok()) {
    diagnostics_.fail(place, s.error());
    return false;
  }
  return count_work(bytes, index);
}

void AccessorReader::fill(const Accessor& accessor, float* out) const {
  const std::size_t components = std::size_t(component_count(accessor.type));
  with_type(accessor.component, [&](auto type) {
    using T = decltype(type);
    const bool normalized = accessor.normalized;
    const auto convert = [normalized](T value) { return to_float(value, normalized); };
    if (accessor.view >= 0)
      convert_all<T>(buffers_.view(accessor.view).data() + accessor.byte_offset, stride_of(document_, accessor),
                     accessor.count, components, out, convert);
    else
      std::fill_n(out, accessor.count * components, 0.0f);
    if (accessor.sparse)
      patch<T>(accessor, buffers_.view(accessor.sparse->index_view).data() + accessor.sparse->index_offset,
               buffers_.view(accessor.sparse->value_view).data() + accessor.sparse->value_offset, out, convert);
  });
}

bool AccessorReader::read_unsigned(int index, std::vector<std::uint32_t>& out) {
  const Accessor& accessor = (*this)[index];
  const std::size_t components = std::size_t(component_count(accessor.type));
  if (!prepare(index, components, accessor.count * components * sizeof(std::uint32_t))) return false;
  out.resize(accessor.count * components);
  with_type(accessor.component, [&](auto type) {
    using T = decltype(type);
    if constexpr (std::is_unsigned_v<T>) {
      const auto convert = [](T value) { return std::uint32_t(value); };
      if (accessor.view >= 0)
        convert_all<T>(buffers_.view(accessor.view).data() + accessor.byte_offset, stride_of(document_, accessor),
                       accessor.count, components, out.data(), convert);
      if (accessor.sparse)
        patch<T>(accessor, buffers_.view(accessor.sparse->index_view).data() + accessor.sparse->index_offset,
                 buffers_.view(accessor.sparse->value_view).data() + accessor.sparse->value_offset, out.data(),
                 convert);
    }
  });
  return true;
}

}  // namespace helio::gltf
