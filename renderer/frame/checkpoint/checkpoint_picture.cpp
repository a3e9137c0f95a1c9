#include "renderer/frame/checkpoint/checkpoint_picture.h"

#include <algorithm>

#include "renderer/film/core/film.h"
#include "renderer/frame/render_loop.h"
#include "renderer/frame/stages/resolve.h"

namespace helio {

CheckpointPicture::CheckpointPicture(const PictureCheckpoint& checkpoint, const RenderSettings& settings)
    : film_(make_film(settings)),
      region_(checkpoint.head().region),
      samples_per_pixel_(progress_of(checkpoint).samples_per_pixel),
      mean_samples_(checkpoint.head().round.number > 0 ? double(checkpoint.samples()) / double(region_.area()) : 0) {
  for (std::size_t part = 0; part < checkpoint.film().parts(); ++part)
    checkpoint.film().load(checkpoint.pixels(), part, *film_);
  write_film(checkpoint.head(), *film_);
}

FrameTile CheckpointPicture::resolve(const PixelRect& window, unsigned channels) const {
  ResolvePiece piece;
  piece.window = window;
  piece.roi = region_;
  piece.samples_per_pixel = samples_per_pixel_;
  return run_resolve(piece, FrameTag(), channels, mean_samples_, *film_, nullptr);
}

FrameProgress progress_of(const PictureCheckpoint& checkpoint) {
  const PictureHead& head = checkpoint.head();
  const auto pixels = std::uint64_t(head.region.area());
  FrameProgress progress;
  progress.tag.view_id = head.view_id;
  progress.seconds = head.seconds;
  progress.samples_per_pixel = std::uint32_t(std::max<std::uint64_t>(1, (head.samples + pixels / 2) / pixels));
  progress.samples_per_second = head.seconds > 0 ? double(head.samples) / head.seconds : 0;
  progress.trace = head.trace;
  progress.error = head.measured.error;
  return progress;
}

}  // namespace helio
