// The picture that a checkpoint holds, to be looked at without going on with it.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/frame/frame_sink.h"
#include "renderer/frame/picture_checkpoint.h"

namespace helio {

class CheckpointPicture {
 public:
  // Of a picture of these settings, in a film of its own, which the checkpoint is copied into; it is not needed then.
  // Precondition: decode() made it for these settings. Throws std::bad_alloc.
  CheckpointPicture(const PictureCheckpoint& checkpoint, const RenderSettings& settings);

  // A part of the rendered region, resolved to these channels (ResolveChannels). The display layer is the film's.
  // Thread safe.
  FrameTile resolve(const PixelRect& window, unsigned channels) const;

  // As FrameProgress has it.
  std::uint32_t samples_per_pixel() const { return samples_per_pixel_; }

 private:
  std::shared_ptr<Film> film_;
  PixelRect region_;
  std::uint32_t samples_per_pixel_;
  double mean_samples_;  // that densities are relative to; 0: counts do not differ
};

// What a checkpoint says of how far its picture is: samples, time, error, rays.
FrameProgress progress_of(const PictureCheckpoint& checkpoint);

}  // namespace helio
