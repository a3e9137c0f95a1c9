#include "renderer/scene/images/png_decoder.h"

#include <spng.h>

#include <memory>
#include <new>

namespace helio {
namespace {

constexpr std::size_t kMostAncillaryBytes = std::size_t(64) << 20;

struct Layout {
  spng_format format;
  int channels;
  bool wide;  // 16 bits
};

Layout layout_of(const spng_ihdr& header, bool transparent_colour) {
  const bool wide = header.bit_depth == 16;
  switch (header.color_type) {
    case SPNG_COLOR_TYPE_GRAYSCALE:
      if (transparent_colour) return {wide ? SPNG_FMT_GA16 : SPNG_FMT_GA8, 2, wide};
      return {wide ? SPNG_FMT_PNG : SPNG_FMT_G8, 1, wide};
    case SPNG_COLOR_TYPE_INDEXED:
    case SPNG_COLOR_TYPE_TRUECOLOR:
      if (transparent_colour) return {wide ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8, 4, wide};
      return {wide ? SPNG_FMT_PNG : SPNG_FMT_RGB8, 3, wide};
    case SPNG_COLOR_TYPE_GRAYSCALE_ALPHA:
      return {SPNG_FMT_PNG, 2, wide};
    default:
      return {SPNG_FMT_PNG, 4, wide};
  }
}

}  // namespace

Result<Image> decode_png(std::span<const std::uint8_t> png, const std::string& name, const AdmitImage& admit) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), spng_ctx_free);
  if (!context) throw std::bad_alloc();
  const auto fault = [&](int outcome) {
    if (outcome == SPNG_EMEM) throw std::bad_alloc();
    const bool too_large = outcome == SPNG_ECHUNK_LIMITS;
    return Error{too_large ? ErrorCode::resource_exhausted : ErrorCode::invalid_argument,
                 std::string("PNG is broken or cut off: ") + spng_strerror(outcome), name};
  };
  spng_set_crc_action(context.get(), SPNG_CRC_ERROR, SPNG_CRC_DISCARD);
  spng_set_chunk_limits(context.get(), kMostAncillaryBytes, kMostAncillaryBytes);
  if (const int outcome = spng_set_png_buffer(context.get(), png.data(), png.size())) return fault(outcome);

  spng_ihdr header;
  if (const int outcome = spng_get_ihdr(context.get(), &header)) return fault(outcome);
  spng_trns transparent;
  const int found = spng_get_trns(context.get(), &transparent);
  if (found != 0 && found != SPNG_ECHUNKAVAIL) return fault(found);
  const Layout layout = layout_of(header, found == 0);

  Image image;
  image.name = name;
  image.width = int(header.width);
  image.height = int(header.height);
  image.channels = layout.channels;
  image.format = layout.wide ? TexelFormat::u16 : TexelFormat::u8;
  const std::uint64_t bytes =
      std::uint64_t(header.width) * header.height * std::uint64_t(layout.channels) * (layout.wide ? 2 : 1);
  if (const Status admitted = admit(image.width, image.height, bytes); !admitted.ok()) return admitted.error();
  image.texels.resize(std::size_t(bytes));
  if (const int outcome = spng_decode_image(context.get(), image.texels.data(), image.texels.size(), layout.format,
                                            found == 0 ? SPNG_DECODE_TRNS : 0)) {
    return fault(outcome);
  }
  return image;
}

}  // namespace helio
