#include "renderer/metrics/flip.h"

#include <algorithm>
#include <cstddef>
#include <mutex>

#include "renderer/base/check.h"
#include "renderer/metrics/check_pictures.h"
#include "renderer/metrics/flip_difference.h"
#include "renderer/metrics/flip_reference.h"
#include "renderer/metrics/share_out.h"

namespace helio {
namespace {

double mean_of(const std::vector<float>& error) {
  double sum = 0;
  for (const float value : error) sum += value;
  return sum / double(error.size());
}

bool cancelled(const FlipReference& reference) {
  return reference.options().cancel && reference.options().cancel->cancelled();
}

Error cancelled_error() {
  return {ErrorCode::cancelled, "the comparison of two pictures by FLIP was cancelled", {}};
}

// Pictures of one size, one after the other.
class FlipComparison {
 public:
  explicit FlipComparison(const FlipReference& reference)
      : reference_(reference),
        observer_(reference.kernels(), reference.picture().width, reference.picture().height),
        difference_(reference.picture().width) {}

  // error = max(error, FLIP on this display). Unfinished when it is cancelled meanwhile.
  void compare(const PictureView& picture, int display, std::vector<float>& error) {
    const FlipRows shown = displayed_rows(picture, reference_.display(display));
    FlipReference::Rows rows(reference_, display);
    for (int y = 0; y < picture.height; ++y) {
      if (cancelled(reference_)) return;
      const ObservedRow seen = observer_.row(y, shown);
      difference_.add(seen, rows.row(y), &error[std::size_t(y) * std::size_t(picture.width)]);
    }
  }

 private:
  const FlipReference& reference_;
  FlipObserver observer_;
  FlipDifference difference_;
};

}  // namespace

Result<Flip> ldr_flip(const PictureView& picture, const PictureView& reference, const FlipOptions& options) {
  if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
  const auto seen = FlipReference::create(reference, {.ldr = true}, options);
  return seen ? ldr_flip(picture, *seen) : seen.error();
}

Result<Flip> hdr_flip(const PictureView& picture, const PictureView& reference, const FlipOptions& options) {
  if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
  const auto seen = FlipReference::create(reference, {.hdr = true}, options);
  return seen ? hdr_flip(picture, *seen) : seen.error();
}

Result<Flip> ldr_flip(const PictureView& picture, const FlipReference& reference) {
  HELIO_CHECK(reference.uses().ldr);
  if (Status valid = check_pictures(picture, reference.picture()); !valid) return valid.error();
  Flip flip;
  flip.error.assign(picture.pixels(), 0.0f);
  FlipComparison(reference).compare(picture, FlipReference::kLdr, flip.error);
  if (cancelled(reference)) return cancelled_error();
  flip.mean = mean_of(flip.error);
  return flip;
}

Result<Flip> hdr_flip(const PictureView& picture, const FlipReference& reference) {
  HELIO_CHECK(reference.uses().hdr);
  if (Status valid = check_pictures(picture, reference.picture()); !valid) return valid.error();
  const FlipExposures& exposures = reference.exposures();
  Flip flip;
  flip.start_exposure = exposures.start;
  flip.stop_exposure = exposures.stop;
  flip.exposures = exposures.count;
  flip.error.assign(picture.pixels(), 0.0f);
  std::mutex mutex;
  const int count = exposures.different();
  share_out(count, reference.options().threads, [&](const auto& next) {
    FlipComparison comparison(reference);
    std::vector<float> error(picture.pixels());  // the largest over the exposures of this thread
    for (int exposure = next(); exposure < count; exposure = next()) comparison.compare(picture, exposure, error);
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < error.size(); ++i) flip.error[i] = std::max(flip.error[i], error[i]);
  });
  if (cancelled(reference)) return cancelled_error();
  flip.mean = mean_of(flip.error);
  return flip;
}

}  // namespace helio
