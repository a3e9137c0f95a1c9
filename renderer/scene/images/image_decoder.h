// Encoded image bytes to pixels, through OpenImageIO, entirely in memory.
//
// Reads PNG, JPEG, OpenEXR, Radiance HDR, PNM (PBM, PGM, PPM, PFM), TIFF, BMP, TGA and WebP, as far as the installed
// OpenImageIO can read each from memory; anything else is refused by name. The content decides, never the file name.
//
// What comes out is what the file holds: 8, 16 and 32 bit integers as u8 / u16 / f32, half and float as f16 / f32, one
// to four channels, row 0 on top, alpha unassociated as stored in PNG, no colour conversion of any kind (see
// TextureSlot::encoding). A palette is expanded; CMYK JPEGs become RGB. EXIF orientation is ignored, as in glTF.
//
// An EXR's picture is its display window: texels that the data window leaves out are 0 in every channel, those outside
// of the display window are dropped. Its channels are picked by name: R, G, B, A, or Y, without a layer, else of the
// only layer, else of the one called Combined, beauty, rgba, rgb or default; other channels are dropped. Of several
// parts the first that has colour counts if it is the first of all, else the only one. An EXR that leaves a choice, and
// luminance-chroma images (Y, RY, BY), are refused by name.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// The largest width or height accepted, in pixels.
inline constexpr int kMaxImageSide = 65536;

// Decodes `bytes`; `name` is what error messages call the image (uri or "image 3") and becomes Image::name.
//
// `max_bytes` bounds Image::bytes(). The size is read from the file's header and checked before any pixel is
// allocated; what the format's library holds while decoding is a small multiple of it.
//
// `notices`, when given, gets a line for each part, layer or window of an EXR that was chosen or left out.
//
// Errors, `where` = name: invalid_argument (broken, truncated, deep, luminance-chroma or empty image, layers that leave
// a choice), unimplemented (unknown format, no reader for it in this OpenImageIO), resource_exhausted (larger than
// max_bytes or kMaxImageSide).
//
// `reserve`, if any, is called with what decoding holds at most, Image::bytes() or more, before that is allocated; its
// error is decode_image()'s. After another error the caller gives back what it reserved.
using ReserveBytes = std::function<Status(std::uint64_t bytes)>;
Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name, std::uint64_t max_bytes,
                           std::vector<std::string>* notices = nullptr, const ReserveBytes& reserve = {});

}  // namespace helio
