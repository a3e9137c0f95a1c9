#include "renderer/trace/paths/light_vertex_cache.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "renderer/film/core/film.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/paths/sample_trace.h"
#include "renderer/trace/paths/splat_batch.h"
#include "renderer/trace/paths/splat_connection.h"
#include "renderer/trace/sampling/sampler.h"

namespace helio {

namespace {

// Light paths' numbers are nobody else's.
constexpr std::uint32_t kCacheKey = 0x243f6a88u, kCountKey = 0x85a308d3u;

LightPaths& thread_light_paths() {
  static thread_local std::unique_ptr<LightPaths> paths(new LightPaths);
  return *paths;
}

ConnectionRays& thread_rays() {
  static thread_local std::unique_ptr<ConnectionRays> rays(new ConnectionRays);
  return *rays;
}

// Paths `first` to `first + count` of the sequence of a key. Indices have 32 bits; paths beyond begin another sequence.
void number_paths(std::uint32_t key, std::uint64_t first, int count, LightBatch& batch) {
  batch.count = count;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t number = first + std::uint64_t(i);
    batch.keys[i] = combine_hash(key, std::uint32_t(number >> 32));
    batch.reversed_index[i] = reverse_bits(std::uint32_t(number));
  }
}

}  // namespace

double merging_radius(const PathSettings& settings, double scene_radius, std::uint32_t sample) {
  // Where positions as floats end.
  constexpr double kSmallest = 1e-7;
  const LightCacheSettings& s = settings.light_cache;
  return scene_radius * std::max(kSmallest, s.radius * std::pow(double(sample) + 1, 0.5 * (s.shrinking - 1)));
}

std::uint64_t pass_paths(std::uint64_t pixels, double vertices_per_path) {
  const double most = double(kMostPassVertices) / std::max(1.0, vertices_per_path);
  return std::min({pixels, kMostPassPaths, std::uint64_t(most)});
}

double mean_light_vertices(const RenderScene& scene, const PathSettings& settings) {
  if (scene.impl().lights->empty()) return 0;
  LightPaths& paths = thread_light_paths();
  std::size_t vertices = 0;
  constexpr int kBatches = 2;
  for (int k = 0; k < kBatches; ++k) {
    LightBatch batch;
    number_paths(pixel_key(0, 0, 0, settings.seed) ^ kCountKey, std::uint64_t(k) * kLightBatch, kLightBatch, batch);
    TraceStats ignored;
    paths.trace(scene.impl(), settings, batch, {}, CancelToken(), ignored);
    vertices += paths.vertices().size();
  }
  return double(vertices) / (kBatches * kLightBatch);
}

LightVertexCache::LightVertexCache(std::shared_ptr<const RenderScene> scene, const PathSettings& settings, int half,
                                   std::uint32_t sample, std::uint64_t paths, double vertices_per_path)
    : scene_(std::move(scene)),
      settings_(settings),
      half_(half),
      sample_(sample),
      paths_(paths),
      radius_(merges(settings.integrator) ? merging_radius(settings, scene_->impl().radius, sample) : 0) {
  counts_.light_paths = double(paths);
  counts_.connections = vertices_per_path > 0 ? settings.light_cache.connections / vertices_per_path : 1;
  counts_.merging = double(paths) * std::numbers::pi * radius_ * radius_;
  if (!scene_->impl().lights->empty()) batches_.resize(std::size_t((paths + kLightBatch - 1) / kLightBatch));
}

LightBatch LightVertexCache::numbers_of(std::size_t batch) const {
  const std::uint64_t first = std::uint64_t(batch) * kLightBatch;
  LightBatch numbers;
  number_paths(pixel_key(0, 0, half_, settings_.seed) ^ kCacheKey, std::uint64_t(sample_) * paths_ + first,
               int(std::min<std::uint64_t>(kLightBatch, paths_ - first)), numbers);
  return numbers;
}

bool LightVertexCache::trace(std::size_t b, const Camera* camera, const CancelToken& cancel, Film& film,
                             TraceStats& stats) {
  const LightBatch numbers = numbers_of(b);
  LightPaths& paths = thread_light_paths();
  TraceStats own;
  paths.trace(scene_->impl(), settings_, numbers, counts_, cancel, own);
  if (cancel.cancelled()) return false;
  Batch& batch = batches_[b];
  batch.records.clear();
  batch.paths.clear();
  batch.records.reserve(paths.vertices().size());
  batch.paths.reserve(paths.vertices().size());
  for (std::uint32_t v = 0; v < paths.vertices().size(); ++v) {
    const LightVertex& vertex = paths.vertices()[v];
    batch.records.push_back({vertex.hit, vertex.origin, vertex.arrived, vertex.throughput, vertex.mis.vcm,
                             vertex.mis.vc, vertex.media, std::uint16_t(vertex.depth), vertex.mis.first});
    batch.paths.push_back(paths.path_of(v));
  }
  own.light_paths += std::uint64_t(numbers.count);
  if (camera) add_splats(b, numbers, paths.vertices(), &paths, batch.paths, *camera, film, own);
  stats.add(own);
  return true;
}

bool LightVertexCache::splat(std::size_t b, const Camera& camera, const CancelToken& cancel, Film& film,
                             TraceStats& stats) {
  if (cancel.cancelled()) return false;
  const Batch& batch = batches_[b];
  std::vector<LightVertex> vertices;
  vertices.reserve(batch.paths.size());
  constexpr std::size_t kAhead = 16;
  for (std::size_t k = 0; k < batch.paths.size(); ++k) {
    if (k + kAhead < batch.paths.size()) expect_vertex(order_[batch.begin + k + kAhead]);
    vertices.push_back(load(records_[order_[batch.begin + k]]));
  }
  add_splats(b, numbers_of(b), vertices, nullptr, batch.paths, camera, film, stats);
  return true;
}

// t = 1.
void LightVertexCache::add_splats(std::size_t b, const LightBatch& batch, const std::vector<LightVertex>& vertices,
                                  const LightPaths* traced, const std::vector<std::uint32_t>& paths,
                                  const Camera& camera, Film& film, TraceStats& stats) const {
  const CameraImportance importance(camera);
  ConnectionRays& rays = thread_rays();
  rays.clear();  // what an exception may have left
  struct FilmPoint {
    double x, y;
  } points[ConnectionRays::kCapacity];
  SplatBatch splats(*film.splats(), half_, stats);
  const auto trace_rays = [&] {
    stats.rays += std::uint64_t(rays.count());
    stats.shadow_rays += std::uint64_t(rays.count());
    rays.trace(*scene_->impl().accel, [&](int ray, std::uint32_t path, const Rgb& radiance) {
      importance.for_each_pixel(points[ray].x, points[ray].y, [&](int x, int y, double share) {
        splats.add({x, y, radiance * float(share)}, sample_of(b, path));
      });
    });
  };
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const LightVertex& vertex = vertices[v];
    const std::uint32_t key = batch.keys[paths[v]], index = batch.reversed_index[paths[v]];
    const V2f lens = lens_sample(camera, key, index, vertex.depth);
    const ShadingPoint* const point = traced ? traced->point(std::uint32_t(v)) : nullptr;
    const auto splat = connect_to_camera(scene_->impl(), importance, vertex, point, lens, counts_, false);
    if (!splat) continue;
    if (rays.full()) trace_rays();
    points[rays.count()] = {splat->camera.film_x, splat->camera.film_y};
    add_splat_ray(vertex, *splat, key, index, paths[v], rays);
  }
  trace_rays();
  splats.finish(std::uint64_t(batch.count));
}

InvalidSample LightVertexCache::sample_of(std::size_t batch, std::uint32_t path) const {
  return {0, 0, half_, sample_, paths_, std::uint64_t(batch) * kLightBatch + path + 1};
}

bool LightVertexCache::tell(std::uint64_t path, const Camera& camera, const CancelToken& cancel,
                            SampleTrace& trace) const {
  const SceneData& scene = scene_->impl();
  const std::size_t b = std::size_t(path / kLightBatch);
  if (b >= batches_.size()) return !cancel.cancelled();  // no lights, no paths
  const std::uint32_t own = std::uint32_t(path % kLightBatch);
  const LightBatch batch = numbers_of(b);
  LightPaths& paths = thread_light_paths();
  TraceStats ignored;
  paths.trace(scene, settings_, batch, counts_, cancel, ignored);
  if (cancel.cancelled()) return false;
  const CameraImportance importance(camera);
  ConnectionRays& rays = thread_rays();
  rays.clear();
  for (std::uint32_t v = 0; v < paths.vertices().size(); ++v) {
    if (paths.path_of(v) != own) continue;
    const LightVertex& vertex = paths.vertices()[v];
    LightVertexTrace& told = trace.light_vertices.emplace_back(trace_of(vertex, scene.instance_name(vertex.hit)));
    told.number = int(trace.light_vertices.size());
    if (settings_.integrator == Integrator::photon) continue;
    const std::uint32_t key = batch.keys[own], index = batch.reversed_index[own];
    const auto splat =
        connect_to_camera(scene, importance, vertex, paths.point(v), lens_sample(camera, key, index, vertex.depth),
                          counts_, false);
    if (!splat) continue;
    told.splat = trace_of(*splat);
    add_splat_ray(vertex, *splat, key, index, own, rays);
    rays.trace(*scene.accel, [&](int, std::uint32_t, const Rgb&) { told.splat->occluded = false; });
  }
  return true;
}

void LightVertexCache::begin_index(std::size_t parts) {
  constexpr std::size_t kMostChunks = 128;
  index_parts_ = std::max<std::size_t>(parts, 1);
  const std::size_t most = std::min(index_parts_, kMostChunks);
  chunk_batches_ = std::max<std::size_t>(1, (batches_.size() + most - 1) / most);
  std::size_t count = 0;
  std::vector<std::uint32_t> chunk_sizes((batches_.size() + chunk_batches_ - 1) / chunk_batches_, 0);
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    batches_[b].begin = count;
    count += batches_[b].records.size();
    chunk_sizes[b / chunk_batches_] += std::uint32_t(batches_[b].records.size());
  }
  records_ = RawArray<Record>(count);
  if (radius_ > 0) {
    builder_.emplace(chunk_sizes, radius_);
  } else {
    order_ = RawArray<std::uint32_t>(count);
  }
}

void LightVertexCache::run_index(int sweep, std::size_t part) {
  const std::size_t first = std::min(part * chunk_batches_, batches_.size());
  const std::size_t end = std::min(first + chunk_batches_, batches_.size());
  if (!builder_) {  // as they were traced
    for (std::size_t b = first; sweep == 0 && b < end; ++b) {
      const std::size_t begin = batches_[b].begin;
      for (std::size_t k = 0; k < batches_[b].records.size(); ++k) order_[begin + k] = std::uint32_t(begin + k);
    }
    return;
  }
  if (sweep == 2) {
    for (std::size_t bucket = part; bucket < builder_->buckets(); bucket += index_parts_) builder_->sort(bucket);
    return;
  }
  if (first == end) return;
  if (sweep == 1) {
    builder_->distribute(part);
    return;
  }
  std::vector<V3f> points;
  points.reserve(builder_->chunk_size(part));
  for (std::size_t b = first; b < end; ++b) {
    for (const Record& record : batches_[b].records) points.push_back(record.position());
  }
  builder_->add(part, points);
}

void LightVertexCache::finish_index_sweep(int sweep) {
  if (!builder_) return;
  if (sweep == 0) builder_->finish_adding();
  if (sweep == 2) builder_->finish(grid_, order_);
}

void LightVertexCache::index() {
  begin_index(1);
  for (int sweep = 0; sweep < kIndexSweeps; ++sweep) {
    run_index(sweep, 0);
    finish_index_sweep(sweep);
  }
}

void LightVertexCache::gather(std::size_t b) {
  if (b == 0) builder_.reset();  // where nobody waits
  Batch& batch = batches_[b];
  for (std::size_t k = 0; k < batch.records.size(); ++k) records_.put(order_[batch.begin + k], batch.records[k]);
  batch.records = std::vector<Record>();
}

LightVertex LightVertexCache::load(const Record& r) const {
  const Ray ray{r.origin, r.hit.t, r.direction, 0};
  return {PathVertex(scene_->impl(), ray, r.hit, nullptr),
          r.origin,
          r.throughput,
          r.mis(),
          r.media,
          int(r.depth),
          kNoVertex};
}

LightVertex LightVertexCache::load(std::size_t v) const {
  return load(records_[v]);
}

std::size_t LightVertexCache::bytes() const {
  std::size_t sum = records_.bytes() + order_.bytes() + grid_.bytes();
  for (const Batch& batch : batches_) {
    sum += batch.records.capacity() * sizeof(Record) + batch.paths.capacity() * sizeof(std::uint32_t);
  }
  return sum;
}

}  // namespace helio
