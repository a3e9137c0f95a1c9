// The layer display, by our own filter and by Open Image Denoise, beside the film of as much processor time: that of
// the same samples, and of as many more as the filter's time is enough for.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/display/oidn_images.h"
#include "renderer/film/display/oidn_library.h"
#include "renderer/metrics/reference_halves.h"
#include "tests/bench/commands/display_scenes.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

constexpr std::uint32_t kCounts[] = {4, 16, 64, 256};
// Of an error: its own standard error, from the reference's noise, is at most this share of it.
constexpr double kMostUncertain = 0.25;

// One of the two renderings that a reference is the mean of. Mean and noise tell both but for which is which in each
// value, and products do not depend on that. Variances of 3x3 pixels in place of the noise take off too much beside
// fireflies.
struct ReferenceHalf {
  LoopPicture picture;

  ReferenceHalf(const ErrorScene& scene, float sign) : picture(scene.reference) {
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < picture.channels[c].size(); ++i)
        picture.channels[c][i] += sign * std::sqrt(std::max(0.0f, scene.reference_noise.channels[c][i]));
    }
  }
};

// relMSE against the reference's expectation. failed_precondition: the reference is too noisy.
Result<double> relmse(const PictureView& picture, const ErrorScene& scene) {
  const ReferenceHalf a(scene, 1), b(scene, -1);
  // Blocks of one pixel: signs of the noise are not known from pixel to pixel; channels are taken to be off together.
  const auto error =
      unbiased_relative_error(picture, a.picture.view(), b.picture.view(), RelativeEpsilon::image_mean(), {.block = 1});
  if (!error) return error.error();
  if (!(error->standard_error <= kMostUncertain * error->value))
    return Error{ErrorCode::failed_precondition, "the reference is too noisy", scene.name};
  return error->value;
}

// Of the frame's passes.
double processor_seconds(const LoopPicture& picture) {
  double seconds = 0;
  for (const PassTime& pass : picture.end.passes) seconds += pass.seconds;
  return seconds;
}

double display_seconds(const LoopPicture& picture) {
  for (const PassTime& pass : picture.end.passes) {
    if (pass.pass == "display") return pass.seconds;
  }
  return 0;
}

// Processor time for a picture of that size, the library's threads among it, which no pass of a frame counts: median
// after a warm-up. It does not depend on what the picture shows.
Result<double> oidn_seconds(const std::shared_ptr<const OidnLibrary>& library, const RenderSettings& settings,
                            int repeat) {
  const Film film(settings.width, settings.height);
  std::vector<double> seconds;
  for (int i = 0; i <= repeat; ++i) {
    const std::clock_t began = std::clock();
    OidnImages images(library, settings.width, settings.height);
    images.begin(film.bounds());
    images.copy(film, film.bounds());
    if (const Status done = images.denoise(nullptr); !done) return done.error();
    if (i > 0) seconds.push_back(double(std::clock() - began) / CLOCKS_PER_SEC);
  }
  return median(seconds);
}

class Measurement {
 public:
  Measurement(RenderEngine& engine, const ErrorScene& scene, const BenchOptions& options, Figures& figures,
              OverScenes& all)
      : engine_(engine), scene_(scene), options_(options), figures_(figures), all_(all), settings_(scene.settings) {
    settings_.mode = RenderMode::pt;
  }

  Status run(const std::shared_ptr<const OidnLibrary>& oidn) {
    double seconds_of_oidn = 0;
    if (oidn) {
      const auto seconds = oidn_seconds(oidn, settings_, options_.repeat);
      if (!seconds) return seconds.error();
      seconds_of_oidn = *seconds;
    }
    for (const std::uint32_t samples : kCounts) {
      at_ = "." + std::to_string(samples);
      RenderLoopOptions layer;
      layer.channels |= kResolveDisplay;
      layer.publish_passes = false;  // filtered once
      const auto own = render_picture(engine_, scene_.scene, settings_, samples, scene_.view, layer);
      if (!own) return own.error();
      const double filter = display_seconds(*own), film = processor_seconds(*own) - filter;
      add("raw.relmse", relmse(own->view(), scene_));
      add("raw.seconds", film, "s");
      if (const Status done = compare("own", own->display_view(), samples, film, filter); !done) return done;
      if (!oidn) continue;
      layer.channels |= kDisplayByOidn;
      layer.oidn = oidn;
      const auto denoised = render_picture(engine_, scene_.scene, settings_, samples, scene_.view, layer);
      if (!denoised) return denoised.error();
      if (const Status done = compare("oidn", denoised->display_view(), samples, film, seconds_of_oidn); !done)
        return done;
    }
    return ok_status();
  }

 private:
  // film, filter: processor seconds.
  Status compare(const std::string& name, const PictureView& picture, std::uint32_t samples, double film,
                 double filter) {
    const auto more = std::uint32_t(std::lround(filter / film * samples));
    const auto raw = render_picture(engine_, scene_.scene, settings_, samples + more, scene_.view);
    if (!raw) return raw.error();
    const auto ours = relmse(picture, scene_), theirs = relmse(raw->view(), scene_);
    add(name + ".relmse", ours);
    add(name + ".seconds", film + filter, "s");
    add(name + ".raw_samples", samples + more, "");
    if (ours && theirs) add(name + ".relmse_over_raw", *ours / *theirs, "x", true);
    return ok_status();
  }

  void add(const std::string& name, const Result<double>& error) {
    if (error)
      add(name, *error, "");
    else
      note(scene_.name + "." + name + at_ + ": " + error.error().to_string());
  }
  void add(const std::string& name, double value, const char* unit, bool over_scenes = false) {
    const Figure figure{name + at_, value, unit, std::nullopt, Better::lower};
    if (over_scenes) all_.add(figure);
    Figure own = figure;
    own.name.insert(0, scene_.name + ".");
    figures_.add(std::move(own));
  }

  RenderEngine& engine_;
  const ErrorScene& scene_;
  const BenchOptions& options_;
  Figures& figures_;
  OverScenes& all_;
  RenderSettings settings_;
  std::string at_;  // ".SAMPLES"
};

}  // namespace

Status run_denoisers(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  std::shared_ptr<const OidnLibrary> oidn;
  if (options.oidn_library.empty()) {
    note("--oidn-library names none: figures of Open Image Denoise are left out");
  } else {
    auto loaded = OidnLibrary::load(options.oidn_library, options.threads);
    if (!loaded) return loaded.error();
    oidn = std::move(*loaded);
  }
  RenderEngine engine(options.threads);
  OverScenes all;
  const Status done = measure_error_scenes(
      options, display_scenes(), engine, kDisplayReference,
      [&](const ErrorScene& scene) { return Measurement(engine, scene, options, figures, all).run(oidn); });
  if (done.ok()) all.publish(figures);
  return done;
}

}  // namespace helio::bench
