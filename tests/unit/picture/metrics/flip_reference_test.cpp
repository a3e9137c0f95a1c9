// The reference's side of FLIP: the same results whether it is kept or computed anew, and an end to it.
#include "renderer/metrics/flip_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <future>
#include <limits>
#include <thread>
#include <vector>

#include "renderer/base/cpu_time.h"
#include "renderer/metrics/flip.h"
#include "tests/unit/picture/metrics/flip_pairs.h"

namespace helio {
namespace {

using test::FlipPair;
using test::Picture;

// The thread sanitizer slows code down five to fifteen times.
#ifdef __SANITIZE_THREAD__
#else
#endif
constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

TEST(FlipReference, GivesTheSameFloatsKeptOrNot) {
  for (const FlipPair& pair : test::flip_pairs()) {
    for (const FlipToneMapper mapper : {FlipToneMapper::aces, FlipToneMapper::hable, FlipToneMapper::reinhard}) {
      SCOPED_TRACE(pair.name);
      FlipOptions options;
      options.tone_mapper = mapper;
      const Flip ldr = ldr_flip(pair.picture.view(), pair.reference.view(), options).value();
      const Flip hdr = hdr_flip(pair.picture.view(), pair.reference.view(), options).value();
      const std::uint64_t display = 20 * pair.reference.view().pixels();
      for (const std::uint64_t most : {std::uint64_t(0), display - 1, 3 * display, kAll}) {
        for (const int threads : {1, 3}) {
          options.threads = threads;
          FlipReference reference =
              FlipReference::create(pair.reference.view(), {.ldr = true, .hdr = true}, options).value();
          const std::uint64_t kept = reference.keep(most).value();
          EXPECT_LE(kept, most);
          EXPECT_EQ(kept, std::min(reference.bytes(), most / display * display));
          const Flip kept_ldr = ldr_flip(pair.picture.view(), reference).value();
          const Flip kept_hdr = hdr_flip(pair.picture.view(), reference).value();
          EXPECT_EQ(kept_ldr.error, ldr.error);
          EXPECT_EQ(kept_ldr.mean, ldr.mean);
          EXPECT_EQ(kept_hdr.error, hdr.error);
          EXPECT_EQ(kept_hdr.mean, hdr.mean);
          EXPECT_EQ(kept_hdr.exposures, hdr.exposures);
        }
      }
      options.threads = 1;
    }
  }
}

TEST(FlipReference, CountsWhatItMayKeep) {
  const FlipPair pair = test::flip_pairs()[4];  // of five exposures
  const std::uint64_t display = 20 * pair.reference.view().pixels();
  const auto bytes = [&](const Picture& picture, FlipReference::Uses uses) {
    return FlipReference::create(picture.view(), uses)->bytes();
  };
  EXPECT_EQ(bytes(pair.reference, {.ldr = true}), display);
  EXPECT_EQ(bytes(pair.reference, {.hdr = true}), 5 * display);
  EXPECT_EQ(bytes(pair.reference, {.ldr = true, .hdr = true}), 6 * display);
  EXPECT_EQ(bytes(Picture(3, 2, 1.0f), {.hdr = true}), 20u * 6u) << "both exposures of one radiance are the same";
  Picture broken(3, 2, 1.0f);
  broken.channels[1][4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(FlipReference::create(broken.view(), {.ldr = true}).error().to_string(),
            "reference: is not finite at pixel (1, 1), channel 1");
  FlipReference reference = FlipReference::create(pair.reference.view(), {.ldr = true}).value();
  ASSERT_TRUE(reference.keep(kAll).ok());
  EXPECT_EQ(ldr_flip(Picture(3, 2, 1.0f).view(), reference).error().where, "picture");
}

// Processor time, which other programs do not change: a call that is cancelled at its beginning does not use what a whole
// one takes. Choosing the exposures, up to half of the second call, is not cut short.
TEST(FlipReference, EndsWhenItIsCancelled) {
  const int width = 1280, height = 720;
  const Picture reference = test::made_by(width, height, test::bright_tiles), picture(width, height, 0.5f);
  const auto compare = [&](const FlipOptions& options) {
    const auto flip = hdr_flip(picture.view(), reference.view(), options);
    return flip ? ok_status() : Status(flip.error());
  };
  const auto keep = [&](FlipOptions options) {
    options.threads = 2;
    auto made = FlipReference::create(reference.view(), {.hdr = true}, options);
    if (!made) return Status(made.error());
    const auto kept = made->keep(kAll);
    return kept ? ok_status() : Status(kept.error());
  };
  const auto check = [&](const char* what, const auto& call) {
    const double started = process_cpu_s();
    ASSERT_TRUE(call(FlipOptions()).ok()) << what;
    const double whole = process_cpu_s() - started;
    CancelToken cancel;
    FlipOptions options;
    options.cancel = &cancel;
    auto outcome = std::async(std::launch::async, [&] { return call(options); });
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const double asked = process_cpu_s();
    cancel.cancel();
    const Status ended = outcome.get();
    ASSERT_FALSE(ended.ok()) << what;
    EXPECT_EQ(ended.error().code, ErrorCode::cancelled) << what;
    EXPECT_LT(process_cpu_s() - asked, 0.75 * whole) << what;
  };
  check("comparing", compare);
  check("keeping", keep);
  CancelToken before;
  before.cancel();
  FlipOptions options;
  options.cancel = &before;
  EXPECT_EQ(ldr_flip(picture.view(), reference.view(), options).error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace helio
