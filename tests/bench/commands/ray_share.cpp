#include "tests/bench/commands/ray_share.h"

#include <atomic>

#include "renderer/trace/accel/accel_impl.h"
#include "tests/bench/bench_context.h"
#include "tests/bench/commands/tile_tracing.h"
#include "tests/bench/reports/statistics.h"

namespace helio::bench {

namespace {

void fill(RTCRay& out, const Ray& ray, unsigned id) {
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.tnear = 0;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.time = 0;
  out.tfar = ray.t_max;
  out.mask = ~0u;
  out.id = id;
  out.flags = 0;
}

// rtcIntersect1 and rtcOccluded1 over one log, in its order. What was hit, so that no call can be left out.
std::uint64_t trace_log(const RayLog& log, const Accel::Impl& accel) {
  embree::AlphaContext context;
  embree::init(&context.embree);
  context.test = accel.alpha_test;
  context.rays = log.rays.data();
  context.flat_count = accel.flat_count;
#if HELIO_EMBREE == 4
  RTCIntersectArguments intersect_arguments;
  rtcInitIntersectArguments(&intersect_arguments);
  intersect_arguments.context = &context.embree;
  RTCOccludedArguments occluded_arguments;
  rtcInitOccludedArguments(&occluded_arguments);
  occluded_arguments.context = &context.embree;
#else
  context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
#endif
  std::uint64_t hits = 0;
  unsigned id = 0;
  RTCRayHit query;
  for (const RayLog::Batch& batch : log.batches) {
    for (std::uint32_t i = 0; i < batch.count; ++i, ++id) {
      fill(query.ray, log.rays[id], id);
      if (batch.occlusion) {
#if HELIO_EMBREE == 4
        rtcOccluded1(accel.top, &query.ray, &occluded_arguments);
#else
        rtcOccluded1(accel.top, &context.embree, &query.ray);
#endif
        hits += query.ray.tfar < 0;
      } else {
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if HELIO_EMBREE == 4
        rtcIntersect1(accel.top, &query, &intersect_arguments);
#else
        rtcIntersect1(accel.top, &context.embree, &query);
#endif
        hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
      }
    }
  }
  return hits;
}

// Every ray of a picture, a log for each strip.
Result<std::vector<RayLog>> record_rays(const RayShareRequest& request, const Camera& camera,
                                        const PathSettings& settings, int threads) {
  std::vector<RayLog> logs;
  Film film(request.width, request.height);
  const auto traced =
      trace_picture(*request.scene, camera, settings, request.samples, film.bounds(), threads, film, &logs);
  std::size_t logged = 0;
  for (const RayLog& log : logs) logged += log.rays.size();
  if (logged == traced.stats.rays) return logs;
  return Error{ErrorCode::internal,
               "recorded " + std::to_string(logged) + " of " + std::to_string(traced.stats.rays) + " rays",
               request.name};
}

}  // namespace

Status add_ray_share(const RayShareRequest& request, RenderEngine& engine, const BenchOptions& options,
                     Figures& figures) {
  const RenderScene& scene = *request.scene;
  const Camera camera(camera_pose(scene.description().cameras.at(0)), request.width, request.height, scene.origin());
  PathSettings path_settings;
  path_settings.roulette_from = 5;
  RenderSettings settings;
  settings.width = request.width;
  settings.height = request.height;
  settings.max_segments = path_settings.max_segments;
  settings.roulette_from = path_settings.roulette_from;
  settings.roulette = path_settings.roulette = RouletteRule::throughput;
  const auto logs = record_rays(request, camera, path_settings, options.threads);
  if (!logs) return logs.error();
  std::size_t logged = 0;
  for (const RayLog& log : *logs) logged += log.rays.size();

  const Accel::Impl& accel = scene.impl().accel->impl();
  std::vector<double> share, kernel_share, rate, bare_rate;
  for (int i = -1; i < options.repeat; ++i) {
    const auto picture = render_picture(engine, request.scene, settings, std::uint32_t(request.samples));
    if (!picture) return picture.error();
    std::atomic<std::uint64_t> hits{0};
    const double bare_seconds =
        run_on_threads(options.threads, logs->size(), [&](std::size_t l) { hits += trace_log((*logs)[l], accel); });
    Film film(request.width, request.height);
    const auto traced =
        trace_picture(scene, camera, path_settings, request.samples, film.bounds(), options.threads, film);
    if (picture->end.progress.trace.rays != logged || hits == 0) {
      return Error{ErrorCode::internal, "the runs did not trace the recorded rays", request.name};
    }
    if (i < 0) continue;  // warm-up
    share.push_back(bare_seconds / picture->seconds);
    kernel_share.push_back(bare_seconds / traced.seconds);
    rate.push_back(double(logged) / picture->seconds * 1e-6);
    bare_rate.push_back(double(logged) / bare_seconds * 1e-6);
  }
  figures.add({request.name + ".ray_share", median(share), "share", request.goal, Better::higher});
  figures.add({request.name + ".ray_share.without_loop", median(kernel_share), "share", std::nullopt, Better::higher});
  figures.add({request.name + ".rays_per_second", median(rate), "Mrays/s", std::nullopt, Better::higher});
  figures.add({request.name + ".bare_rays_per_second", median(bare_rate), "Mrays/s", std::nullopt, Better::higher});
  return ok_status();
}

}  // namespace helio::bench
