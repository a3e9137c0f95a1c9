// Device memory for the data of a scene: each upload gets a 64-bit address, and all are freed together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/device/commands.h"

namespace helio::vulkan {

// Blocks of memory that uploads are placed in one after another. Host-visible memory is written directly, other memory
// through a staging buffer; data that was uploaded is there for every later submission. Not thread safe.
class Arena {
 public:
  explicit Arena(std::shared_ptr<Device> device) : device_(std::move(device)) {}

  const std::shared_ptr<Device>& device() const { return device_; }

  // The address of a copy of `data`; 0 for empty data. `alignment`: a power of two. `what` names the data
  // in errors, e.g. "vertices". Refused: what the device cannot hold, with the bytes and the limit.
  Result<std::uint64_t> upload(std::span<const std::byte> data, std::uint64_t alignment, const std::string& what);

  // Uploads an array as upload() does. GLSL's scalar block layout asks for the alignment of the largest member.
  template <class T>
  Result<std::uint64_t> upload_vector(std::span<const T> values, const std::string& what) {
    // Not trivially copyable: vectors of Imath declare their copies themselves.
    static_assert(std::is_standard_layout_v<T> && std::is_trivially_destructible_v<T>);
    return upload(std::as_bytes(values), alignof(T) < 16 ? 16 : alignof(T), what);
  }
  template <class T>
  Result<std::uint64_t> upload_vector(const std::vector<T>& values, const std::string& what) {
    return upload_vector(std::span<const T>(values), what);
  }
  // Uploads one value, e.g. the table of tables, as upload() does.
  template <class T>
  Result<std::uint64_t> upload_value(const T& value, const std::string& what) {
    return upload_vector(std::span<const T>(&value, 1), what);
  }

  // Memory that is not written, e.g. for what the device computes; its bytes are undefined.
  Result<std::uint64_t> allocate(std::uint64_t bytes, std::uint64_t alignment, const std::string& what);

  // Takes memory for so many bytes of later uploads at once, in as few blocks as the device allows; each upload also
  // needs its alignment. Refused as upload().
  Status reserve(std::uint64_t bytes);

  std::uint64_t bytes() const { return used_; }                 // of all uploads, padding included
  std::uint64_t allocated_bytes() const { return allocated_; }  // of all blocks

 private:
  struct Place {
    Buffer* block;
    std::uint64_t offset;
  };
  Result<Place> place(std::uint64_t bytes, std::uint64_t alignment, const std::string& what);
  Status add_block(std::uint64_t bytes, const std::string& what);
  Status copy(const Place& place, std::span<const std::byte> data);

  std::shared_ptr<Device> device_;
  std::vector<Buffer> blocks_;
  std::vector<std::uint64_t> ends_;  // of what is used, of each block
  std::uint64_t used_ = 0, allocated_ = 0;
  Buffer staging_;
  std::optional<CommandSlot> slot_;
};

}  // namespace helio::vulkan
