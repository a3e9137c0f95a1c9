// What a gaze at the middle of the picture changes: previews of a drag, with and without upscaling, by what they take and
// by FLIP inside the disk that the gaze sees and flicker outside; and a film at rest, by its error inside the disk over
// time. The disk is that of Mrad 2022: 15 % of the distance to the farthest corner. And what Mrad published, with and
// without upscaling, beside ours in the same time.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "renderer/codec/display_image.h"
#include "renderer/metrics/flip.h"
#include "renderer/metrics/weighted_median.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/scenes/preview_drag.h"
#include "tests/bench/subcommands.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

const char* const kScenes[] = {"cornell", "sponza-dabrovic", "breakfast-room"};
constexpr std::uint32_t kReference = 256;
constexpr double kRate = 30, kDisk = 0.15;
// Views that are looked at; the last two for the change from one to the next.
const std::vector<int> kLookedAt = {10, 25, 40, 41};
constexpr double kBudgets[] = {0.008, 0.012, 0.016, 0.022, 0.028, 0.040};
constexpr double kPlainBudget = 0.028;
constexpr double kLikeFlip = 0.002;  // that inside the disk may be higher and counts as the same
constexpr std::uint32_t kFilmSamples = 64;

bool in_disk(int x, int y, const RenderSettings& s) {
  return std::hypot(x + 0.5 - 0.5 * s.width, y + 0.5 - 0.5 * s.height) < kDisk * 0.5 * std::hypot(s.width, s.height);
}

// Means over the views that are looked at.
struct Seen {
  double milliseconds = 0, flip = 0, disk_flip = 0, flicker = 0;  // flicker: outside the disk
  std::vector<double> medians;                                    // weighted ones of FLIP, by view
};

struct Variant {
  const char* name;
  Foveation foveation = Foveation::none;
  bool upscaling = false;
  PublishedFoveation published = {};
};
constexpr Variant kPlain{"plain"}, kGaze{"gaze", Foveation::density}, kUpscaled{"upscaled", Foveation::none, true},
    kBoth{"gaze_upscaled", Foveation::density, true};
// The paper's modes: foveated, with upscaling, and with temporal anti-aliasing as well; the last with all faults mended.
constexpr PublishedFoveation kWithout{.antialiasing = false}, kSmaller{.disk = 0.12443},
    kMended{.reject_history = true, .fixed_disk = true, .mean_rate = true, .surface_motion = true};
constexpr Variant kPublished{"published", Foveation::paper, false, kWithout},
    kPublishedUpscaled{"published_upscaled", Foveation::paper, true, kWithout},
    kPublishedWhole{"published_antialiased", Foveation::paper, true},
    kPublishedSmaller{"published_smaller_disk", Foveation::paper, true, kSmaller},
    kPublishedMended{"published_mended", Foveation::paper, true, kMended};
constexpr double kLeastBudget = 0.005;

using Truths = std::vector<ErrorScene>;  // of the views that are looked at

RenderSettings settings_of(const ErrorScene& scene, const Variant& variant, double budget_s) {
  RenderSettings settings = scene.settings;
  settings.mode = RenderMode::combined;
  settings.preview = {.rate = kRate, .budget_s = budget_s, .upscaling = variant.upscaling};
  settings.foveation.kind = variant.foveation;
  settings.foveation.published = variant.published;
  return settings;
}

Result<Seen> see(RenderEngine& engine, const BenchOptions& options, const ErrorScene& scene, const Variant& variant,
                 double budget_s, Truths& truths) {
  PreviewDrag what;
  what.settings = settings_of(scene, variant, budget_s);
  what.looked_at = kLookedAt;
  const Gaze middle{0.5 * what.settings.width, 0.5 * what.settings.height};
  if (variant.foveation != Foveation::none) what.gaze = [middle](int) { return middle; };
  const auto dragged = drag_previews(engine, scene, what);
  if (!dragged) return dragged.error();
  while (truths.size() < kLookedAt.size()) {
    ErrorScene truth = scene;
    truth.view = dragged->cameras[truths.size()];
    const auto reference = reference_picture(
        engine, options.cache, {scene.name, scene.checksum, scene.scene, truth.view, scene.settings, kReference});
    if (!reference) return reference.error();
    truth.reference = reference->picture;
    truth.reference_variance = reference->variance;
    truths.push_back(std::move(truth));
  }
  Seen seen;
  seen.milliseconds = 1e3 * dragged->mean_seconds;
  const std::size_t looked_at = kLookedAt.size() - 1;
  for (std::size_t i = 0; i < looked_at; ++i) {
    const LoopPicture& preview = dragged->previews[i];
    const auto flip = hdr_flip(preview.view(), truths[i].reference.view());
    if (!flip) return flip.error();
    const auto median = weighted_median(flip->error);
    if (!median) return median.error();
    seen.medians.push_back(*median);
    double sum = 0, pixels = 0;
    for (int y = 0; y < preview.height; ++y) {
      for (int x = 0; x < preview.width; ++x) {
        if (!in_disk(x, y, what.settings)) continue;
        sum += flip->error[std::size_t(y) * std::size_t(preview.width) + std::size_t(x)];
        ++pixels;
      }
    }
    seen.flip += flip->mean / double(looked_at);
    seen.disk_flip += sum / pixels / double(looked_at);
    if (!options.output.empty()) {
      const std::string name = scene.name + "." + variant.name + "." + std::to_string(kLookedAt[i]) + ".png";
      const double exposure = auto_exposure(truths[i].reference.view());
      const Status written =
          write_display_png((std::filesystem::path(options.output) / name).string(), preview.view(), exposure);
      if (!written) return written.error();
    }
  }
  const std::size_t last = kLookedAt.size() - 1;
  seen.flicker = preview_flicker(dragged->previews[last - 1], truths[last - 1], dragged->previews[last], truths[last],
                                 [&](int x, int y) { return !in_disk(x, y, what.settings); });
  return seen;
}

// Relative MSE inside the disk.
double disk_relmse(const test::ViewPicture& picture, const ErrorScene& truth) {
  const double mean = mean_of(truth.reference);
  double sum = 0, count = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (!in_disk(x, y, truth.settings)) continue;
      const std::size_t i = std::size_t(y) * std::size_t(picture.width) + std::size_t(x);
      for (int c = 0; c < 3; ++c) {
        const double r = truth.reference.channels[c][i], d = picture.radiance[c][i] - r;
        sum += (d * d - double(truth.reference_variance.channels[c][i])) / (r * r + 0.01 * mean * mean);
        ++count;
      }
    }
  }
  return sum / count;
}

// Of a film at rest: error times time inside the disk, with a gaze over without.
Result<double> film_ratio(RenderEngine& engine, const ErrorScene& scene) {
  double product[2] = {0, 0};
  for (const bool gaze : {false, true}) {
    RenderSettings settings = scene.settings;
    settings.mode = RenderMode::pt;
    if (gaze) settings.foveation.kind = Foveation::density;
    test::LoopViews views(engine, scene.scene, settings);
    if (gaze) views.gaze = Gaze{0.5 * settings.width, 0.5 * settings.height};
    const test::ViewPicture& picture = views.render(scene.view, kFilmSamples);
    if (picture.end.reason != FrameEndReason::samples)
      return Error{ErrorCode::internal, std::string("the frame ended by ") + to_string(picture.end.reason), scene.name};
    product[gaze] = picture.seconds * disk_relmse(picture, scene);
  }
  return product[1] / product[0];
}

// The paper's modes, and ours in the time of its last one.
template <class Add>
Status measure_published(RenderEngine& engine, const BenchOptions& options, const ErrorScene& scene, Truths& truths,
                         const Seen& plain, const Add& add) {
  std::vector<Seen> all;
  for (const Variant& variant :
       {kPublished, kPublishedUpscaled, kPublishedWhole, kPublishedSmaller, kPublishedMended}) {
    const auto seen = see(engine, options, scene, variant, kPlainBudget, truths);
    if (!seen) return seen.error();
    const std::string name = variant.name;
    add(name + ".milliseconds", seen->milliseconds, "ms", std::nullopt);
    add(name + ".disk_flip", seen->disk_flip, "", std::nullopt);
    add(name + ".flip", seen->flip, "", std::nullopt);
    add(name + ".flicker_over_plain", seen->flicker / plain.flicker, "x", std::nullopt);
    all.push_back(*seen);
  }
  add("published_upscaled.time_over_published", all[1].milliseconds / all[0].milliseconds, "x", 0.667);
  const Seen& theirs = all[2];
  const double budget_s = std::max(1e-3 * theirs.milliseconds, kLeastBudget);
  const auto ours = see(engine, options, scene, {"ours_in_the_same_time", kBoth.foveation, kBoth.upscaling}, budget_s,
                        truths);
  if (!ours) return ours.error();
  add("ours_in_the_same_time.time_over_published", ours->milliseconds / theirs.milliseconds, "x", std::nullopt);
  for (std::size_t view = 0; view < theirs.medians.size(); ++view) {
    const std::string of = ".flip_median.view" + std::to_string(kLookedAt[view]);
    add("published_antialiased" + of, theirs.medians[view], "", std::nullopt);
    add("ours_in_the_same_time" + of, ours->medians[view], "", theirs.medians[view]);
  }
  add("ours_in_the_same_time.flicker_over_published", ours->flicker / theirs.flicker, "x", std::nullopt);
  return ok_status();
}

Status measure(RenderEngine& engine, const BenchOptions& options, const ErrorScene& scene, Figures& figures,
               OverScenes& all) {
  Truths truths;
  const auto plain = see(engine, options, scene, kPlain, kPlainBudget, truths);
  if (!plain) return plain.error();
  const auto add = [&](const std::string& name, double value, const char* unit, std::optional<double> goal) {
    if (goal) all.add({name, value, unit, goal, Better::lower});
    figures.add({scene.name + "." + name, value, unit, goal, Better::lower});
  };
  add("plain.milliseconds", plain->milliseconds, "ms", std::nullopt);
  add("plain.disk_flip", plain->disk_flip, "", std::nullopt);
  add("plain.flip", plain->flip, "", std::nullopt);
  add("plain.flicker", plain->flicker, "", std::nullopt);
  for (const Variant& variant : {kGaze, kUpscaled, kBoth}) {
    // The shortest that is as good inside the disk; else the last.
    std::optional<Seen> found;
    for (const double budget_s : kBudgets) {
      const auto seen = see(engine, options, scene, variant, budget_s, truths);
      if (!seen) return seen.error();
      found = *seen;
      if (seen->disk_flip <= plain->disk_flip + kLikeFlip) break;
    }
    const std::string name = variant.name;
    const bool goals = variant.foveation == Foveation::density && !variant.upscaling;
    add(name + ".milliseconds", found->milliseconds, "ms", std::nullopt);
    add(name + ".time_over_plain", found->milliseconds / plain->milliseconds, "x",
        goals ? std::optional(0.5) : std::nullopt);
    add(name + ".disk_flip_more", found->disk_flip - plain->disk_flip, "", goals ? std::optional(0.005) : std::nullopt);
    add(name + ".flip", found->flip, "", std::nullopt);
    add(name + ".flicker_over_plain", found->flicker / plain->flicker, "x", goals ? std::optional(1.5) : std::nullopt);
  }
  if (const Status done = measure_published(engine, options, scene, truths, *plain, add); !done) return done;
  const auto film = film_ratio(engine, scene);
  if (!film) return film.error();
  add("film.disk_error_time_over_uniform", *film, "x", 0.4);
  return ok_status();
}

}  // namespace

Status run_foveated(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  OverScenes all;
  if (!options.output.empty()) std::filesystem::create_directories(options.output);
  const Status done =
      measure_error_scenes(options, {std::begin(kScenes), std::end(kScenes)}, engine, kReference,
                           [&](const ErrorScene& scene) { return measure(engine, options, scene, figures, all); });
  if (done.ok()) all.publish(figures);
  return done;
}

}  // namespace helio::bench
