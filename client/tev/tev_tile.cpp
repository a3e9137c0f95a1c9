#include "client/tev/tev_tile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

#include "client/tev/uncompressed_exr.h"
#include "renderer/codec/tile_codec.h"

namespace helio {

namespace {

constexpr const char* kError = "error";

// `Tile` has window(), find(name) and read_row(channel, y, out), as UncompressedExr has them.
template <class Tile>
Status read_planes(const Tile& tile, const PixelRect& window, const std::vector<std::string>& channels,
                   std::vector<float>& planes) {
  if (tile.window() != window) return Error{ErrorCode::invalid_argument, "is of another window", "tile"};
  const std::size_t width = std::size_t(window.width()), area = std::size_t(window.area());
  planes.resize(channels.size() * area);
  std::vector<float> variance;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    float* out = planes.data() + c * area;
    const bool is_error = channels[c] == kError;
    const int sources[3] = {tile.find(is_error ? "variance.R" : channels[c]), tile.find("variance.G"),
                            tile.find("variance.B")};
    if (sources[0] < 0 || (is_error && (sources[1] < 0 || sources[2] < 0))) {
      std::fill_n(out, area, std::numeric_limits<float>::quiet_NaN());
      continue;
    }
    if (!is_error) {
      for (int y = window.y0; y < window.y1; ++y, out += width) tile.read_row(sources[0], y, out);
      continue;
    }
    variance.resize(3 * width);
    for (int y = window.y0; y < window.y1; ++y, out += width) {
      for (std::size_t i = 0; i < 3; ++i) tile.read_row(sources[i], y, variance.data() + i * width);
      const float *r = variance.data(), *g = r + width, *b = g + width;
      for (std::size_t x = 0; x < width; ++x) out[x] = std::sqrt((r[x] + g[x] + b[x]) * (1 / 3.0f));
    }
  }
  return ok_status();
}

// A tile that OpenEXR has decoded, as UncompressedExr shows its own.
class DecodedRows {
 public:
  explicit DecodedRows(DecodedTile tile) : tile_(std::move(tile)) {}
  const PixelRect& window() const { return tile_.header.data_window; }
  int find(std::string_view name) const {
    const auto found = std::find(tile_.names.begin(), tile_.names.end(), name);
    return found == tile_.names.end() ? -1 : int(found - tile_.names.begin());
  }
  void read_row(int channel, int y, float* out) const {
    const std::size_t width = std::size_t(window().width());
    std::memcpy(out, tile_.channels[std::size_t(channel)].data() + std::size_t(y - window().y0) * width,
                width * sizeof(float));
  }

 private:
  DecodedTile tile_;
};

}  // namespace

std::vector<std::string> tev_channels(const heliograph::v1::TileFormat& format) {
  std::vector<std::string> channels{"R", "G", "B"};
  if (format.display()) channels.insert(channels.end(), {"display.R", "display.G", "display.B"});
  if (!format.without_variance()) channels.push_back(kError);
  if (!format.without_samples()) channels.push_back("samples");
  return channels;
}

Status read_tev_tile(std::string_view exr, const PixelRect& window, const std::vector<std::string>& channels,
                     std::vector<float>& planes) {
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(exr.data()), exr.size());
  if (const auto plain = UncompressedExr::open(bytes)) return read_planes(*plain, window, channels, planes);
  auto decoded = decode_tile(bytes, std::uint64_t(window.area()));
  if (!decoded) return decoded.error();
  return read_planes(DecodedRows(std::move(*decoded)), window, channels, planes);
}

}  // namespace helio
