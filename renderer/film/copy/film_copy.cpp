#include "renderer/film/copy/film_copy.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <type_traits>

#include "renderer/base/check.h"
#include "renderer/base/stream_copy.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/splats/splat_buffer.h"

namespace helio {
namespace {

static_assert(std::endian::native == std::endian::little);
// Every byte of them counts, and their order is that of the format.
static_assert(std::is_trivially_copyable_v<HalfPixel> && sizeof(HalfPixel) == 40);
static_assert(std::is_trivially_copyable_v<PixelFeatures> && sizeof(PixelFeatures) == 40);
static_assert(std::is_trivially_copyable_v<BlockWork> && sizeof(BlockWork) == 24);

constexpr int kPartColumns = 128 * kFilmBlock;  // by one row of blocks
constexpr std::uint64_t kAlignment = 64;        // of planes in the copy
constexpr std::uint32_t kMostSamples = 1u << 31;

template <class T>
T read(const std::uint8_t* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

std::string pixel_text(const char* what, int x, int y) {
  return std::string(what) + " of pixel (" + std::to_string(x) + ", " + std::to_string(y) + ")";
}

}  // namespace

bool FilmCopy::covers(const FilmState& state) {
  return !state.history && !state.exact_counts && !state.extension;
}

FilmCopy::FilmCopy(int width, int height, const FilmState& state, const PixelRect& region, bool splats, bool invalid)
    : width_(width), splats_(splats), invalid_(invalid) {
  HELIO_CHECK(covers(state) && (state.splats || !splats));
  constexpr int kMask = ~(kFilmBlock - 1);
  window_ = intersect({region.x0 & kMask, region.y0 & kMask, (region.x1 + kFilmBlock - 1) & kMask,
                       (region.y1 + kFilmBlock - 1) & kMask},
                      {0, 0, width, height});
  const auto add = [&](Kind kind, std::size_t element, int side = 1) {
    planes_[kind] = {element, side, bytes_};
    const auto columns = std::uint64_t((window_.width() + side - 1) / side);
    const auto rows = std::uint64_t((window_.height() + side - 1) / side);
    bytes_ += (columns * rows * element + kAlignment - 1) / kAlignment * kAlignment;
  };
  for (const Kind kind : {kHalfA, kHalfB}) add(kind, sizeof(HalfPixel));
  add(kFeatures, sizeof(PixelFeatures));
  for (const Kind kind : {kWorkA, kWorkB}) add(kind, sizeof(BlockWork), kFilmBlock);
  if (state.targets) {
    for (const Kind kind : {kCodesA, kCodesB}) add(kind, sizeof(std::uint8_t));
    for (const Kind kind : {kDemandA, kDemandB}) add(kind, sizeof(std::int16_t));
  }
  if (splats) {
    for (const Kind kind : {kSplatsA, kSplatsB}) add(kind, SplatBuffer::kSumBytes);
    add(kInvalidSplats, sizeof(std::uint32_t));
  }
  if (invalid) {
    for (const Kind kind : {kInvalidA, kInvalidB}) add(kind, sizeof(std::uint32_t));
  }
  parts_ = cut_aligned(window_, kPartColumns, kFilmBlock);
}

// Of the whole film; invalid: counts of invalid samples come into being.
std::array<std::uint8_t*, FilmCopy::kKinds> FilmCopy::memory_of(Film& film, bool invalid) {
  const auto bytes = [](auto* data) { return reinterpret_cast<std::uint8_t*>(data); };
  std::array<std::uint8_t*, kKinds> memory{};
  for (int h = 0; h < kHalves; ++h) {
    memory[std::size_t(kHalfA + h)] = bytes(film.halves_[h].data());
    memory[std::size_t(kWorkA + h)] = bytes(film.work_[h].data());
    if (film.targets_) {
      memory[std::size_t(kCodesA + h)] = film.targets_->codes(h);
      memory[std::size_t(kDemandA + h)] = bytes(film.targets_->demands(h));
    }
    if (film.splats_) memory[std::size_t(kSplatsA + h)] = film.splats_->sums(h);
    if (invalid) memory[std::size_t(kInvalidA + h)] = bytes(film.invalid_.of(h));
  }
  memory[kFeatures] = bytes(film.features_.data());
  if (film.splats_) memory[kInvalidSplats] = bytes(film.splats_->invalid());
  return memory;
}

// Where the element of a pixel lies in the copy.
std::uint64_t FilmCopy::at(Kind kind, int x, int y) const {
  const Plane& plane = planes_[kind];
  const auto columns = std::uint64_t((window_.width() + plane.side - 1) / plane.side);
  const auto column = std::uint64_t((x - window_.x0) / plane.side), row = std::uint64_t((y - window_.y0) / plane.side);
  return plane.offset + (row * columns + column) * plane.element;
}

// copy(plane's kind, offset in its memory, offset in the copy, bytes) of every row.
template <class Copy>
void FilmCopy::for_rows(std::size_t part, const Copy& copy) const {
  const PixelRect& window = parts_[part];
  for (std::size_t k = 0; k < kKinds; ++k) {
    const Plane& plane = planes_[k];
    if (plane.element == 0) continue;
    const int side = plane.side;
    const auto stride = std::size_t((width_ + side - 1) / side);
    const auto columns = std::size_t((window.width() + side - 1) / side);
    for (int y = window.y0; y < window.y1; y += side) {
      const std::size_t first = std::size_t(y / side) * stride + std::size_t(window.x0 / side);
      copy(k, first * plane.element, at(Kind(k), window.x0, y), columns * plane.element);
    }
  }
}

void FilmCopy::save(Film& film, std::size_t part, std::uint8_t* to) const {
  if (splats_) film.splats_->prepare_rows(parts_[part].y0, parts_[part].y1);
  const auto memory = memory_of(film, invalid_);
  for_rows(part, [&](std::size_t k, std::size_t in_film, std::uint64_t in_copy, std::size_t bytes) {
    stream_copy(to + in_copy, memory[k] + in_film, bytes);
  });
  end_stream_copies();
}

void FilmCopy::load(const std::uint8_t* from, std::size_t part, Film& film) const {
  const PixelRect& window = parts_[part];
  if (splats_) film.splats_->prepare_rows(window.y0, window.y1);
  if (!invalid_) {
    for (int y = window.y0; y < window.y1; ++y)
      film.invalid_.clear(film.index(window.x0, y), std::size_t(window.width()));
  }
  const auto memory = memory_of(film, invalid_);
  for_rows(part, [&](std::size_t k, std::size_t in_film, std::uint64_t in_copy, std::size_t bytes) {
    std::memcpy(memory[k] + in_film, from + in_copy, bytes);
  });
}

std::uint32_t FilmCopy::attempted(const std::uint8_t* from, int half, int x, int y) const {
  const auto pixel = read<HalfPixel>(from + at(Kind(kHalfA + half), x, y));
  return pixel.count + (invalid_ ? read<std::uint32_t>(from + at(Kind(kInvalidA + half), x, y)) : 0);
}

std::uint32_t FilmCopy::target(const std::uint8_t* from, int half, int x, int y, std::uint32_t uniform) const {
  return SampleTargets::count_of(from[at(Kind(kCodesA + half), x, y)], uniform);
}

Status FilmCopy::check(const std::uint8_t* from) const {
  const auto refused = [](std::string where, std::string message) {
    return Error{ErrorCode::invalid_argument, std::move(message), std::move(where)};
  };
  const auto count_refused = [&](const char* what, int x, int y, std::uint32_t count) {
    return refused(pixel_text(what, x, y), std::to_string(count) + "; allowed: [0, 2147483648]");
  };
  for (int y = window_.y0; y < window_.y1; ++y) {
    for (int x = window_.x0; x < window_.x1; ++x) {
      for (int h = 0; h < kHalves; ++h) {
        const auto pixel = read<HalfPixel>(from + at(Kind(kHalfA + h), x, y));
        for (int c = 0; c < 3; ++c) {
          if (!std::isfinite(pixel.sum[c]))
            return refused(pixel_text("sum", x, y), "is not finite; allowed: finite numbers");
          if (!(pixel.deviations[c] >= 0 && pixel.deviations[c] <= 0x1p127f))
            return refused(pixel_text("deviation", x, y),
                           std::to_string(pixel.deviations[c]) + "; allowed: [0, 2^127]");
        }
        if (pixel.count > kMostSamples) return count_refused("count", x, y, pixel.count);
        const std::uint32_t all = attempted(from, h, x, y);
        if (all < pixel.count || all > kMostSamples) return count_refused("samples", x, y, all);
        if (planes_[kCodesA].element > 0) {
          const std::uint8_t code = from[at(Kind(kCodesA + h), x, y)];
          if (!SampleTargets::is_code(code))
            return refused(pixel_text("target", x, y), "code " + std::to_string(code) + "; allowed: [0, 32], 255");
        }
      }
      const auto features = read<PixelFeatures>(from + at(kFeatures, x, y));
      if (features.count > kMostSamples) return count_refused("features", x, y, features.count);
      if (features.hits > features.count)
        return refused(pixel_text("hits", x, y),
                       std::to_string(features.hits) + "; allowed: [0, " + std::to_string(features.count) + "]");
    }
  }
  return ok_status();
}

}  // namespace helio
