#include "client/frame_assembler.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <span>

#include "renderer/codec/checksum.h"
#include "renderer/codec/tile_codec.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

constexpr std::int64_t kMaxPixels = std::int64_t(1) << 31;

PixelRect to_rect(const pb::Rect& rect) {
  return {rect.x0(), rect.y0(), rect.x1(), rect.y1()};
}

std::string describe(const PixelRect& r) {
  return fmt::format("[{}, {}) x [{}, {})", r.x0, r.x1, r.y0, r.y1);
}

std::string place(const PixelRect& window) {
  return "tile " + describe(window);
}

bool inside(const PixelRect& inner, const PixelRect& outer) {
  return intersect(inner, outer) == inner;
}

}  // namespace

Status FrameAssembler::begin(const pb::RenderSettings& settings) {
  *this = FrameAssembler();
  const PixelRect frame{0, 0, settings.width(), settings.height()};
  const PixelRect window = settings.has_region() ? to_rect(settings.region()) : frame;
  if (frame.empty() || frame.area() > kMaxPixels || window.empty() || !inside(window, frame)) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("the server announced a frame of {}x{} with region {}", settings.width(),
                             settings.height(), describe(window)),
                 "frame_begin.settings"};
  }
  picture_.frame_width = settings.width();
  picture_.frame_height = settings.height();
  picture_.window = window;
  return ok_status();
}

Status FrameAssembler::begin(const pb::FrameBegin& frame) {
  Status begun = begin(frame.settings());
  if (!begun) return begun;
  revision_known_ = true;
  revision_ = frame.tag().revision();
  preview_ = frame.preview();
  return ok_status();
}

Result<FrameAssembler::Outcome> FrameAssembler::add(pb::Tile tile) {
  const PixelRect window = to_rect(tile.window());
  if (picture_.window.empty()) return Error{ErrorCode::internal, "came before its frame", place(window)};
  if (tile.preview() != preview_) {
    const char* message =
        preview_ ? "is the film's, where a preview is shown" : "is a preview's, where the film is shown";
    return Error{ErrorCode::internal, message, place(window)};
  }
  if (!revision_known_) {
    revision_known_ = true;
    revision_ = tile.tag().revision();
  }
  if (tile.tag().revision() < revision_) {
    ++stale_;
    return Outcome::stale;
  }
  if (tile.tag().revision() > revision_) {
    return Error{
        ErrorCode::internal,
        fmt::format("is of revision {}, which has not begun (revision {} is shown)", tile.tag().revision(), revision_),
        place(window)};
  }
  if (window.empty() || !inside(window, picture_.window)) {
    return Error{ErrorCode::internal, "lies outside the region " + describe(picture_.window), place(window)};
  }
  if (!tile.jpeg().empty()) return Error{ErrorCode::internal, "is a JPEG, where an EXR is needed", place(window)};
  if (tile.exr().empty()) return Error{ErrorCode::internal, "is empty", place(window)};
  const std::uint32_t found = crc32_of(tile.exr().data(), tile.exr().size());
  if (found != tile.crc32()) {
    return Error{ErrorCode::internal, fmt::format("checksum {:08x} where {:08x} was announced", found, tile.crc32()),
                 place(window)};
  }

  Slot* slot = find(window);
  if (slot && tile.pass() < slot->pass) {
    ++stale_;
    return Outcome::stale;
  }
  if (!slot) {
    if (overlaps_another(window)) return Error{ErrorCode::internal, "overlaps another tile", place(window)};
    by_corner_.emplace(std::pair(window.x0, window.y0), slots_.size());
    slot = &slots_.emplace_back();
    slot->window = window;
    covered_ += window.area();
  }
  slot->pass = tile.pass();
  slot->samples_per_pixel = tile.samples_per_pixel();
  slot->invalid_samples = tile.invalid_samples();
  slot->final = tile.final();
  slot->pending = std::move(*tile.mutable_exr());
  ++tiles_;
  bytes_ += slot->pending.size();
  return Outcome::taken;
}

Status FrameAssembler::decode(Slot& slot) {
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(slot.pending.data()),
                                            slot.pending.size());
  const Result<DecodedTile> decoded = decode_tile(bytes, static_cast<std::uint64_t>(slot.window.area()));
  if (!decoded) return Error{ErrorCode::internal, decoded.error().to_string(), place(slot.window)};
  const TileHeader& header = decoded->header;
  if (header.data_window != slot.window || header.frame_width != picture_.frame_width ||
      header.frame_height != picture_.frame_height) {
    return Error{ErrorCode::internal,
                 fmt::format("holds the window {} of a {}x{} frame", describe(header.data_window), header.frame_width,
                             header.frame_height),
                 place(slot.window)};
  }
  if (picture_.planes.empty()) {
    picture_.names = decoded->names;
    picture_.planes.assign(picture_.names.size(), std::vector<float>(picture_.window.area(), 0.0f));
  }
  if (decoded->names != picture_.names) {
    return Error{ErrorCode::internal, "has other channels than the tiles before it", place(slot.window)};
  }
  const std::size_t row_length = static_cast<std::size_t>(slot.window.width());
  for (std::size_t c = 0; c < picture_.planes.size(); ++c) {
    for (int y = slot.window.y0; y < slot.window.y1; ++y) {
      const float* from = decoded->channels[c].data() + std::size_t(y - slot.window.y0) * row_length;
      float* to = picture_.planes[c].data() + std::size_t(y - picture_.window.y0) * picture_.window.width() +
                  (slot.window.x0 - picture_.window.x0);
      std::copy_n(from, row_length, to);
    }
  }
  slot.pending.clear();
  slot.pending.shrink_to_fit();
  return ok_status();
}

Result<const Picture*> FrameAssembler::picture() {
  for (Slot& slot : slots_) {
    if (slot.pending.empty()) continue;
    Status decoded = decode(slot);
    if (!decoded) return decoded.error();
  }
  return &picture_;
}

FrameAssembler::Slot* FrameAssembler::find(const PixelRect& window) {
  const auto at = by_corner_.find({window.x0, window.y0});
  return at != by_corner_.end() && slots_[at->second].window == window ? &slots_[at->second] : nullptr;
}

bool FrameAssembler::overlaps_another(const PixelRect& window) const {
  return std::any_of(slots_.begin(), slots_.end(),
                     [&](const Slot& slot) { return !intersect(slot.window, window).empty(); });
}

std::uint64_t FrameAssembler::invalid_samples() const {
  std::uint64_t total = 0;
  for (const Slot& slot : slots_) total += slot.invalid_samples;
  return total;
}

bool FrameAssembler::complete() const {
  return !picture_.window.empty() && covered_ == picture_.window.area();
}

bool FrameAssembler::final() const {
  return complete() && std::all_of(slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.final; });
}

std::uint32_t FrameAssembler::samples_per_pixel() const {
  if (!complete()) return 0;
  std::uint32_t least = ~0u;
  for (const Slot& slot : slots_) least = std::min(least, slot.samples_per_pixel);
  return least;
}

}  // namespace helio
