#include "renderer/trace/scene/watertightness.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <limits>

#include "renderer/trace/accel/build_arena.h"
#include "renderer/trace/accel/edge_dilation.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/sampling/warp.h"
#include "renderer/trace/scene/surface.h"

namespace helio {
namespace {

constexpr int kBlocks = 64, kWalks = 256, kRounds = 4;
constexpr std::size_t kMaxCameras = 16;
constexpr int kFilm = 1024;
constexpr std::uint64_t kLeastAimed = 4096;
// Width of the rim in radii of the scene: four times what the tests' roundings add up to in practice.
constexpr double kRim = kEdgeDilation / 4;
// How far beyond the triangle, in radii, something must be found at the latest.
constexpr double kTolerance = 1e-3;

struct Tally {
  std::uint64_t traced = 0, aimed = 0, leaked = 0;
  double weights = 0, leaked_weights = 0, leaked_squares = 0;
};

// Whether the ray crosses the triangle, its rim included.
bool crosses(const Ray& ray, const V3d& a, const V3d& b, const V3d& c) {
  const V3d o(ray.origin), d(ray.direction), p = a - o, q = b - o, r = c - o;
  const double u = dot(cross(q, r), d), v = dot(cross(r, p), d), w = dot(cross(p, q), d);
  return u + v + w != 0 && ((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0));
}

class Walker {
 public:
  Walker(const SceneData& scene, const std::vector<Camera>& cameras, int block)
      : scene_(scene), cameras_(cameras), key_(hash32(std::uint32_t(block) + 0x6c65616bu)) {
    for (int i = 0; i < kWalks; ++i) start(i);
  }

  Tally run() {
    for (int round = 0; round < kRounds; ++round) {
      trace(rays_, kWalks);
      tally_.traced += kWalks;
      int aimed = 0;
      for (int i = 0; i < kWalks; ++i) {
        if (hits_[i].valid() && aim(i, aimed)) ++aimed;
        next(i);
      }
      check(aimed);
    }
    return tally_;
  }

 private:
  float random() { return unit_float(combine_hash(key_, counter_++)); }
  V2f random_pair() {
    const float x = random();
    return V2f(x, random());
  }

  void trace(const Ray* rays, int count) {
    for (int i = 0; i < count; ++i) order_[i] = std::uint32_t(i);
    scene_.accel->intersect(rays, order_, std::size_t(count), hits_, RayOrder::scattered);
  }

  void set(Ray& ray, const V3f& origin, const V3f& direction) {
    ray.origin = origin;
    ray.direction = direction;
    ray.t_max = std::numeric_limits<float>::infinity();
    ray.alpha_key = hash32(key_ ^ counter_);
  }

  void start(int i) {
    if (!cameras_.empty() && i % 2 == 0) {
      const Camera& camera = cameras_[std::size_t(i / 2) % cameras_.size()];
      const int x = int(random() * kFilm), y = int(random() * kFilm);
      const V2f in_pixel = random_pair();
      const CameraRay ray = camera.generate_ray(x, y, in_pixel, random_pair());
      set(rays_[i], ray.origin, ray.direction);
      return;
    }
    const V3f from = square_to_sphere(random_pair());
    const V3f inwards = Frame(-from).to_world(square_to_cosine_hemisphere(random_pair()));
    set(rays_[i], from * scene_.radius, inwards);
  }

  void next(int i) {
    if (!hits_[i].valid()) return start(i);
    const Surface surface = make_surface<true>(scene_, rays_[i], hits_[i]);
    const V3f normal = surface.facing_normal();
    const V3f direction = Frame(normal).to_world(square_to_cosine_hemisphere(random_pair()));
    set(rays_[i], offset_origin(surface, rays_[i].direction, direction), direction);
  }

  // From where ray i started towards the rim of what it has hit, into aimed_[slot]. False where there is no rim or the
  // ray misses it.
  bool aim(int i, int slot) {
    const PartRecord& part = scene_.flat[hits_[i].part];
    const Material& material = scene_.description.materials[part.material];
    if (!part.mesh || material.alpha_mode != AlphaMode::opaque) return false;
    V3d p[3];
    double side[3], perimeter = 0;
    for (int k = 0; k < 3; ++k) p[k] = V3d(corner(*part.mesh, hits_[i].primitive, k));
    for (int k = 0; k < 3; ++k) perimeter += side[k] = length(p[(k + 1) % 3] - p[k]);
    const double area = 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
    if (!(area > 0)) return false;
    // A uniform point of the perimeter, moved inwards by up to the rim's width.
    double along = double(random()) * perimeter;
    int k = 0;
    while (k < 2 && along >= side[k]) along -= side[k++];
    const V3d direction = (p[(k + 1) % 3] - p[k]) / side[k];
    const V3d normal = cross(p[1] - p[0], p[2] - p[0]) / (2 * area);
    const double rim = kRim * double(scene_.radius);
    const V3d target = p[k] + direction * along + cross(normal, direction) * (rim * double(random()));
    const V3d path = target - V3d(rays_[i].origin);
    const double distance = length(path);
    if (!(distance > 0)) return false;
    Ray& ray = aimed_[slot];
    set(ray, rays_[i].origin, V3f(path / distance));
    if (!crosses(ray, p[0], p[1], p[2])) return false;
    latest_[slot] = distance + kTolerance * double(scene_.radius);
    weight_[slot] = std::min(1.0, rim * perimeter / area);
    return true;
  }

  void check(int count) {
    trace(aimed_, count);
    for (int i = 0; i < count; ++i) {
      ++tally_.aimed;
      tally_.weights += weight_[i];
      if (hits_[i].valid() && double(hits_[i].t) <= latest_[i]) continue;
      ++tally_.leaked;
      tally_.leaked_weights += weight_[i];
      tally_.leaked_squares += weight_[i] * weight_[i];
    }
  }

  const SceneData& scene_;
  const std::vector<Camera>& cameras_;
  const std::uint32_t key_;
  std::uint32_t counter_ = 0;
  Tally tally_;
  Ray rays_[kWalks], aimed_[kWalks];
  Hit hits_[kWalks];
  std::uint32_t order_[kWalks];
  double latest_[kWalks], weight_[kWalks];
};

}  // namespace

LeakEstimate estimate_leaks(const SceneData& scene, int threads) {
  std::vector<Camera> cameras;
  for (const CameraDescription& camera : scene.description.cameras) {
    if (cameras.size() < kMaxCameras) cameras.emplace_back(camera_pose(camera), kFilm, kFilm, scene.origin);
  }
  std::vector<Tally> tallies(kBlocks);
  tbb::task_arena arena(build_concurrency(threads));
  const NiceBuildWorkers nice(arena);
  arena.execute([&] {
    tbb::parallel_for(0, kBlocks, [&](int block) {
      const auto walker = std::make_unique<Walker>(scene, cameras, block);
      tallies[std::size_t(block)] = walker->run();
    });
  });
  Tally sum;
  for (const Tally& t : tallies) {
    sum.traced += t.traced;
    sum.aimed += t.aimed;
    sum.leaked += t.leaked;
    sum.weights += t.weights;
    sum.leaked_weights += t.leaked_weights;
    sum.leaked_squares += t.leaked_squares;
  }
  LeakEstimate estimate;
  estimate.aimed = sum.aimed;
  estimate.leaked = sum.leaked;
  if (sum.aimed < kLeastAimed) return estimate;
  // Two standard deviations of a weighted Poisson count, and the rule of three for what no probe met.
  const double unseen = 3 * sum.weights / double(sum.aimed);
  estimate.rate_limit =
      std::min(1.0, (sum.leaked_weights + 2 * std::sqrt(sum.leaked_squares) + unseen) / double(sum.traced));
  return estimate;
}

}  // namespace helio
