#include "renderer/frame/stages/resolve.h"

namespace helio {

void ResolvePass::begin_frame(std::size_t tiles) {
  tile_final_.assign(tiles, false);
  final_tiles_ = 0;
  rounds_ = 0;
  stop();
}

void ResolvePass::begin(const FramePlan& plan, const TileGrid& grid) {
  publish_ = plan.publish;
  final_ = plan.final;
  mean_samples_ = plan.mean_samples;
  stop();
  if (publish_ == Publish::none) return;
  round_ = rounds_++;
  if (publish_ != Publish::round) return;
  for (std::uint32_t t = 0; t < grid.tiles().size(); ++t) {
    if (!tile_final_[t]) waiting_.push_back(t);
  }
}

std::optional<ResolvePiece> ResolvePass::next(const TileGrid& grid) {
  if (!any_open()) return std::nullopt;
  ResolvePiece piece;
  piece.tile = waiting_[next_++];
  const Tile& tile = grid.tiles()[piece.tile];
  piece.window = tile.window;
  piece.roi = publish_ == Publish::early ? tile.window : grid.region();
  piece.samples_per_pixel = mean_samples_ > 0 ? mean_samples_ : grid.samples_in(tile);
  piece.round = round_;
  piece.final = final_;
  if (final_ && !tile_final_[piece.tile]) {
    tile_final_[piece.tile] = true;
    ++final_tiles_;
  }
  ++in_flight_;
  return piece;
}

FrameTile run_resolve(const ResolvePiece& piece, const FrameTag& tag, unsigned channels, double mean_samples,
                      const Film& film, const DisplayLayer* display) {
  FrameTile tile;
  tile.tag = tag;
  tile.pass = piece.round;
  tile.final = piece.final;
  tile.samples_per_pixel = piece.samples_per_pixel;
  tile.pixels = resolve_tile(film, piece.window, piece.roi, channels, mean_samples);
  if (channels & kResolveDisplay) DisplayLayer::resolve(display, film, tile.pixels);
  return tile;
}

}  // namespace helio
