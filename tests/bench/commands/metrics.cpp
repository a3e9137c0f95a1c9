// The time of FLIP, on one thread.
#include <cmath>
#include <string>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/metrics/flip.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"
#include "tests/support/random.h"

namespace helio::bench {

namespace {

constexpr int kWidth = 1280, kHeight = 720;
constexpr double kLdrGoal = 0.5, kHdrGoal = 4;  // seconds

struct Picture {
  std::vector<float> channels[3];

  PictureView view() const { return {kWidth, kHeight, {channels[0].data(), channels[1].data(), channels[2].data()}}; }
};

// Smooth, over some nine stops, each value with noise of that share of it; one pixel is a lamp.
Picture make_picture(float noise) {
  Picture picture;
  test::Random random(1);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double bright = 4.5 * std::sin(0.02 * x + c) * std::cos(0.013 * y - c);
        const float value = 0.3f * float(std::exp2(bright)) * (1 + noise * (random.next_float() - 0.5f));
        picture.channels[c].push_back(x == 600 && y == 300 ? 500.0f : value);
      }
    }
  }
  return picture;
}

}  // namespace

Status run_metrics(BenchContext& context, Figures& figures) {
  const Picture picture = make_picture(0.5f), reference = make_picture(0);
  int exposures = 0;
  for (const bool hdr : {false, true}) {
    std::vector<double> seconds;
    for (int i = 0; i <= context.options().repeat; ++i) {
      const double start = now_s();
      const auto flip = hdr ? hdr_flip(picture.view(), reference.view()) : ldr_flip(picture.view(), reference.view());
      if (!flip) return flip.error();
      if (i > 0) seconds.push_back(now_s() - start);
      exposures = flip->exposures;
    }
    figures.add({hdr ? "metrics.flip.hdr_s" : "metrics.flip.ldr_s", median(seconds), "s", hdr ? kHdrGoal : kLdrGoal,
                 Better::lower});
  }
  figures.add({"metrics.flip.hdr_exposures", double(exposures), "", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace helio::bench
