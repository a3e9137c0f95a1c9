// What previews show of a drag, beside what the same time gives without them: one sample a pixel of the largest picture
// that it is enough for, enlarged. Error, structural dissimilarity and flicker, against references.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "renderer/codec/display_image.h"
#include "renderer/metrics/dssim.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/scenes/preview_drag.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

const char* const kScenes[] = {"cornell", "sponza-dabrovic", "breakfast-room", "courtyard"};
constexpr std::uint32_t kReference = 256;
constexpr double kRate = 30, kBudget = 0.028;
// Views of the drag that are looked at, and the last two of them for the change from one to the next.
constexpr int kLookedAt[] = {10, 25, 40, 41};
// Bilinearly, between pixels' centres.
LoopPicture enlarged(const LoopPicture& small, int width, int height) {
  LoopPicture large;
  large.width = width;
  large.height = height;
  for (int c = 0; c < 3; ++c) {
    large.channels[c].reserve(large.view().pixels());
    for (int y = 0; y < height; ++y) {
      const float v =
          std::clamp((float(y) + 0.5f) * float(small.height) / float(height) - 0.5f, 0.0f, float(small.height - 1));
      const int y0 = int(v), y1 = std::min(y0 + 1, small.height - 1);
      for (int x = 0; x < width; ++x) {
        const float u =
            std::clamp((float(x) + 0.5f) * float(small.width) / float(width) - 0.5f, 0.0f, float(small.width - 1));
        const int x0 = int(u), x1 = std::min(x0 + 1, small.width - 1);
        const auto at = [&](int px, int py) {
          return small.channels[c][std::size_t(py) * std::size_t(small.width) + std::size_t(px)];
        };
        const float fx = u - float(x0), fy = v - float(y0);
        large.channels[c].push_back((1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x1, y0)) +
                                    fy * ((1 - fx) * at(x0, y1) + fx * at(x1, y1)));
      }
    }
  }
  return large;
}

// One sample a pixel of as many pixels as `seconds` are enough for.
Result<LoopPicture> without_previews(RenderEngine& engine, const ErrorScene& scene, const CameraPose& camera,
                                     double seconds, std::uint64_t seed) {
  RenderSettings settings = scene.settings;
  settings.mode = RenderMode::pt;
  settings.seed = seed;
  for (int tries = 0;; ++tries) {
    const auto picture = render_picture(engine, scene.scene, settings, 1, camera);
    if (!picture) return picture.error();
    // Where it took longer than it may, a smaller one; the second is of about the right size.
    if (tries == 2 || (tries == 0 && picture->seconds <= seconds))
      return enlarged(*picture, scene.settings.width, scene.settings.height);
    const double scale = std::min(std::sqrt(seconds / picture->seconds) * settings.width / scene.settings.width, 1.0);
    settings.width = std::max(int(scene.settings.width * scale), 8);
    settings.height = std::max(int(scene.settings.height * scale), 8);
  }
}

// Less what the reference's noise adds. failed_precondition: that is more than half of it.
Result<double> relmse(const LoopPicture& picture, const ErrorScene& truth) {
  const auto error = relative_error(picture.view(), truth.reference.view());
  if (!error) return error.error();
  const double noise = reference_relmse(truth);
  if (error->relmse < 2 * noise) return Error{ErrorCode::failed_precondition, "the reference is too noisy", truth.name};
  return error->relmse - noise;
}

// Side by side, for people.
Status write_pictures(const BenchOptions& options, const ErrorScene& truth, const std::string& view,
                      const LoopPicture& preview, const LoopPicture& single) {
  if (options.output.empty()) return ok_status();
  const double exposure = auto_exposure(truth.reference.view());
  const std::pair<const char*, const LoopPicture*> pictures[] = {
      {".preview.png", &preview}, {".sample.png", &single}, {".reference.png", &truth.reference}};
  for (const auto& [ending, picture] : pictures) {
    const std::filesystem::path file = std::filesystem::path(options.output) / (truth.name + view + ending);
    if (const Status written = write_display_png(file.string(), picture->view(), exposure); !written) return written;
  }
  return ok_status();
}

Status measure(RenderEngine& engine, const BenchOptions& options, const ErrorScene& scene, Figures& figures,
               OverScenes& all) {
  PreviewDrag what;
  what.looked_at.assign(std::begin(kLookedAt), std::end(kLookedAt));
  what.settings = scene.settings;
  what.settings.mode = RenderMode::combined;
  what.settings.preview = {.rate = kRate, .budget_s = kBudget};
  const auto dragged = drag_previews(engine, scene, what);
  if (!dragged) return dragged.error();
  const auto add = [&](const std::string& name, const std::string& view, double ours, double theirs, double goal) {
    const Figure figure{name, ours / theirs, "x", 1.0, Better::lower};
    all.add(figure, goal);
    figures.add({scene.name + "." + name + view, figure.value, "x", 1.0, Better::lower});
  };
  ErrorScene before;
  LoopPicture preview_before, single_before;
  for (std::size_t i = 0; i < std::size(kLookedAt); ++i) {
    ErrorScene truth = scene;
    truth.view = dragged->cameras[i];
    const auto reference = reference_picture(
        engine, options.cache, {scene.name, scene.checksum, scene.scene, truth.view, scene.settings, kReference});
    if (!reference) return reference.error();
    truth.reference = reference->picture;
    truth.reference_variance = reference->variance;
    const LoopPicture& preview = dragged->previews[i];
    auto single = without_previews(engine, scene, truth.view, std::max(preview.seconds, kBudget), i);
    if (!single) return single.error();
    std::string view = ".";
    view += std::to_string(kLookedAt[i]);
    if (const Status written = write_pictures(options, truth, view, preview, *single); !written) return written;
    if (i + 1 == std::size(kLookedAt)) {
      add("flicker", view, preview_flicker(preview_before, before, preview, truth),
          preview_flicker(single_before, before, *single, truth), 0.3);
    } else {
      const auto ours = relmse(preview, truth), theirs = relmse(*single, truth);
      if (ours && theirs) {
        add("relmse_over_sample", view, *ours, *theirs, 0.3);
        figures.add({scene.name + ".relmse" + view, *ours, "", std::nullopt, Better::lower});
      } else {
        note((ours ? theirs : ours).error().to_string());
      }
      const double exposure = 0.25 / mean_of(truth.reference);
      const auto apart = dssim(preview.view(), truth.reference.view(), exposure);
      const auto single_apart = dssim(single->view(), truth.reference.view(), exposure);
      if (!apart || !single_apart) return apart ? single_apart.error() : apart.error();
      add("dssim_over_sample", view, apart->dssim, single_apart->dssim, 0.6);
      figures.add({scene.name + ".milliseconds" + view, 1e3 * preview.seconds, "ms", std::nullopt, Better::lower});
    }
    before = std::move(truth);
    preview_before = preview;
    single_before = std::move(*single);
  }
  return ok_status();
}

}  // namespace

Status run_previews(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  OverScenes all;
  if (!options.output.empty()) std::filesystem::create_directories(options.output);
  const Status done =
      measure_error_scenes(options, {std::begin(kScenes), std::end(kScenes)}, engine, 2,
                           [&](const ErrorScene& scene) { return measure(engine, options, scene, figures, all); });
  if (done.ok()) all.publish(figures);
  return done;
}

}  // namespace helio::bench
