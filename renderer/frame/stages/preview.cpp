#include "renderer/frame/stages/preview.h"

namespace helio {

FrameTile PreviewStage::resolve(const ResolvePiece& piece, const FrameTag& tag) const {
  FrameTile tile;
  tile.tag = tag;
  tile.preview = tile.final = true;
  tile.pixels.window = piece.window;
  preview_.resolve(piece.window, tile.pixels.display);
  return tile;
}

}  // namespace helio
