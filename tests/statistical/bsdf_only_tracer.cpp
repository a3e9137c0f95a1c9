#include "tests/statistical/bsdf_only_tracer.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <thread>

#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/surface.h"
#include "renderer/trace/scene/surface_layers.h"
#include "tests/support/random.h"

namespace helio::test {
namespace {

// One path from the camera. `ray` is its first segment.
Rgb trace_path(const SceneData& scene, Ray ray, int max_segments, Random& random) {
  Rgb radiance(0, 0, 0), throughput(1, 1, 1);
  for (int segment = 1; segment <= max_segments; ++segment) {
    ray.t_max = std::numeric_limits<float>::infinity();
    ray.alpha_key = random.next_u32();
    Hit hit;
    const std::uint32_t only = 0;
    scene.accel->intersect(&ray, &only, 1, &hit, RayOrder::scattered);

    // What the segment ends on shines.
    if (!hit.valid()) return radiance + throughput * scene.lights->environment_radiance(ray.direction);
    Surface surface = make_surface<true>(scene, ray, hit);
    const MaterialRecord& material = *surface.material;
    if (material.emissive) radiance += throughput * surface_emission(scene, hit, surface);

    // It scatters, seen in the frame of its normal on the side where the path is.
    const V3f back = -ray.direction;
    if (surface.part->smooth || material.normal_mapped) interpolate_normal(scene, hit, back, 0, surface);
    SurfaceParams params = evaluate_material(scene, hit, back, 0, surface);
    if (params.model == LobeModel::none || (material.one_sided && !surface.front)) return radiance;
    const Frame frame = shading_frame(surface);
    LayerParams layers;
    if (params.model == LobeModel::stack) {
      layers = evaluate_layers(scene, hit, back, 0, surface, frame);
      params.layers = &layers;
    }
    const float u_lobe = random.next_float();
    const BsdfSample sample = Bsdf(params, frame.to_local(back)).sample(u_lobe, random.next_v2f());
    if (!sample.valid()) return radiance;
    const V3f direction = frame.to_world(sample.wi);
    const bool same_side = dot(frame.n, surface.geometric_normal) > 0;
    const V3f outside = same_side ? surface.geometric_normal : -surface.geometric_normal;
    if (!(dot(outside, direction) * sample.wi.z > 0)) return radiance;  // light would leak through the surface
    throughput *= sample.weight;
    if (is_black(throughput)) return radiance;
    ray.origin = offset_origin(surface, ray.direction, direction);
    ray.direction = direction;
  }
  return radiance;
}

}  // namespace

bool suits_bsdf_only(const SceneFeatures& features) {
  return !features.delta_lights && !features.absorption;
}

Estimate trace_bsdf_only(const RenderScene& scene, const CameraPose& pose, int width, int height,
                         const BsdfOnlySettings& settings) {
  const Camera camera(pose, width, height, scene.origin());
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  Estimate estimate{width, height, std::vector<V3d>(pixels, V3d(0, 0, 0)), std::vector<V3d>(pixels, V3d(0, 0, 0))};
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < pixels; i = next++) {
      Random random(settings.seed, i + 1);
      const int x = int(i % std::size_t(width)), y = int(i / std::size_t(width));
      V3d sum(0, 0, 0), squares(0, 0, 0);
      for (std::uint32_t s = 0; s < settings.samples; ++s) {
        const V2f in_pixel = random.next_v2f();
        const CameraRay start = camera.generate_ray(x, y, in_pixel, random.next_v2f());
        Ray ray;
        ray.origin = start.origin;
        ray.direction = start.direction;
        const V3d sample(trace_path(scene.impl(), ray, settings.max_segments, random));
        sum += sample;
        squares += V3d(sample.x * sample.x, sample.y * sample.y, sample.z * sample.z);
      }
      const double n = settings.samples;
      estimate.mean[i] = sum / n;
      for (int c = 0; c < 3; ++c) {
        const double mean = estimate.mean[i][c];
        estimate.variance[i][c] = std::max(0.0, squares[c] / n - mean * mean) / (n - 1);
      }
    }
  };
  std::vector<std::thread> workers;
  for (int t = 0; t < settings.threads; ++t) workers.emplace_back(work);
  for (std::thread& worker : workers) worker.join();
  return estimate;
}

}  // namespace helio::test
