#include "renderer/frame/stages/preview.h"

#include "renderer/preview/paper/paper_preview.h"
#include "renderer/preview/preview.h"

namespace helio {

namespace {

std::unique_ptr<PreviewMaker> make_preview(std::shared_ptr<PreviewHistory> history, PreviewTarget target,
                                           std::shared_ptr<const CancelToken> cancel) {
  if (target.published)
    return std::make_unique<PaperPreview>(std::move(history), std::move(target), std::move(cancel));
  return std::make_unique<Preview>(std::move(history), std::move(target), std::move(cancel));
}

}  // namespace

PreviewStage::PreviewStage(std::shared_ptr<PreviewHistory> history, PreviewTarget target,
                           std::shared_ptr<const CancelToken> cancel)
    : FrameStage(StageId::preview),
      preview_(make_preview(std::move(history), std::move(target), std::move(cancel))) {}

FrameTile PreviewStage::resolve(const ResolvePiece& piece, const FrameTag& tag) const {
  FrameTile tile;
  tile.tag = tag;
  tile.preview = tile.final = true;
  tile.pixels.window = piece.window;
  preview_->resolve(piece.window, tile.pixels.display);
  return tile;
}

}  // namespace helio
