#include "server/compare/reference_store.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/codec/tile_codec.h"

namespace helio {
namespace {

constexpr std::size_t kLetGo = 4096;  // ids that are remembered

// Of the decoded file's channels with this prefix; nothing: it has none of them. invalid_argument: some are missing, or
// a value is not finite.
Result<std::optional<Picture>> planes(DecodedTile& file, const std::string& prefix) {
  const char* const names[3] = {"R", "G", "B"};
  const std::vector<float>* found[3];
  int count = 0;
  for (int c = 0; c < 3; ++c) count += (found[c] = file.find(prefix + names[c])) != nullptr;
  if (count == 0) return std::optional<Picture>();
  const int width = file.header.frame_width, height = file.header.frame_height;
  Picture picture(width, height);
  for (int c = 0; c < 3; ++c) {
    const std::string name = prefix + names[c];
    if (!found[c]) return Error{ErrorCode::invalid_argument, "has no channel " + name, "data"};
    for (std::size_t i = 0; i < found[c]->size(); ++i) {
      const float value = (*found[c])[i];
      if (std::isfinite(value) && (prefix.empty() || value >= 0)) continue;
      return Error{ErrorCode::invalid_argument,
                   fmt::format("channel {} is {} at ({}, {}); allowed: finite{}", name, value, i % std::size_t(width),
                               i / std::size_t(width), prefix.empty() ? "" : ", >= 0"),
                   "data"};
    }
    picture.channels[c] = *found[c];
  }
  return std::optional(std::move(picture));
}

}  // namespace

std::uint64_t picture_bytes(int width, int height, int pictures) {
  return std::uint64_t(width) * std::uint64_t(height) * 3 * sizeof(float) * std::uint64_t(pictures);
}

ReferenceView ReferencePicture::view() const {
  ReferenceView view;
  view.mean = mean.view();
  if (half_a && half_b) {
    view.half_a = half_a->view();
    view.half_b = half_b->view();
  }
  if (variance) view.variance = variance->view();
  return view;
}

std::shared_ptr<const ReferencePicture> ReferenceStore::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return kept->id == id; });
  if (found == kept_.end()) return nullptr;
  kept_.splice(kept_.begin(), kept_, found);
  return kept_.front();
}

bool ReferenceStore::was_let_go(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return std::find(let_go_.begin(), let_go_.end(), id) != let_go_.end();
}

void ReferenceStore::keep(std::shared_ptr<const ReferencePicture> reference) {
  Kept gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  const auto same =
      std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return kept->id == reference->id; });
  if (same != kept_.end()) gone.splice(gone.end(), kept_, same);
  kept_.push_front(std::move(reference));
  std::uint64_t bytes = 0;
  for (auto kept = kept_.begin(); kept != kept_.end();) {
    const auto next = std::next(kept);
    bytes += (*kept)->memory.bytes();
    if (bytes > limit_) {
      bytes -= (*kept)->memory.bytes();
      let_go(kept, gone);
    }
    kept = next;
  }
}

void ReferenceStore::let_go(Kept::iterator kept, Kept& gone) {
  let_go_.push_back((*kept)->id);
  if (let_go_.size() > kLetGo) let_go_.pop_front();
  gone.splice(gone.end(), kept_, kept);
}

bool ReferenceStore::free_some() {
  Kept gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  for (auto kept = kept_.end(); kept != kept_.begin();) {
    --kept;
    if (kept->use_count() > 1) continue;
    let_go(kept, gone);
    return true;
  }
  return false;
}

std::uint64_t ReferenceStore::could_free() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = 0;
  for (const auto& kept : kept_) bytes += kept.use_count() == 1 ? kept->memory.bytes() : 0;
  return bytes;
}

Result<std::shared_ptr<const ReferencePicture>> ReferenceStore::load(std::span<const std::uint8_t> exr,
                                                                     const std::string& sha256) {
  if (auto found = find(sha256)) return found;
  const std::uint64_t most = limit_ / (3 * sizeof(float));
  auto file = decode_tile(exr, most);
  if (!file) {
    // So much would not fit, however few channels count.
    const bool large = file.error().message.ends_with("pixels allowed");
    return Error{large ? ErrorCode::resource_exhausted : file.error().code,
                 (large ? "max_reference_memory: " : "") + file.error().message, "data"};
  }
  const int width = file->header.frame_width, height = file->header.frame_height;
  if (!(file->header.data_window == PixelRect{0, 0, width, height}))
    return Error{ErrorCode::invalid_argument, "its data window is not its display window; allowed: whole pictures",
                 "data"};
  auto mean = planes(*file, "");
  if (!mean) return mean.error();
  if (!*mean) return Error{ErrorCode::invalid_argument, "has no channels R, G and B", "data"};
  auto variance = planes(*file, "variance.");
  if (!variance) return variance.error();
  auto reference = std::make_shared<ReferencePicture>();
  const std::uint64_t bytes = picture_bytes(width, height, *variance ? 2 : 1);
  if (bytes > limit_) {
    return Error{
        ErrorCode::resource_exhausted,
        fmt::format("max_reference_memory: {} x {} pixels take {} bytes; allowed: {}", width, height, bytes, limit_),
        {}};
  }
  auto memory = memory_.reserve_with_room(bytes, "a reference", MemoryOwner::references);
  if (!memory) return memory.error();
  reference->id = sha256;
  reference->memory = std::move(*memory);
  reference->mean = *std::move(*mean);
  reference->variance = std::move(*variance);
  reference->error = reference_error(reference->view());
  keep(reference);
  return std::shared_ptr<const ReferencePicture>(std::move(reference));
}

}  // namespace helio
