// Four pixels of a preview, one in each lane: what a bilinear lookup reads.
#pragma once

#include "renderer/film/core/lanes.h"
#include "renderer/preview/preview_pixel.h"

namespace helio {

class PreviewTaps {
 public:
  PreviewTaps(const PreviewPixel& a, const PreviewPixel& b, const PreviewPixel& c, const PreviewPixel& d) {
    load(&a, words_[0]);
    load(&b, words_[1]);
    load(&c, words_[2]);
    load(&d, words_[3]);
    transpose(words_);
  }

  // As same_surface() of pixels; all bits where it holds, else none.
  Int4 same_surface(const PreviewPixel& pixel, float depth, float slack) const {
    const Float4 apart = (Float4)((UInt4)((Float4)words_[0] - depth) & 0x7fffffffu);
    const Float4 cosine = normal(0) * float(pixel.normal[0]) + normal(1) * float(pixel.normal[1]) +
                          normal(2) * float(pixel.normal[2]);
    return ((words_[1] & 0xffffu) == std::uint32_t(pixel.surface)) & (apart <= slack) & (cosine > float(kLeastCosine));
  }
  // One channel, as unpack_half().
  Float4 light(int c) const {
    const UInt4 half = c == 0 ? words_[1] >> 16 : c == 1 ? words_[2] & 0xffffu : words_[2] >> 16;
    return (Float4)(half << 13) * 0x1p112f;
  }
  Float4 samples() const { return __builtin_convertvector(words_[3] >> 24 & std::uint32_t(kExactSamples), Float4); }

 private:
  // In 127ths.
  Float4 normal(int c) const { return __builtin_convertvector((Int4)(words_[3] << (24 - 8 * c)) >> 24, Float4); }

  UInt4 words_[4];
};

}  // namespace helio
