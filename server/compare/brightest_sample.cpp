#include "server/compare/brightest_sample.h"

#include <cmath>

#include "renderer/film/core/film.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/trace/paths/sample_trace.h"

namespace helio {
namespace {

// A sample is traced with the rest of its group: so many take some tenths of a second.
constexpr float kMostSamples = 4096;

}  // namespace

std::optional<InvalidSample> brightest_sample(const RenderScene& scene, const FrameBegin& frame, int x, int y,
                                              float samples, const CancelToken& cancel) {
  const RenderSettings& settings = frame.settings;
  if (settings.integrator != Integrator::path || reuses(settings.mode)) return std::nullopt;
  if (settings.mode != RenderMode::pt && settings.variant == ModeVariant::paper) return std::nullopt;
  if (!(samples >= 1 && samples <= kMostSamples)) return std::nullopt;
  const Camera camera(frame.camera, settings.width, settings.height, scene.origin(), settings.filter);
  const auto each_half = std::uint32_t(std::ceil(samples / kHalves));
  std::optional<InvalidSample> brightest;
  float most = -1;
  for (int half = 0; half < kHalves; ++half) {
    for (std::uint32_t i = 0; i < each_half; ++i) {
      SampleTrace told;
      told.width = settings.width;
      told.height = settings.height;
      told.sample = {x, y, half, i, 0, 0};
      if (!trace_sample(scene, camera, path_settings(settings), cancel, told)) return std::nullopt;
      const float light = luminance(told.radiance);
      if (!std::isfinite(light)) return told.sample;
      if (light > most) {
        most = light;
        brightest = told.sample;
      }
    }
  }
  return brightest;
}

}  // namespace helio
