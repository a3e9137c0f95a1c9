// What the checkpoint file of a job says of its body.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "renderer/base/result.h"

namespace helio {

struct CheckpointHeader {
  std::uint32_t view = 0;
  std::string build;      // rendering_build() of the attempt that wrote it
  bool same_bits = true;  // and so far every attempt ran on that one
  // The view is rendered: the body is its EXR file, and this its FrameEnd, serialized. Absent: the body is a
  // PictureCheckpoint.
  std::optional<std::string> frame_end;
  // Of a picture: how far it is, as a serialized pb::Progress, and when it was written, Unix time. Empty, 0: it was
  // written by a daemon that did not tell.
  std::string progress = {};
  double time_s = 0;

  std::string write() const;  // a sealed message of checkpoint_header.proto
  // internal, as a sentence about the checkpoint: its header is damaged or of another version.
  static Result<CheckpointHeader> read(const std::string& bytes);
};

}  // namespace helio
