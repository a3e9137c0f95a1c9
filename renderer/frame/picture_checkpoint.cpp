#include "renderer/frame/picture_checkpoint.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include "renderer/base/check.h"
#include "renderer/frame/stages/allocate.h"
#include "renderer/frame/variant_parts.h"

namespace helio {
namespace {

constexpr std::string_view kMagic = "HELIOPIC";
// magic, version (32 bits), bytes of the head (32 bits), bytes in all (64 bits)
constexpr std::size_t kPrefix = 8 + 4 + 4 + 8;
constexpr std::size_t kAlignment = 64;  // of the pixels, from the beginning

std::size_t pixels_after(std::size_t head_bytes) {
  return (kPrefix + head_bytes + kAlignment - 1) / kAlignment * kAlignment;
}

template <class T>
T read_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

Error refused(ErrorCode code, const std::string& where, std::uint64_t value, const std::string& allowed) {
  return {code, std::to_string(value) + "; allowed: " + allowed, where};
}

// Errors of a checkpoint begin so, whoever has found them.
Error of_checkpoint(Error error) {
  error.where = error.where.empty() ? "checkpoint" : "checkpoint." + error.where;
  return error;
}

}  // namespace

bool can_checkpoint(const RenderSettings& settings) {
  return !variant_parts(settings) && FilmCopy::covers(film_state(settings));
}

std::uint64_t checkpoint_bytes(const RenderSettings& settings) {
  if (!can_checkpoint(settings)) return 0;
  const FilmState state = film_state(settings);
  return pixels_after(std::size_t(most_head_bytes(settings))) +
         FilmCopy(settings.width, settings.height, state, settings.rendered_region(), state.splats, true).bytes();
}

PictureCheckpoint::PictureCheckpoint(const RenderSettings& settings)
    : memory_(std::size_t(checkpoint_bytes(settings))) {
  HELIO_CHECK(can_checkpoint(settings));
}

void PictureCheckpoint::begin(PictureHead head, const FilmState& state) {
  head_ = std::move(head);
  film_.emplace(head_.width, head_.height, state, head_.region, head_.splats, head_.invalid);
  const std::vector<std::uint8_t> bytes = helio::encode(head_);
  pixels_at_ = pixels_after(bytes.size());
  size_ = pixels_at_ + std::size_t(film_->bytes());
  HELIO_CHECK(size_ <= memory_.size());
  std::uint8_t* to = memory_.data();
  const auto put = [&](const void* from, std::size_t count) {
    std::memcpy(to, from, count);
    to += count;
  };
  const auto head_bytes = std::uint32_t(bytes.size());
  const std::uint64_t all = size_;
  put(kMagic.data(), kMagic.size());
  put(&kVersion, sizeof kVersion);
  put(&head_bytes, sizeof head_bytes);
  put(&all, sizeof all);
  put(bytes.data(), bytes.size());
  std::fill(to, memory_.data() + pixels_at_, std::uint8_t(0));
}

Result<PictureCheckpoint> PictureCheckpoint::decode(std::vector<std::uint8_t> bytes, const RenderSettings& settings) {
  try {
    PictureCheckpoint checkpoint;
    checkpoint.memory_ = std::move(bytes);
    if (const Status ok = checkpoint.read(settings); !ok) return of_checkpoint(ok.error());
    return checkpoint;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::resource_exhausted, "no memory is left to read it with", "checkpoint"};
  }
}

Status PictureCheckpoint::read(const RenderSettings& settings) {
  if (!can_checkpoint(settings))
    return Error{ErrorCode::failed_precondition,
                 "mode " + std::string(to_string(settings.mode)) + " with variant " + to_string(settings.variant) +
                     " has none; allowed: modes pt and adaptive with variant bounded",
                 {}};
  size_ = memory_.size();
  if (size_ < kPrefix)
    return refused(ErrorCode::invalid_argument, "size", size_, "at least " + std::to_string(kPrefix) + " bytes");
  if (std::memcmp(memory_.data(), kMagic.data(), kMagic.size()) != 0)
    return Error{ErrorCode::invalid_argument, "does not begin with " + std::string(kMagic), "magic"};
  const auto version = read_at<std::uint32_t>(memory_, kMagic.size());
  if (version != kVersion)
    return refused(ErrorCode::failed_precondition, "version", version, std::to_string(kVersion));
  const auto head_bytes = read_at<std::uint32_t>(memory_, kMagic.size() + 4);
  const auto all = read_at<std::uint64_t>(memory_, kMagic.size() + 8);
  if (all != size_) return refused(ErrorCode::invalid_argument, "size", size_, std::to_string(all) + " bytes");
  if (head_bytes > size_ - kPrefix)
    return refused(ErrorCode::invalid_argument, "head", head_bytes,
                   "[0, " + std::to_string(size_ - kPrefix) + "] bytes");
  std::span<const std::uint8_t> rest(memory_.data() + kPrefix, head_bytes);
  auto head = decode_head(rest, settings);
  if (!head) return head.error();
  if (!rest.empty())
    return refused(ErrorCode::invalid_argument, "head", head_bytes,
                   std::to_string(head_bytes - rest.size()) + " bytes");
  head_ = std::move(head).value();
  film_.emplace(head_.width, head_.height, film_state(settings), head_.region, head_.splats, head_.invalid);
  pixels_at_ = pixels_after(head_bytes);
  const std::uint64_t expected = pixels_at_ + film_->bytes();
  if (size_ != expected)
    return refused(ErrorCode::invalid_argument, "size", size_, std::to_string(expected) + " bytes");
  if (auto ok = film_->check(pixels()); !ok) return ok;
  return check_counts();
}

// Whether pixels have the samples that the progress of their block says.
Status PictureCheckpoint::check_counts() const {
  const PixelRect& region = head_.region;
  const int columns = (region.x1 + kCellSize - 1) / kCellSize - region.x0 / kCellSize;
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      const int row = y / kCellSize - region.y0 / kCellSize, column = x / kCellSize - region.x0 / kCellSize;
      const CellProgress& cell = head_.cells[std::size_t(row * columns + column)];
      for (int h = 0; h < kHalves && cell.rendered; ++h) {
        const std::uint32_t has = film_->attempted(pixels(), h, x, y);
        // In a round a pixel takes part up to its target, and may have had more before.
        const bool round = head_.round.number > 0;
        const std::uint32_t least =
            round ? std::min(cell.done[h], film_->target(pixels(), h, x, y, head_.uniform)) : cell.done[h];
        if (has < least || (!round && has > least))
          return refused(ErrorCode::invalid_argument,
                         "samples of pixel (" + std::to_string(x) + ", " + std::to_string(y) + ")", has,
                         std::string(round ? "at least " : "") + std::to_string(least));
      }
    }
  }
  return ok_status();
}

Status PictureCheckpoint::suits(const RenderSettings& settings, const View& view) const {
  if (!film_ || head_.settings != settings_digest(settings))
    return Error{ErrorCode::failed_precondition, "others; allowed: those that its picture was begun with",
                 "checkpoint.settings"};
  if (head_.camera != camera_digest(fitted(view.camera, settings.width, settings.height)))
    return Error{ErrorCode::failed_precondition, "another; allowed: the one that its picture was begun with",
                 "checkpoint.view.camera"};
  return ok_status();
}

}  // namespace helio
