#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>

#include "renderer/codec/dwa_scan.h"
#include "renderer/codec/exr_header_check.h"
#include "renderer/codec/exr_streams.h"
#include "renderer/codec/tile_codec.h"

namespace helio {
namespace {

constexpr std::size_t kMostChannels = 64;
constexpr std::int64_t kLargestCoordinate = std::int64_t(1) << 29;  // differences fit an int
constexpr int kMostRowsPerChunk = 256;                              // DWAB; no compression groups more

Error refuse(std::string message) {
  return {ErrorCode::invalid_argument, std::move(message), "exr"};
}

Status check_window(const char* name, const Imath::Box2i& w) {
  for (const std::int64_t v : {w.min.x, w.min.y, w.max.x, w.max.y}) {
    if (v < -kLargestCoordinate || v > kLargestCoordinate) {
      return refuse(std::string(name) + " has a corner at " + std::to_string(v) + ", allowed is [-2^29, 2^29]");
    }
  }
  if (w.max.x < w.min.x || w.max.y < w.min.y) return refuse(std::string(name) + " is empty");
  return ok_status();
}

Result<TileHeader> check_windows(const Imf::Header& header, std::uint64_t max_pixels, std::size_t file_bytes) {
  const Imath::Box2i &data = header.dataWindow(), &display = header.displayWindow();
  if (Status valid = check_window("dataWindow", data); !valid) return valid.error();
  if (Status valid = check_window("displayWindow", display); !valid) return valid.error();
  TileHeader tile;
  tile.data_window = {data.min.x - display.min.x, data.min.y - display.min.y, data.max.x - display.min.x + 1,
                      data.max.y - display.min.y + 1};
  tile.frame_width = display.max.x - display.min.x + 1;
  tile.frame_height = display.max.y - display.min.y + 1;
  if (const auto* comments = header.findTypedAttribute<Imf::StringAttribute>("comments"))
    tile.comments = comments->value();
  if (const auto* origin = header.findTypedAttribute<Imf::StringAttribute>(kExrOrigin)) tile.origin = origin->value();
  const std::uint64_t pixels = std::uint64_t(tile.data_window.area());
  if (pixels > max_pixels) {
    return refuse("data window of " + std::to_string(tile.data_window.width()) + " x " +
                  std::to_string(tile.data_window.height()) + " pixels, at most " + std::to_string(max_pixels) +
                  " pixels allowed");
  }
  // Every chunk has an offset of 8 bytes and begins with 8 bytes of its own.
  const std::uint64_t chunks = std::uint64_t(tile.data_window.height()) / kMostRowsPerChunk;
  if (chunks * 16 > file_bytes) return refuse("truncated: too few bytes for the rows of the data window");
  return tile;
}

Result<std::vector<std::string>> check_channels(const Imf::ChannelList& channels) {
  std::vector<std::string> names;
  for (auto it = channels.begin(); it != channels.end(); ++it) {
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
      return refuse("channel \"" + std::string(it.name()) + "\" is subsampled");
    }
    names.emplace_back(it.name());
  }
  if (names.empty() || names.size() > kMostChannels) {
    return refuse(std::to_string(names.size()) + " channels, 1 to " + std::to_string(kMostChannels) + " allowed");
  }
  return names;
}

// What has to hold of compressed chunks before the library reads them.
Status check_chunks(std::span<const std::uint8_t> bytes, std::size_t header_bytes, const Imf::Header& header) {
  std::size_t rows = 0;
  if (header.compression() == Imf::DWAA_COMPRESSION) rows = 32;
  if (header.compression() == Imf::DWAB_COMPRESSION) rows = 256;
  if (rows == 0) return ok_status();
  const Imath::Box2i& window = header.dataWindow();
  const std::size_t width = std::size_t(window.max.x - window.min.x) + 1;
  const std::size_t height = std::size_t(window.max.y - window.min.y) + 1;
  std::size_t pixel_bytes = 0;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    pixel_bytes += it.channel().type == Imf::HALF ? 2 : 4;
  }
  const std::size_t chunks = (height + rows - 1) / rows;
  const std::uint64_t last_rows = height - (chunks - 1) * rows;
  // The last chunk may have fewer rows.
  if (chunks > 1) {
    if (Status fit = scan_dwa_chunks(bytes, header_bytes, chunks - 1, rows * width * pixel_bytes); !fit) return fit;
  }
  return scan_dwa_chunks(bytes, header_bytes + 8 * (chunks - 1), 1, last_rows * width * pixel_bytes);
}

Result<DecodedTile> decode(std::span<const std::uint8_t> bytes, std::uint64_t max_pixels) {
  // The header alone comes first: opening the file already allocates by the window's height.
  Imf::Header header;
  std::size_t header_bytes = 0;
  {
    MemoryReader stream(bytes);
    stream.seekg(8);
    int version = 2;
    header.readFrom(stream, version);
    header_bytes = std::size_t(stream.tellg());
  }
  Result<TileHeader> windows = check_windows(header, max_pixels, bytes.size());
  if (!windows) return windows.error();
  Result<std::vector<std::string>> names = check_channels(header.channels());
  if (!names) return names.error();
  if (Status plausible = check_chunks(bytes, header_bytes, header); !plausible) return plausible.error();

  MemoryReader stream(bytes);
  constexpr int kNoThreads = 0;
  Imf::InputFile file(stream, kNoThreads);
  if (!file.isComplete()) return refuse("truncated: chunks are missing");
  DecodedTile tile;
  tile.header = *windows;
  tile.names = std::move(*names);
  const Imath::Box2i& window = file.header().dataWindow();
  const std::size_t width = std::size_t(tile.header.data_window.width());
  Imf::FrameBuffer frame;
  for (const std::string& name : tile.names) {
    std::vector<float>& values = tile.channels.emplace_back(std::size_t(tile.header.data_window.area()));
    frame.insert(name, Imf::Slice::Make(Imf::FLOAT, values.data(), window, sizeof(float), sizeof(float) * width));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return tile;
}

}  // namespace

const std::vector<float>* DecodedTile::find(std::string_view name) const {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return &channels[i];
  }
  return nullptr;
}

Result<DecodedTile> decode_tile(std::span<const std::uint8_t> bytes, std::uint64_t max_pixels) {
  if (Status usable = check_exr_header(bytes); !usable) return usable.error();
  try {
    return decode(bytes, max_pixels);
  } catch (const std::exception& e) {
    return refuse(e.what());
  }
}

}  // namespace helio
