// Path tracing on a Vulkan device: our own BVH over the ray-tracing pipeline, the device over the processor, uploads,
// the compilation of shaders.
#include <spdlog/fmt/fmt.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>

#include "renderer/base/clock.h"
#include "renderer/vulkan/path_device.h"
#include "renderer/vulkan/probe/probe.h"
#include "tests/bench/commands/tile_tracing.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/height_field.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

using vulkan::Level;
using vulkan::PathDevice;
using vulkan::SceneOnDevice;

constexpr int kWidth = 1280, kHeight = 720;  // of the pictures whose rates are for information
constexpr int kCornellSamples = 8;
// Samples of a window, which is one dispatch: at first few, then what takes about kWindowSeconds. A dispatch that takes
// ten seconds, those before it in the queue included, counts as the loss of the device.
constexpr double kLeastWindow = 1 << 12, kMostWindow = 1 << 18, kWindowSeconds = 0.25;
// A first, small picture of one sample has sides of 1 / kFirstScale. The pictures of rates get as many samples as take
// about kLongEnough; where one sample would take longer than kTooLong, the small picture's rate counts. Seconds.
constexpr int kFirstScale = 8;
constexpr double kLongEnough = 0.5, kTooLong = 5;
constexpr int kMostSamples = 64;
constexpr int kMostCompilations = 3;

struct OpenLevel {
  std::shared_ptr<PathDevice> device;
  std::string name;  // "compute", "rt"
};

// A scene on a level, and pictures of it.
struct Subject {
  const OpenLevel* level = nullptr;
  std::shared_ptr<const SceneOnDevice> scene;
  double window_samples = kLeastWindow;
  double first_rate = 0;      // of the first, small picture: samples of all pixels a second
  std::vector<double> rates;  // of the pictures after it
};

Camera camera_of(const RenderScene& scene, int width, int height) {
  return Camera(fitted(camera_pose(scene.description().cameras.front()), width, height), width, height, scene.origin());
}

template <class Work>
auto on_threads(int threads, Work work) {
  tbb::task_arena arena(threads);
  return arena.execute(work);
}

// The first device on which the daemon would render. An error says why there is none.
Result<int> first_device() {
  const vulkan::DeviceList list = vulkan::probe_devices();
  std::string reasons = list.reason;
  for (const vulkan::DeviceInfo& info : list.devices) {
    if (info.level != Level::none) return info.index;
    reasons += fmt::format("{}{}: {}", reasons.empty() ? "" : "; ", info.name, info.reason);
  }
  return Error{ErrorCode::unavailable, reasons, {}};
}

// The levels of one device, the lowest first; empty, with a note, where there is none. `index` < 0: of first_device().
std::vector<OpenLevel> open_levels(int index) {
  const Result<int> chosen = index < 0 ? first_device() : Result<int>(index);
  auto best = chosen ? PathDevice::open(*chosen) : Result<std::shared_ptr<PathDevice>>(chosen.error());
  if (!best) {
    note("no figures of Vulkan: " + best.error().to_string());
    return {};
  }
  const vulkan::DeviceInfo& info = (*best)->info();
  note(fmt::format("vulkan:{} is {}, with {}, Vulkan {}", info.index, info.name, info.driver, info.api_version));
  std::vector<OpenLevel> levels;
  if ((*best)->level() == Level::rt) {
    auto compute = PathDevice::open(info.index, Level::compute);
    if (compute) {
      levels.push_back({*compute, "compute"});
    } else {
      note("no figures of level compute: " + compute.error().to_string());
    }
  } else {
    note("no figures of level rt: " + info.reason);
  }
  levels.push_back({*best, std::string(vulkan::level_name((*best)->level()))});
  return levels;
}

Result<std::shared_ptr<const SceneOnDevice>> upload(const OpenLevel& level,
                                                    const std::shared_ptr<const RenderScene>& scene, int threads) {
  return on_threads(threads, [&] { return level.device->upload(scene); });
}

// Seconds for a picture, the halves taking turns. Bands of rows go to `threads` threads: while the device works on one
// the host reads another.
Result<double> render_seconds(const Subject& subject, const Camera& camera, const PathSettings& settings, int samples,
                              int threads) {
  Film film(camera.width(), camera.height());
  const double row_samples = double(camera.width()) * ((samples + 1) / kHalves);
  const int rows = std::max(1, int(subject.window_samples / row_samples / kFilmBlock)) * kFilmBlock;
  std::vector<PixelRect> bands;
  for (int y = 0; y < camera.height(); y += rows)
    bands.push_back({0, y, camera.width(), std::min(y + rows, camera.height())});

  const CancelToken never;
  std::vector<TraceStats> stats(bands.size());
  std::mutex mutex;
  Status failed = ok_status();
  const double seconds = run_on_threads(threads, bands.size(), [&](std::size_t i) {
    for (int half = 0; half < kHalves; ++half) {
      const SampleRange range{half, 0, std::uint32_t((samples + 1 - half) / kHalves)};
      const auto done =
          subject.level->device->trace(*subject.scene, camera, settings, range, bands[i], never, film, stats[i]);
      if (done) continue;
      const std::lock_guard lock(mutex);
      failed = done.error();
    }
  });
  if (!failed) return failed.error();
  TraceStats all;
  for (const TraceStats& s : stats) all.add(s);
  const auto expected = std::uint64_t(camera.width()) * camera.height() * std::uint64_t(samples);
  if (all.paths != expected || all.rays < all.paths) {
    const std::string traced = fmt::format("the device traced {} paths with {} rays", all.paths, all.rays);
    return Error{ErrorCode::internal, traced + fmt::format("; needed: {} paths", expected), {}};
  }
  return seconds;
}

// Each level that takes the scene, the others with a note: the scene uploaded, shaders compiled, the first picture
// rendered.
Result<std::vector<Subject>> place(const std::vector<OpenLevel>& levels, const std::string& name,
                                   const std::shared_ptr<const RenderScene>& scene, const Camera& camera,
                                   int threads) {
  const Camera small = camera_of(*scene, camera.width() / kFirstScale, camera.height() / kFirstScale);
  std::vector<Subject> subjects;
  for (const OpenLevel& level : levels) {
    auto placed = upload(level, scene, threads);
    const Status prepared = placed ? level.device->prepare(**placed) : Status(placed.error());
    if (!prepared) {
      note(fmt::format("no figures of {} by {}: {}", name, level.name, prepared.error().to_string()));
      continue;
    }
    Subject subject;
    subject.level = &level;
    subject.scene = std::move(*placed);
    const auto seconds = render_seconds(subject, small, PathSettings(), 1, threads);
    if (!seconds) return seconds.error();
    subject.first_rate = double(small.width()) * small.height() / *seconds;
    subject.window_samples = std::clamp(kWindowSeconds * subject.first_rate, kLeastWindow, kMostWindow);
    subjects.push_back(std::move(subject));
  }
  return subjects;
}

// Fills in the rates of all, in turns. `bounded`: where pictures take too long the small one's rate counts.
Status measure_rates(std::vector<Subject>& subjects, const Camera& camera, const BenchOptions& options, bool bounded) {
  const double pixels = double(camera.width()) * camera.height();
  for (int i = 0; i < options.repeat; ++i) {
    for (Subject& subject : subjects) {
      if (bounded && pixels / subject.first_rate > kTooLong) {
        if (subject.rates.empty()) subject.rates.push_back(subject.first_rate);
        continue;
      }
      const double wanted = std::ceil(kLongEnough * subject.first_rate / pixels);
      const double samples = std::clamp(wanted, 1.0, double(kMostSamples));
      const auto seconds = render_seconds(subject, camera, PathSettings(), int(samples), options.threads);
      if (!seconds) return seconds.error();
      subject.rates.push_back(pixels * samples / *seconds);
    }
  }
  return ok_status();
}

void add_rates(const std::string& name, const std::vector<Subject>& subjects, Figures& figures) {
  for (const Subject& subject : subjects) {
    figures.add({fmt::format("{}.samples_a_second.{}", name, subject.level->name), median(subject.rates) * 1e-6,
                 "M/s", std::nullopt, Better::higher});
  }
}

// Our own BVH over the ray-tracing pipeline.
Status bvh_over_rt(const std::vector<OpenLevel>& levels, const std::string& name, int quads_a_side, double goal,
                   const BenchOptions& options, Figures& figures) {
  if (levels.size() < 2) return ok_status();
  RenderSceneOptions build;
  build.threads = options.threads;
  auto scene = on_threads(options.threads, [&] { return RenderScene::build(height_field(quads_a_side), build); });
  if (!scene) return scene.error();
  const Camera camera = camera_of(**scene, options.size, options.size);
  auto subjects = place(levels, "the height field", *scene, camera, options.threads);
  if (!subjects) return subjects.error();
  if (subjects->size() < 2) return ok_status();
  if (const Status done = measure_rates(*subjects, camera, options, false); !done) return done;
  std::vector<double> ratios;
  for (int i = 0; i < options.repeat; ++i) ratios.push_back((*subjects)[0].rates[i] / (*subjects)[1].rates[i]);
  figures.add({"vulkan.bvh_over_rt_" + name, median(ratios), "x", goal, Better::higher});
  add_rates("vulkan.height_field_" + name, *subjects, figures);
  return ok_status();
}

// Each level and the processor in turns. The goal is that of the level that sessions are given: on software devices
// compute, which is faster there.
Status cornell_over_cpu(const std::vector<OpenLevel>& levels, const std::shared_ptr<const RenderScene>& scene,
                        const BenchOptions& options, Figures& figures) {
  const Camera camera = camera_of(*scene, options.size, options.size);
  const PathSettings settings;
  auto placed = place(levels, "the Cornell box", scene, camera, options.threads);
  if (!placed) return placed.error();
  const std::vector<Subject>& subjects = *placed;
  std::vector<double> cpu;
  std::vector<std::vector<double>> ours(subjects.size()), ratios(subjects.size());
  for (int i = -1; i < options.repeat; ++i) {
    Film film(options.size, options.size);
    const double cpu_seconds =
        trace_picture(*scene, camera, settings, kCornellSamples, film.bounds(), options.threads, film).seconds;
    if (i >= 0) cpu.push_back(cpu_seconds / kCornellSamples);
    for (std::size_t s = 0; s < subjects.size(); ++s) {
      const auto seconds = render_seconds(subjects[s], camera, settings, kCornellSamples, options.threads);
      if (!seconds) return seconds.error();
      if (i < 0) continue;  // warm-up
      ours[s].push_back(*seconds / kCornellSamples);
      ratios[s].push_back(*seconds / cpu_seconds);
    }
  }
  const bool software = levels.front().device->info().type == "cpu";
  const OpenLevel* const of_sessions = software ? &levels.front() : &levels.back();
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    const bool best = subjects[s].level == of_sessions;
    if (best) figures.add({"vulkan.cornell_over_cpu", median(ratios[s]), "x", 6.0, Better::lower});
    if (!best)
      figures.add({"vulkan.cornell_over_cpu." + subjects[s].level->name, median(ratios[s]), "x", std::nullopt,
                   Better::lower});
    figures.add({"vulkan.cornell.seconds_per_sample." + subjects[s].level->name, median(ours[s]), "s", std::nullopt,
                 Better::lower});
  }
  figures.add({"vulkan.cornell.seconds_per_sample.cpu", median(cpu), "s", std::nullopt, Better::lower});
  return ok_status();
}

Status upload_room(const std::vector<OpenLevel>& levels, const std::shared_ptr<const RenderScene>& room,
                   const BenchOptions& options, Figures& figures) {
  std::vector<std::vector<double>> seconds(levels.size());
  std::vector<double> megabytes(levels.size());
  for (int i = -1; i < options.repeat; ++i) {
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const double started = now_s();
      const auto placed = upload(levels[l], room, options.threads);
      const double took = now_s() - started;
      if (!placed) return placed.error();
      if (i < 0) continue;  // warm-up
      seconds[l].push_back(took);
      megabytes[l] = double((*placed)->bytes()) * 1e-6;
    }
  }
  for (std::size_t l = 0; l < levels.size(); ++l) {
    figures.add({"vulkan.upload_room_s." + levels[l].name, median(seconds[l]), "s", 2.0, Better::lower});
    figures.add({"vulkan.room_on_device." + levels[l].name, megabytes[l], "MB", std::nullopt, Better::lower});
  }
  return ok_status();
}

// By a device that has compiled nothing yet. run_vulkan() switched the drivers' caches off.
Status compile_cornell(const std::vector<OpenLevel>& levels, const std::shared_ptr<const RenderScene>& scene,
                       const BenchOptions& options, Figures& figures) {
  std::vector<std::vector<double>> seconds(levels.size());
  for (int i = 0; i < std::min(options.repeat, kMostCompilations); ++i) {
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const auto fresh = PathDevice::open(levels[l].device->info().index, levels[l].device->level());
      if (!fresh) return fresh.error();
      const auto placed = upload({*fresh, levels[l].name}, scene, options.threads);
      if (!placed) return placed.error();
      const double started = now_s();
      if (const Status prepared = (*fresh)->prepare(**placed); !prepared) return prepared;
      seconds[l].push_back(now_s() - started);
    }
  }
  for (std::size_t l = 0; l < levels.size(); ++l)
    figures.add({"vulkan.compile_s." + levels[l].name, median(seconds[l]), "s", std::nullopt, Better::lower});
  return ok_status();
}

Status rates_of(const std::vector<OpenLevel>& levels, const std::string& name,
                const std::shared_ptr<const RenderScene>& scene, const BenchOptions& options, Figures& figures) {
  const Camera camera = camera_of(*scene, kWidth, kHeight);
  auto subjects = place(levels, name, scene, camera, options.threads);
  if (!subjects) return subjects.error();
  if (const Status done = measure_rates(*subjects, camera, options, true); !done) return done;
  add_rates("vulkan." + name, *subjects, figures);
  return ok_status();
}

}  // namespace

Status run_vulkan(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  // Drivers read these when the first device is opened.
  setenv("LP_NUM_THREADS", std::to_string(options.threads).c_str(), 0);  // of lavapipe
  setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
  setenv("__GL_SHADER_DISK_CACHE", "0", 1);  // of NVIDIA's driver
  const std::vector<OpenLevel> levels = open_levels(options.vulkan_device);
  if (levels.empty()) return ok_status();

  const auto cornell = load_bench_scene(context.cornell(), options.threads);
  if (!cornell) return cornell.error();
  if (const Status done = compile_cornell(levels, *cornell, options, figures); !done) return done;
  if (const Status done = cornell_over_cpu(levels, *cornell, options, figures); !done) return done;
  if (const Status done = bvh_over_rt(levels, "100k", 224, 3, options, figures); !done) return done;
  if (const Status done = bvh_over_rt(levels, "1m", 708, 6, options, figures); !done) return done;
  if (const Status done = rates_of(levels, "cornell", *cornell, options, figures); !done) return done;

  const auto sponza_file = std::filesystem::path(options.shared) / "scenes/glb/sponza-dabrovic.glb";
  const auto sponza = load_bench_scene(sponza_file, options.threads);
  if (!sponza) return sponza.error();
  if (const Status done = rates_of(levels, "sponza", *sponza, options, figures); !done) return done;

  const auto room_file = context.room();
  if (!room_file) {
    note(room_file.error().to_string());
    return ok_status();
  }
  const auto room = load_bench_scene(*room_file, options.threads);
  if (!room) return room.error();
  if (const Status done = upload_room(levels, *room, options, figures); !done) return done;
  return rates_of(levels, "room", *room, options, figures);
}

}  // namespace helio::bench
