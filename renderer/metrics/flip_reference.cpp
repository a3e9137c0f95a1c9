#include "renderer/metrics/flip_reference.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>

#include "renderer/metrics/check_pictures.h"
#include "renderer/metrics/share_out.h"

namespace helio {
namespace {

constexpr std::size_t kPlanes = 5;  // of an ObservedRow

}  // namespace

Result<FlipReference> FlipReference::create(const PictureView& reference, Uses uses, const FlipOptions& options) {
  if (Status valid = check_picture(reference, "reference"); !valid) return valid.error();
  if (!(options.pixels_per_degree >= 1 && options.pixels_per_degree <= 1000)) {
    std::ostringstream text;
    text << options.pixels_per_degree << ", must be from 1 to 1000";
    return Error{ErrorCode::invalid_argument, text.str(), "pixels_per_degree"};
  }
  if (options.threads < 1 || options.threads > 64)
    return Error{ErrorCode::invalid_argument, std::to_string(options.threads) + ", must be from 1 to 64", "threads"};
  return FlipReference(reference, uses, options);
}

FlipReference::FlipReference(const PictureView& reference, Uses uses, const FlipOptions& options)
    : picture_(reference), uses_(uses), options_(options), kernels_(options.pixels_per_degree) {
  if (uses.hdr) exposures_ = flip_exposures(reference, options.tone_mapper);
  kept_.resize(std::size_t(exposures_.different()) + 1);
}

std::vector<int> FlipReference::displays() const {
  std::vector<int> displays;
  if (uses_.ldr) displays.push_back(kLdr);
  for (int i = 0; uses_.hdr && i < exposures_.different(); ++i) displays.push_back(i);
  return displays;
}

std::uint64_t FlipReference::display_bytes() const {
  return kPlanes * sizeof(float) * std::uint64_t(picture_.pixels());
}

std::uint64_t FlipReference::bytes() const {
  return displays().size() * display_bytes();
}

Result<std::uint64_t> FlipReference::keep(std::uint64_t max_bytes) {
  std::vector<int> displays = this->displays();
  displays.resize(std::size_t(std::min<std::uint64_t>(displays.size(), max_bytes / display_bytes())));
  for (auto& rows : kept_) rows = {};
  std::vector<std::vector<float>> rows(displays.size());
  const int count = int(displays.size());
  share_out(count, options_.threads, [&](const auto& next) {
    for (int i = next(); i < count; i = next()) rows[std::size_t(i)] = observed(displays[std::size_t(i)]);
  });
  if (options_.cancel && options_.cancel->cancelled())
    return Error{ErrorCode::cancelled, "the preparation of a reference for FLIP was cancelled", {}};
  for (std::size_t i = 0; i < rows.size(); ++i) kept_[std::size_t(displays[i] + 1)] = std::move(rows[i]);
  return display_bytes() * displays.size();
}

FlipDisplay FlipReference::display(int index) const {
  if (index == kLdr) return {};
  return {options_.tone_mapper, exposures_.factor(index)};
}

std::vector<float> FlipReference::observed(int display) const {
  const std::size_t width = std::size_t(picture_.width);
  std::vector<float> out(kPlanes * picture_.pixels());
  Rows rows(*this, display);
  for (int y = 0; y < picture_.height; ++y) {
    if (options_.cancel && options_.cancel->cancelled()) break;
    const ObservedRow row = rows.row(y);
    float* to = &out[std::size_t(y) * kPlanes * width];
    for (const float* plane : {row.l, row.a, row.b, row.edge, row.point}) to = std::copy_n(plane, width, to);
  }
  return out;
}

FlipReference::Rows::Rows(const FlipReference& reference, int display) : width_(std::size_t(reference.picture_.width)) {
  const std::vector<float>& kept = reference.kept_[std::size_t(display + 1)];
  if (!kept.empty()) {
    kept_ = kept.data();
    return;
  }
  computed_ = displayed_rows(reference.picture_, reference.display(display));
  observer_.emplace(reference.kernels_, reference.picture_.width, reference.picture_.height);
}

ObservedRow FlipReference::Rows::row(int y) {
  if (!kept_) return observer_->row(y, computed_);
  const float* at = kept_ + std::size_t(y) * kPlanes * width_;
  return {at, at + width_, at + 2 * width_, at + 3 * width_, at + 4 * width_};
}

}  // namespace helio
