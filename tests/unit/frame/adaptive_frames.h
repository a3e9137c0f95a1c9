// Pictures of mode adaptive, of a source of radiance whose mean and noise are known.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "fake_integrator.h"
#include "recording_sink.h"
#include "renderer/frame/render_loop.h"

namespace helio {

inline RenderSettings adaptive(int width, int height, ModeVariant variant = ModeVariant::bounded) {
  RenderSettings settings = film_of(width, height);
  settings.mode = RenderMode::adaptive;
  settings.variant = variant;
  if (variant == ModeVariant::paper) settings.adaptive.min_samples = 4;
  return settings;
}

// Renders and hands the pixels' means and counts to `see`.
template <class See>
FrameEnd render(const FakeIntegrator& fake, const RenderSettings& settings, const Budget& budget, int threads,
                const See& see, double interval_s = 0.25) {
  RenderEngine engine(threads);
  const auto sink = std::make_shared<RecordingSink>();
  sink->keep_pixels = true;
  RenderLoopOptions options;
  options.publish_interval_s = interval_s;
  RenderLoop loop(engine, fake.function(), settings, budget, RenderRank::job, sink, options);
  RenderLoop::Update update;
  update.view = view_at(1, 0);
  const auto end = sink->wait_for_end(loop.update(update));
  EXPECT_TRUE(end.has_value());
  EXPECT_EQ(fake.counters->out_of_order, 0u);
  for (const ResolvedTile& tile : sink->pixels) {
    std::size_t i = 0;
    for (int y = tile.window.y0; y < tile.window.y1; ++y) {
      for (int x = tile.window.x0; x < tile.window.x1; ++x, ++i)
        see(x, y, double(tile.radiance[0][i]), double(tile.samples[i]));
    }
  }
  return end.value_or(FrameEnd{});
}

inline Budget samples(std::uint32_t n) {
  Budget budget;
  budget.samples = n;
  return budget;
}

// 0.5 and, once in a hundred samples, 50 more: the case in which counts that follow a pixel's own samples end dark.
inline FakeIntegrator rare_event() {
  FakeIntegrator fake;
  fake.noise = 0.1f;
  fake.rare_share = 0.01f;
  fake.rare = 50;
  return fake;
}

inline double bias_of(const RenderSettings& settings, const Budget& budget, double& mean_samples) {
  double sum = 0, count = 0;
  mean_samples = 0;
  const FrameEnd end = render(rare_event(), settings, budget, 2, [&](int, int, double mean, double taken) {
    sum += mean;
    mean_samples += taken;
    ++count;
  });
  EXPECT_EQ(end.reason, budget.error ? FrameEndReason::error : FrameEndReason::samples);
  mean_samples /= count;
  return sum / count / 1.0 - 1;
}

}  // namespace helio
