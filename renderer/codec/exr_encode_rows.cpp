#include "renderer/codec/exr_encode_rows.h"

#include <openexr.h>

#include <bit>
#include <cstring>

namespace helio {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are handed to the file as they lie in memory");

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"  // the library's own initializer
constexpr exr_context_initializer_t kDefaults = EXR_DEFAULT_CONTEXT_INITIALIZER;
#pragma GCC diagnostic pop

std::int64_t append(exr_const_context_t, void* out, const void* data, std::uint64_t size, std::uint64_t offset,
                    exr_stream_error_func_ptr_t) {
  std::vector<std::uint8_t>& bytes = *static_cast<std::vector<std::uint8_t>*>(out);
  const auto* from = static_cast<const std::uint8_t*>(data);
  if (offset == bytes.size()) {
    bytes.insert(bytes.end(), from, from + size);
  } else {
    if (offset + size > bytes.size()) bytes.resize(offset + size);
    std::memcpy(bytes.data() + offset, from, size);
  }
  return std::int64_t(size);
}

// The library would print to stderr; the result code says enough.
void ignore_message(exr_const_context_t, exr_result_t, const char*) {}

struct Context {
  exr_context_t handle = nullptr;
  ~Context() {
    if (handle != nullptr) exr_finish(&handle);
  }
};

exr_attr_box2i_t inclusive(const PixelRect& rect) {
  exr_attr_box2i_t box = {};
  box.min.x = rect.x0;
  box.min.y = rect.y0;
  box.max.x = rect.x1 - 1;
  box.max.y = rect.y1 - 1;
  return box;
}

exr_result_t write_header(exr_context_t exr, const TileHeader& header, std::span<const StoredChannel> channels) {
  int part = 0;
  exr_result_t rc = exr_add_part(exr, "", EXR_STORAGE_SCANLINE, &part);
  if (rc != EXR_ERR_SUCCESS) return rc;
  const exr_attr_box2i_t data = inclusive(header.data_window);
  const exr_attr_box2i_t display = inclusive({0, 0, header.frame_width, header.frame_height});
  const exr_attr_v2f_t center = {};
  rc = exr_initialize_required_attr(exr, part, &display, &data, 1.0f, &center, 1.0f, EXR_LINEORDER_INCREASING_Y,
                                    EXR_COMPRESSION_NONE);
  if (rc == EXR_ERR_SUCCESS) rc = exr_attr_set_string(exr, part, "software", kExrSoftware);
  if (rc == EXR_ERR_SUCCESS && !header.comments.empty())
    rc = exr_attr_set_string(exr, part, "comments", header.comments.c_str());
  if (rc == EXR_ERR_SUCCESS && !header.origin.empty())
    rc = exr_attr_set_string(exr, part, kExrOrigin, header.origin.c_str());
  for (const StoredChannel& channel : channels) {
    if (rc != EXR_ERR_SUCCESS) return rc;
    const exr_pixel_type_t type = channel.type == TilePixelType::half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    rc = exr_add_channel(exr, part, channel.name, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
  }
  return rc == EXR_ERR_SUCCESS ? exr_write_header(exr) : rc;
}

// A chunk is one row: each channel's values, one channel after another.
exr_result_t write_rows(exr_context_t exr, const PixelRect& window, std::span<const StoredChannel> channels) {
  const std::size_t width = std::size_t(window.width());
  std::size_t row_bytes = 0;
  for (const StoredChannel& channel : channels) row_bytes += width * channel.value_bytes;
  std::vector<char> row(row_bytes);
  for (int y = 0; y < window.height(); ++y) {
    char* out = row.data();
    for (const StoredChannel& channel : channels) {
      channel.write(std::size_t(y) * width, width, out);
      out += width * channel.value_bytes;
    }
    const exr_result_t rc = exr_write_scanline_chunk(exr, 0, window.y0 + y, row.data(), row.size());
    if (rc != EXR_ERR_SUCCESS) return rc;
  }
  return EXR_ERR_SUCCESS;
}

}  // namespace

Status encode_rows(const TileHeader& header, std::span<const StoredChannel> channels,
                   std::vector<std::uint8_t>& bytes) {
  exr_context_initializer_t init = kDefaults;
  init.error_handler_fn = &ignore_message;
  init.user_data = &bytes;
  init.write_fn = &append;
  Context exr;
  exr_result_t rc = exr_start_write(&exr.handle, "memory", EXR_WRITE_FILE_DIRECTLY, &init);
  // Names of more than 31 bytes need a flag in the version field, which old readers do not know: only where needed.
  for (const StoredChannel& channel : channels) {
    if (rc == EXR_ERR_SUCCESS && std::strlen(channel.name) > 31) rc = exr_set_longname_support(exr.handle, 1);
  }
  if (rc == EXR_ERR_SUCCESS) rc = write_header(exr.handle, header, channels);
  if (rc == EXR_ERR_SUCCESS) rc = write_rows(exr.handle, header.data_window, channels);
  if (rc == EXR_ERR_SUCCESS) rc = exr_finish(&exr.handle);
  if (rc != EXR_ERR_SUCCESS) return Error{ErrorCode::internal, exr_get_default_error_message(rc), "exr"};
  return ok_status();
}

}  // namespace helio
