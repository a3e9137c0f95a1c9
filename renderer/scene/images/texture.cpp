#include "renderer/scene/images/texture.h"

#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "renderer/base/check.h"
#include "renderer/base/prefetch.h"

namespace helio {
namespace {

// Linear values of 8-bit codes, as stored and sRGB-encoded.
struct ByteTables {
  float unit[256], srgb[256];

  ByteTables() {
    for (int i = 0; i < 256; ++i) {
      unit[i] = float(i) / 255.0f;
      srgb[i] = srgb_to_linear(unit[i]);
    }
  }
};
const ByteTables kBytes;

// The same for sRGB-encoded 16-bit codes: made when the first table with 16-bit images is.
const float* srgb_u16 = nullptr;

void make_srgb_u16() {
  static const std::vector<float> table = [] {
    std::vector<float> values(65536);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = srgb_to_linear(float(i) / 65535.0f);
    return values;
  }();
  static const bool published = (srgb_u16 = table.data(), true);
  (void)published;
}

// One channel of the texel at an address; alpha is never sRGB-encoded.
template <TexelFormat Format, bool Srgb>
float channel_value(const std::uint8_t* texel, int channel, bool alpha) {
  const bool coded = Srgb && !alpha;
  if constexpr (Format == TexelFormat::u8) {
    return (coded ? kBytes.srgb : kBytes.unit)[texel[channel]];
  } else if constexpr (Format == TexelFormat::u16) {
    std::uint16_t value;
    std::memcpy(&value, texel + 2 * channel, 2);
    return coded ? srgb_u16[value] : float(value) / 65535.0f;
  } else if constexpr (Format == TexelFormat::f16) {
    std::uint16_t bits;
    std::memcpy(&bits, texel + 2 * channel, 2);
    const float value = imath_half_to_float(bits);
    return coded ? srgb_to_linear(value) : value;
  } else {
    float value;
    std::memcpy(&value, texel + 4 * channel, 4);
    return coded ? srgb_to_linear(value) : value;
  }
}

// The texel at an address. A type for each kind, so that taps are read in place. Channels: of the image, where that is
// known here; 0: `channels` are.
template <TexelFormat Format, bool Srgb, int Channels = 0>
struct TexelReader {
  V4f operator()(const std::uint8_t* texel, int channels) const {
    if constexpr (Channels != 0) channels = Channels;
    const auto get = [&](int channel, bool alpha) { return channel_value<Format, Srgb>(texel, channel, alpha); };
    if (channels >= 3) return {get(0, false), get(1, false), get(2, false), channels == 4 ? get(3, true) : 1.0f};
    const float grey = get(0, false);
    return {grey, grey, grey, channels == 2 ? get(1, true) : 1.0f};
  }
};

constexpr std::size_t bytes_of(TexelFormat format) {
  return format == TexelFormat::u8 ? 1 : format == TexelFormat::f32 ? 4 : 2;
}

// A coordinate that arithmetic survives: NaN, infinity and values without fractional bits become 0.
float safe_coordinate(float u) {
  return std::abs(u) < 1e9f ? u : 0.0f;
}

// Maps a coordinate into [0, 1], the range in which the neighbours of a texel are its neighbours under the wrap mode
// (repeat: modulo the size; clamp and mirror: clamped).
float fold(float u, WrapMode wrap) {
  switch (wrap) {
    case WrapMode::repeat: {
      const float f = u - std::floor(u);
      return f < 1.0f ? f : 0.0f;
    }
    case WrapMode::mirror: {
      const float f = u - 2.0f * std::floor(0.5f * u);
      return f > 1.0f ? 2.0f - f : f;
    }
    case WrapMode::clamp:
      break;
  }
  return std::clamp(u, 0.0f, 1.0f);
}

int wrap_index(int i, int size, WrapMode wrap) {
  if (wrap == WrapMode::repeat) return i < 0 ? i + size : i >= size ? i - size : i;
  return std::clamp(i, 0, size - 1);
}

// The two texels and the weight of the second, along one axis.
struct Taps {
  int first, second;
  float weight;
};

Taps bilinear_taps(float u, int size, WrapMode wrap) {
  const float x = fold(u, wrap) * float(size) - 0.5f;
  const float low = std::floor(x);
  const int i = int(low);
  return {wrap_index(i, size, wrap), wrap_index(i + 1, size, wrap), x - low};
}

int nearest_tap(float u, int size, WrapMode wrap) {
  return std::min(int(fold(u, wrap) * float(size)), size - 1);
}

V4f mix(const V4f& a, const V4f& b, float t) {
  return a * (1.0f - t) + b * t;
}

template <class Fetch>
V4f filter_bilinear(const Taps& x, const Taps& y, const Fetch& fetch) {
  const V4f top = mix(fetch(x.first, y.first), fetch(x.second, y.first), x.weight);
  const V4f bottom = mix(fetch(x.first, y.second), fetch(x.second, y.second), x.weight);
  return mix(top, bottom, y.weight);
}

// f(read) where read(pointer, channels) -> V4f. The choice is made once per lookup, not once per texel.
template <TexelFormat Format, int Channels = 0, class F>
V4f with_encoding(TexelEncoding encoding, const F& f) {
  return encoding == TexelEncoding::srgb ? f(TexelReader<Format, true, Channels>())
                                         : f(TexelReader<Format, false, Channels>());
}
template <class F>
V4f with_reader(TexelFormat format, TexelEncoding encoding, int channels, const F& f) {
  switch (format) {
    case TexelFormat::u8:
      return channels == 3   ? with_encoding<TexelFormat::u8, 3>(encoding, f)
             : channels == 4 ? with_encoding<TexelFormat::u8, 4>(encoding, f)
                             : with_encoding<TexelFormat::u8>(encoding, f);
    case TexelFormat::u16:
      return with_encoding<TexelFormat::u16>(encoding, f);
    case TexelFormat::f16:
      return with_encoding<TexelFormat::f16>(encoding, f);
    case TexelFormat::f32:
      break;
  }
  return with_encoding<TexelFormat::f32>(encoding, f);
}

// Compares stored alpha with the bits of 1 in the image's format.
bool has_alpha_below_one(const Image& image) {
  if (image.channels != 2 && image.channels != 4) return false;
  const std::size_t size = bytes_of(image.format), stride = size * std::size_t(image.channels);
  std::uint8_t one[4] = {0xff, 0xff, 0, 0};
  const half half_one(1.0f);
  const float float_one = 1.0f;
  if (image.format == TexelFormat::f16) std::memcpy(one, &half_one, 2);
  if (image.format == TexelFormat::f32) std::memcpy(one, &float_one, 4);
  for (std::size_t at = stride - size; at < image.texels.size(); at += stride) {
    if (std::memcmp(image.texels.data() + at, one, size) != 0) return true;
  }
  return false;
}

// One level halved by exact area averages: sizes that do not divide evenly share texels by coverage.
std::vector<V4f> halve(const std::vector<V4f>& from, int width, int height, int new_width, int new_height) {
  std::vector<V4f> rows(std::size_t(new_width) * std::size_t(height));
  const auto average = [](int size, int new_size, auto&& read, auto&& write) {
    const double step = double(size) / new_size;
    for (int i = 0; i < new_size; ++i) {
      const double begin = i * step, end = (i + 1) * step;
      V4f sum(0, 0, 0, 0);
      for (int j = int(begin); j < size && j < end; ++j) {
        const double covered = std::min(end, j + 1.0) - std::max(begin, double(j));
        sum += read(j) * float(covered / step);
      }
      write(i, sum);
    }
  };
  for (int y = 0; y < height; ++y) {
    average(
        width, new_width, [&](int x) { return from[std::size_t(y) * width + x]; },
        [&](int x, const V4f& value) { rows[std::size_t(y) * new_width + x] = value; });
  }
  std::vector<V4f> to(std::size_t(new_width) * std::size_t(new_height));
  for (int x = 0; x < new_width; ++x) {
    average(
        height, new_height, [&](int y) { return rows[std::size_t(y) * new_width + x]; },
        [&](int y, const V4f& value) { to[std::size_t(y) * new_width + x] = value; });
  }
  return to;
}

}  // namespace

float srgb_to_linear(float encoded) {
  const float magnitude = std::abs(encoded);
  const float linear = magnitude <= 0.04045f ? magnitude / 12.92f : std::pow((magnitude + 0.055f) / 1.055f, 2.4f);
  return std::copysign(linear, encoded);
}

float linear_to_srgb(float linear) {
  const float magnitude = std::abs(linear);
  const float encoded =
      magnitude <= 0.0031308f ? magnitude * 12.92f : 1.055f * std::pow(magnitude, 1.0f / 2.4f) - 0.055f;
  return std::copysign(encoded, linear);
}

// Levels 1 and up in linear light; level 0 is the image itself.
struct TextureTable::Pyramid {
  struct Level {
    int width = 0, height = 0;
    std::vector<V4f> texels;
  };
  std::vector<Level> levels;

  V4f lookup(const TextureSlot& slot, const V2f& uv, int level) const {
    const Level& l = levels[std::size_t(level - 1)];
    return filter_bilinear(bilinear_taps(uv.x, l.width, slot.wrap_u), bilinear_taps(uv.y, l.height, slot.wrap_v),
                           [&](int x, int y) { return l.texels[std::size_t(y) * std::size_t(l.width) + x]; });
  }
};

TextureTable::TextureTable(std::span<const Image> images, const TextureOptions& options) {
  views_.reserve(images.size());
  for (const Image& image : images) {
    HELIO_DCHECK(image.texels.size() ==
                 std::size_t(image.width) * image.height * image.channels * bytes_of(image.format));
    if (image.format == TexelFormat::u16) make_srgb_u16();
    views_.push_back(
        {image.texels.data(), image.width, image.height, image.channels, image.format, has_alpha_below_one(image)});
  }
  if (options.mip_mapped.empty()) return;
  pyramids_.resize(images.size());
  for (const TextureSlot& slot : options.mip_mapped) {
    std::unique_ptr<const Pyramid>& place = pyramids_[std::size_t(slot.image)][std::size_t(slot.encoding)];
    if (place) continue;
    auto pyramid = std::make_unique<Pyramid>();
    int width = this->width(slot.image), height = this->height(slot.image);
    std::vector<V4f> base(std::size_t(width) * std::size_t(height));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) base[std::size_t(y) * width + x] = texel(slot.image, slot.encoding, x, y);
    }
    while (width > 1 || height > 1) {
      const int new_width = std::max(1, width / 2), new_height = std::max(1, height / 2);
      const std::vector<V4f>& from = pyramid->levels.empty() ? base : pyramid->levels.back().texels;
      std::vector<V4f> texels = halve(from, width, height, new_width, new_height);
      pyramid->levels.push_back({new_width, new_height, std::move(texels)});
      width = new_width;
      height = new_height;
    }
    place = std::move(pyramid);
  }
}

TextureTable::~TextureTable() = default;

V4f TextureTable::lookup(const TextureSlot& slot, const V2f& uv) const {
  HELIO_DCHECK(slot.present() && std::size_t(slot.image) < views_.size());
  const View& view = views_[std::size_t(slot.image)];
  const V2f t = transform_uv(slot, uv);
  const float u = safe_coordinate(t.x), v = safe_coordinate(t.y);
  if (slot.filter == FilterMode::nearest) {
    const int x = nearest_tap(u, view.width, slot.wrap_u), y = nearest_tap(v, view.height, slot.wrap_v);
    return texel(slot.image, slot.encoding, x, y);
  }
  const Taps x = bilinear_taps(u, view.width, slot.wrap_u), y = bilinear_taps(v, view.height, slot.wrap_v);
  const std::size_t stride = std::size_t(view.channels) * bytes_of(view.format);
  return with_reader(view.format, slot.encoding, view.channels, [&](auto read) {
    return filter_bilinear(x, y, [&](int column, int row) {
      const std::size_t index = std::size_t(row) * std::size_t(view.width) + std::size_t(column);
      return read(view.texels + index * stride, view.channels);
    });
  });
}

void TextureTable::prefetch(const TextureSlot& slot, const V2f& uv) const {
  const View& view = views_[std::size_t(slot.image)];
  const V2f t = transform_uv(slot, uv);
  const Taps x = bilinear_taps(safe_coordinate(t.x), view.width, slot.wrap_u);
  const Taps y = bilinear_taps(safe_coordinate(t.y), view.height, slot.wrap_v);
  const std::size_t stride = std::size_t(view.channels) * bytes_of(view.format);
  for (const int row : {y.first, y.second})
    helio::prefetch(view.texels + (std::size_t(row) * std::size_t(view.width) + std::size_t(x.first)) * stride);
}

V4f TextureTable::lookup(const TextureSlot& slot, const V2f& uv, float width_uv) const {
  const Pyramid* pyramid =
      pyramids_.empty() ? nullptr : pyramids_[std::size_t(slot.image)][std::size_t(slot.encoding)].get();
  if (!pyramid || slot.filter == FilterMode::nearest) return lookup(slot, uv);
  const std::array<float, 6>& m = slot.uv_transform;
  const float width_x = std::hypot(m[0], m[1]) * float(width(slot.image));
  const float width_y = std::hypot(m[3], m[4]) * float(height(slot.image));
  const float texels = width_uv * std::max(width_x, width_y);
  if (!(texels > 1.0f)) return lookup(slot, uv);

  const int last = int(pyramid->levels.size());
  const float level = std::min(std::log2(texels), float(last));
  const int low = int(level);
  V2f t = transform_uv(slot, uv);
  t = {safe_coordinate(t.x), safe_coordinate(t.y)};
  const V4f fine = low == 0 ? lookup(slot, uv) : pyramid->lookup(slot, t, low);
  return low == last ? fine : mix(fine, pyramid->lookup(slot, t, low + 1), level - float(low));
}

V4f TextureTable::texel(int image, TexelEncoding encoding, int x, int y) const {
  const View& view = views_[std::size_t(image)];
  const std::size_t stride = std::size_t(view.channels) * bytes_of(view.format);
  const std::uint8_t* at = view.texels + (std::size_t(y) * std::size_t(view.width) + std::size_t(x)) * stride;
  return with_reader(view.format, encoding, view.channels, [&](auto read) { return read(at, view.channels); });
}

V4f TextureTable::mean(int image, TexelEncoding encoding) const {
  const View& view = views_[std::size_t(image)];
  const std::size_t stride = std::size_t(view.channels) * bytes_of(view.format);
  const std::size_t count = std::size_t(view.width) * std::size_t(view.height);
  return with_reader(view.format, encoding, view.channels, [&](auto read) {
    Imath::Vec4<double> sum(0, 0, 0, 0);
    for (std::size_t i = 0; i < count; ++i) sum += Imath::Vec4<double>(read(view.texels + i * stride, view.channels));
    return V4f(sum / double(count));
  });
}

std::size_t TextureTable::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + views_.capacity() * sizeof(View);
  for (const auto& pair : pyramids_) {
    for (const auto& pyramid : pair) {
      if (!pyramid) continue;
      for (const auto& level : pyramid->levels) bytes += level.texels.capacity() * sizeof(V4f);
    }
  }
  return bytes;
}

}  // namespace helio
