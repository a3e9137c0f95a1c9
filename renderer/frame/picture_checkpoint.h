// A picture between two plans, as bytes that can be stored: all that a RenderLoop needs to go on with it, in another
// process and with other threads, as if it had never been left. A budget of samples or of an error then ends with the
// bits that the picture would have had anyway; of a time budget the seconds count that were used before.
//
// The bytes are a prefix (magic, version, sizes), the head (checkpoint/picture_head.h) and a FilmCopy of the region.
// There is no checksum: that is for the file that holds them. decode() refuses what does not fit the settings; what it
// lets through may be wrong, but nothing stumbles over it.
//
// Modes that reuse pictures (reproject, combined) and variant paper have no checkpoints: their pictures depend on those
// before. Pixels of vcm and photon are as exact as all others, but the last bits of the bias that they estimate, and so
// of the error that a budget looks at, depend on the order of the work, with checkpoints and without.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/film/copy/film_copy.h"
#include "renderer/frame/checkpoint/picture_head.h"
#include "renderer/frame/render_settings.h"

namespace helio {

// Whether pictures of these settings have checkpoints.
bool can_checkpoint(const RenderSettings& settings);
// Memory that a checkpoint takes at most, and with it a render loop that makes some; 0 where there are none.
std::uint64_t checkpoint_bytes(const RenderSettings& settings);

class PictureCheckpoint {
 public:
  static constexpr std::uint32_t kVersion = 1;

  // checkpoint_bytes(), every page touched, for checkpoints to be made in. Precondition: can_checkpoint(settings).
  // Throws std::bad_alloc.
  explicit PictureCheckpoint(const RenderSettings& settings);
  PictureCheckpoint(PictureCheckpoint&&) noexcept = default;
  PictureCheckpoint& operator=(PictureCheckpoint&&) noexcept = default;

  // The whole of it. Nothing is copied: the bytes live as long as this.
  std::span<const std::uint8_t> encode() const { return {memory_.data(), size_}; }
  // Of a picture of these settings, which are valid; keeps the bytes it is given. failed_precondition: another version
  // or other settings; invalid_argument: damaged bytes; resource_exhausted: no memory. Places begin with "checkpoint".
  static Result<PictureCheckpoint> decode(std::vector<std::uint8_t> bytes, const RenderSettings& settings);

  // Whether a picture of this view with these settings may go on from it; else failed_precondition says what differs.
  Status suits(const RenderSettings& settings, const View& view) const;

  const PictureHead& head() const { return head_; }
  std::uint64_t view_id() const { return head_.view_id; }
  double seconds() const { return head_.seconds; }         // of wall time that the picture has taken
  std::uint64_t samples() const { return head_.samples; }  // of all pixels, both halves

  // Begins another one in the same memory, which is of these settings. Complete once film() has saved all of its parts
  // to pixels().
  void begin(PictureHead head, const FilmState& state);
  const FilmCopy& film() const { return *film_; }
  std::uint8_t* pixels() { return memory_.data() + pixels_at_; }
  const std::uint8_t* pixels() const { return memory_.data() + pixels_at_; }

  std::size_t bytes() const { return memory_.capacity(); }

 private:
  PictureCheckpoint() = default;
  Status read(const RenderSettings& settings);
  Status check_counts() const;

  std::vector<std::uint8_t> memory_;
  std::size_t size_ = 0, pixels_at_ = 0;
  PictureHead head_;
  std::optional<FilmCopy> film_;  // absent: none was begun
};

}  // namespace helio
