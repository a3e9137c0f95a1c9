#include "server/jobs/job_picture.h"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "server/jobs/message_json.h"
#include "server/stream/convert.h"

namespace helio {

JobPicture::JobPicture(MemoryAccount& memory, const TileFormat& format, std::function<void()> ended)
    : memory_(memory), format_(format), ended_(std::move(ended)) {}

Status JobPicture::reserve(const PixelRect& region) {
  auto memory = memory_.reserve_with_room(std::size_t(region.area()) * format_.planes() * sizeof(float),
                                          "the picture of a job", MemoryOwner::pictures);
  if (!memory) return memory.error();
  reserved_ = std::move(*memory);
  return ok_status();
}

std::optional<FrameEnd> JobPicture::end(std::uint64_t revision) {
  const std::lock_guard lock(mutex_);
  return end_ && end_->tag.revision == revision ? end_ : std::nullopt;
}

Result<std::vector<std::uint8_t>> JobPicture::encode(pb::PictureOrigin origin) {
  const std::lock_guard lock(mutex_);
  *origin.mutable_settings() = to_message(begin_.settings);
  const pb::FrameEnd end = to_message(FrameReport{*end_, 0, 0, {}}, {});
  origin.set_samples_per_pixel(end.totals().samples_per_pixel());
  origin.set_ended_by(end.reason());
  TileHeader header{picture_.window, begin_.settings.width, begin_.settings.height};
  header.comments = fmt::format("{}", fmt::join(begin_.unsampled, "\n"));
  auto json = to_json(origin);
  if (!json) return Error{ErrorCode::internal, json.error().message, kExrOrigin};
  header.origin = std::move(*json);
  return encode_picture(picture_, header, format_.encoding);
}

void JobPicture::frame_begun(const FrameBegin& begin) {
  const std::lock_guard lock(mutex_);
  begin_ = begin;
  end_.reset();
}

// What it throws fails the frame, with the reason.
void JobPicture::tile_ready(FrameTile tile) {
  if (!tile.final) return;
  const std::lock_guard lock(mutex_);
  if (picture_.window != begin_.region || picture_.planes.empty())
    picture_ = PicturePlanes(begin_.region, format_.channels);
  picture_.put(tile.pixels);
}

void JobPicture::frame_ended(const FrameEnd& end) {
  {
    const std::lock_guard lock(mutex_);
    end_ = end;
  }
  ended_();
}

}  // namespace helio
