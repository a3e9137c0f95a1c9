// Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994): every camera path of a group has a
// light path of its own, and is joined to it at every pair of vertices. Light paths are joined to the camera as well,
// and land on any pixel (splats).
//
// A path of s light and t camera vertices, s + t - 1 segments, by how it is made:
//   s = 0         the camera path meets a light          pdf of s = 1 (LightSampler::pdf_w_*) and of emission
//   s = 1, t > 1  next-event estimation                   emission density, camera vertex's BSDF both ways
//   s > 1, t > 1  a light vertex is joined to a camera's  both vertices' BSDFs both ways
//   s > 1, t = 1  a light vertex is joined to the camera  camera's density, light vertex's BSDF both ways
// Lights seen directly (one segment) have s = 0 alone. Delta surfaces are joined to nothing; delta lights are not met.
//
// Light path number n of a block of the film is sample n of a sequence of the block's own (sampler.h), so that the
// light paths of neighbouring pixels are spread evenly over the lights.
#include <memory>
#include <optional>

#include "renderer/film/splat_buffer.h"
#include "renderer/trace/bsdf_lambert.h"
#include "renderer/trace/camera_importance.h"
#include "renderer/trace/connection_rays.h"
#include "renderer/trace/light_paths.h"
#include "renderer/trace/path_kernel_base.h"

namespace helio {

namespace {

// A camera path's share of what PathGroup keeps.
struct CameraPaths {
  MisState mis[kGroupPaths];
  LightBatch batch;
  LightPaths lights;
  ConnectionRays rays;
};

class BidirectionalKernel : public PathKernelBase<BidirectionalKernel, NoWatch> {
  using Base = PathKernelBase<BidirectionalKernel, NoWatch>;

 public:
  explicit BidirectionalKernel(const WindowTask& task)
      : Base(task),
        paths_(thread_paths()),
        camera_(task.splat_camera ? *task.splat_camera : task.camera),
        tiles_(task.film.light_tiles().get()),
        light_paths_(light_paths_of(task, tiles_)),
        light_only_(task.settings.integrator == Integrator::light) {}

 private:
  friend Base;

  // That a sample of every pixel comes with.
  static double light_paths_of(const WindowTask& task, const LightTiles* tiles) {
    const PixelRect region = task.settings.region.empty() ? task.film.bounds() : task.settings.region;
    return tiles ? tiles->pixels_in(region) : double(region.area());
  }

  static CameraPaths& thread_paths() {
    static thread_local std::unique_ptr<CameraPaths> paths(new CameraPaths);
    return *paths;
  }

  void prepare_paths(int count) {
    if (scene_.mip_mapped) std::fill_n(group_.cones, count, task_.camera.cone());
    trace_light_paths(count);
    connect_to_camera();
    for (int i = 0; i < count; ++i) {
      paths_.mis[i] = MisState::camera(camera_.density(group_.rays[i].direction), light_paths_);
    }
  }

  void trace_light_paths(int count) {
    constexpr std::uint32_t kBlockPaths = kGroupPaths;
    const std::uint32_t sample = reverse_bits(reversed_index_);
    // Numbers have 32 bits; samples beyond begin another sequence.
    const std::uint32_t era = sample / (0x80000000u / (kBlockPaths / 2));
    LightBatch& batch = paths_.batch;
    batch.count = has_lights_ ? count : 0;
    for (int i = 0; i < batch.count; ++i) {
      const int x = group_.pixel_x[i], y = group_.pixel_y[i];
      const std::uint32_t key =
          pixel_key(x / kPathGroupSize, y / kPathGroupSize, task_.range.half, task_.settings.seed);
      batch.keys[i] = combine_hash(key ^ 0x1f83d9abu, era);
      const auto own = std::uint32_t(y % kPathGroupSize * kPathGroupSize + x % kPathGroupSize);
      batch.reversed_index[i] = reverse_bits(sample * kBlockPaths + own);
    }
    paths_.lights.trace(scene_, task_.settings, batch, task_.cancel, stats_);
  }

  // t = 1.
  void connect_to_camera() {
    const std::vector<LightVertex>& vertices = paths_.lights.vertices();
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
      const LightVertex& vertex = vertices[v];
      const std::uint32_t i = paths_.lights.path_of(v);
      const std::uint32_t key = paths_.batch.keys[i], index = paths_.batch.reversed_index[i];
      V2f lens(0.5f, 0.5f);
      if (!task_.camera.pinhole()) {
        const SamplePair drawn = sample_pair(key, index, kLensPair + std::uint32_t(vertex.depth));
        lens = V2f(drawn.x, drawn.y);
      }
      const CameraConnection c = camera_.connect(vertex.surface.position, lens);
      if (!(c.density > 0) || !(c.distance > 0)) continue;
      const V3f to_light = -vertex.arrived;
      const BsdfValue value = vertex.scatter(scene_, c.direction, to_light, nullptr, to_light);
      if (is_black(value.f_cos)) continue;
      const double pdf_camera = c.pdf_area(vertex.cosine(c.direction), camera_.finite());
      const float arriving = vertex.cosine(to_light);
      if (!(arriving > 0)) continue;
      const double weight = light_only_ ? 1 : weight_of_splat(vertex.mis, pdf_camera, light_paths_, value.pdf_w);
      // adjoint_weight() times the geometry term to the camera times its importance: the cosine is in pdf_camera.
      Rgb radiance = vertex.throughput * value.f_cos * float(weight * pdf_camera / arriving);
      if (scene_.features.absorption) {
        radiance *= shadow_transmittance(scene_, vertex.media, *vertex.surface.part, vertex.surface.front,
                                         dot(vertex.surface.geometric_normal, c.direction) > 0, c.distance);
      }
      if (is_black(radiance)) continue;
      if (paths_.rays.full()) trace_splats();
      film_points_[paths_.rays.count()] = {c.film_x, c.film_y};
      if (task_.squares) {
        const double ratio = vertex.mis.path_tracer_behind(pdf_camera / light_paths_, value.pdf_w);
        // A light path's share of the pixel is its try's, of which there are so many.
        squares_of_rays_[paths_.rays.count()] =
            path_tracer_square(luminance(radiance) / light_paths_, weight, ratio, task_.rare) * light_paths_;
      }
      paths_.rays.add_between(vertex.start(c.direction), vertex.surface.position + c.direction * c.distance,
                              combine_hash(key ^ 0x5be0cd19u, index + std::uint32_t(vertex.depth)), i, radiance);
    }
    trace_splats();
  }

  void trace_splats() {
    trace_rays([&](int ray, std::uint32_t path, const Rgb& radiance) {
      const FilmPoint& at = film_points_[ray];
      // A light path is the window's whose pixel's camera path it goes with.
      if (!task_.window.contains(group_.pixel_x[path], group_.pixel_y[path])) return;
      arrivals_.push_back({at, radiance});
      if (task_.squares)
        camera_.for_each_pixel(at.x, at.y, [&](int x, int y, double share) {
          squares_.push_back({x, y, Rgb(float(squares_of_rays_[ray] * share))});
        });
    });
  }

  template <typename Function>
  void trace_rays(Function&& arrived) {
    if (task_.log) task_.log->add(paths_.rays.rays(), nullptr, std::size_t(paths_.rays.count()), true);
    stats_.rays += std::uint64_t(paths_.rays.count());
    stats_.shadow_rays += std::uint64_t(paths_.rays.count());
    paths_.rays.trace(*scene_.accel, arrived);
  }

  int shade(int vertex, int active) {
    PathGroup& b = group_;
    int survivors = 0;
    for (int j = 0; j < active; ++j) {
      const std::uint32_t i = b.active[j];
      if (shade_vertex(vertex, j, i)) b.active[survivors++] = i;
    }
    trace_connections();
    return survivors;
  }

  void trace_connections() {
    trace_rays([&](int ray, std::uint32_t path, const Rgb& radiance) {
      group_.paths[path].radiance += radiance;
      if (task_.squares) add_square(path, squares_of_rays_[ray]);
    });
  }

  // Of the pixel that the path is a sample of.
  void add_square(std::uint32_t path, double square) {
    const int x = group_.pixel_x[path], y = group_.pixel_y[path];
    if (task_.window.contains(x, y)) squares_.push_back({x, y, Rgb(float(square * light_paths_))});
  }

  float environment_weight(int vertex, std::uint32_t i) {
    if (vertex == 1) return 1;
    const PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    const double pdf_w = lights_.pdf_w_environment(ray.origin, path.normal, ray.direction);
    const double weight = weight_of_hit(paths_.mis[i], pdf_w, lights_.pdf_emission_environment(ray.direction));
    if (task_.squares) add_hit_square(i, lights_.environment_radiance(ray.direction), weight, pdf_w);
    return float(weight);
  }

  void add_hit_square(std::uint32_t i, const Rgb& radiance, double weight, double pdf_direct) {
    const double brought = weight * luminance(group_.paths[i].beta * radiance);
    add_square(i, path_tracer_square(brought, weight, 1 + pdf_direct * pdf_direct * paths_.mis[i].vcm, task_.rare));
  }

  float emission_weight(int vertex, std::uint32_t i, std::uint32_t emitter, const Rgb& radiance, float distance,
                        float cos_light) {
    if (vertex == 1) return 1;
    const PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    const double pdf_w = lights_.pdf_w_area(ray.origin, path.normal, ray.direction, emitter, distance, cos_light);
    const double pdf_area = pdf_w * std::fabs(cos_light) / (double(distance) * distance);
    const double weight = weight_of_hit(paths_.mis[i], pdf_area, lights_.pdf_emission_area(emitter, cos_light));
    if (task_.squares) add_hit_square(i, radiance, weight, pdf_area);
    return float(weight);
  }

  // One vertex of one camera path. True when the path goes on along the new ray in group_.rays[i].
  bool shade_vertex(int vertex, int j, std::uint32_t i) {
    PathGroup& b = group_;
    PathState& path = b.paths[i];
    MisState& mis = paths_.mis[i];
    Ray& ray = b.rays[i];
    const Hit& hit = b.hits[i];
    if (!hit.valid()) {
      leave_scene(vertex, i);
      return false;
    }
    if (scene_.mip_mapped) b.cones[i].advance(hit.t);
    const PathVertex at(scene_, ray, hit, scene_.mip_mapped ? &b.cones[i] : nullptr);
    const Surface& surface = at.surface;
    const MaterialRecord& material = *surface.material;
    const V3f to_camera = -ray.direction;
    if (path.media.count > 0) path.beta *= transmittance(scene_, path.media, hit.t);
    mis.arrive(hit.t, at.cosine(to_camera), vertex > 1 || camera_.finite());
    if (material.emissive) add_emission(vertex, i, hit, surface);

    std::optional<ShadingPoint> made;  // of all that is not Lambert
    if (!at.lambert) made.emplace(scene_, hit, surface, to_camera, at.footprint);
    const ShadingPoint* point = made ? &*made : nullptr;
    const bool black = material.one_sided && !surface.front;
    const Frame frame = point ? point->frame : Frame(at.facing_normal());
    const V3f wo = frame.to_local(to_camera);
    if (vertex == 1) {
      const Rgb albedo = black ? Rgb(0, 0, 0) : point ? surface_albedo(point->params, wo) : at.albedo;
      const V3f seen = point && point->params.mapped ? frame.to_world(point->params.map_normal) : frame.n;
      b.first[i] = {albedo, seen, hit.t, instance_name(hit), hit.primitive};
    }
    if (light_only_ || black || vertex >= task_.settings.max_segments) return false;
    if (point && point->params.model == LobeModel::none) return false;

    // The next direction first: what is evaluated below may overwrite the parts of a blend.
    const V2f u(b.bsdf_x[j], b.bsdf_y[j]);
    const BsdfSample sample = point ? sample_bsdf(point->params, wo, b.lobe[j], u)
                                    : sample_lambert(at.albedo, wo, square_to_cosine_hemisphere(u));
    const bool transmissive = point && lets_light_through(point->params);
    const V3f light_normal = transmissive ? V3f(0, 0, 0) : at.facing_normal();
    if (has_lights_ && !(point ? is_pure_delta(point->params) : is_black(at.albedo))) {
      sample_light(vertex, j, i, at, point, light_normal, transmissive);
      connect(vertex, i, at, point);
    }

    if (!sample.valid()) return false;
    const V3f direction = frame.to_world(sample.wi);
    if (point && !(dot(point->geometric_normal(), direction) * sample.wi.z > 0)) return false;
    if (!sample.delta) {
      const BsdfValue reverse = at.scatter(scene_, direction, to_camera, point, to_camera);
      mis.scatter(sample.pdf_w, reverse.pdf_w, at.cosine(direction));
    } else if (at.mirrors_back(scene_, *point, to_camera, direction)) {
      mis.scatter_delta(at.cosine(direction));
    } else {
      mis.scatter_one_way();
    }
    path.beta *= sample.weight;
    path.normal = light_normal;
    if (scene_.mip_mapped && !sample.delta) b.cones[i].scatter(sample.pdf_w);
    path.eta_scale *= sample.eta * sample.eta;
    if (sample.transmitted && material.volume) path.media.cross(surface.part->material, wo.z > 0);
    if (is_black(path.beta)) return false;
    if (vertex >= task_.settings.roulette_from) {
      const float survival = survival_probability(task_.settings.roulette, path.beta * path.eta_scale);
      if (!survives(b.roulette[j], survival)) return false;
      path.beta *= 1 / survival;
    }
    ray.origin = at.start(direction);
    ray.direction = direction;
    ray.alpha_key = alpha_key(path.key, reversed_index_, vertex + 1);
    return true;
  }

  // s = 1.
  void sample_light(int vertex, int j, std::uint32_t i, const PathVertex& at, const ShadingPoint* point,
                    const V3f& light_normal, bool transmissive) {
    const PathGroup& b = group_;
    const PathState& path = b.paths[i];
    const Surface& surface = at.surface;
    const V3f from = transmissive ? surface.position : at.near_side;
    const LightSample light = lights_.sample(from, light_normal, b.select[j], V2f(b.light_x[j], b.light_y[j]));
    if (!(light.pdf_w > 0) || is_black(light.radiance)) return;
    const V3f to_camera = -at.arrived;
    const BsdfValue value = at.scatter(scene_, to_camera, light.direction, point, to_camera);
    if (is_black(value.f_cos)) return;
    const BsdfValue reverse = at.scatter(scene_, light.direction, to_camera, point, to_camera);
    const double weight =
        weight_of_light_sample(paths_.mis[i], light.pdf_w, lights_.pdf_emission(light), light.delta, light.distance,
                               light.cos_light, at.cosine(light.direction), value.pdf_w, reverse.pdf_w);
    Rgb radiance = path.beta * value.f_cos * light.radiance * float(weight / light.pdf_w);
    if (scene_.features.absorption) {
      radiance *= shadow_transmittance(scene_, path.media, *surface.part, surface.front,
                                       dot(surface.geometric_normal, light.direction) > 0, light.distance);
    }
    const float t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene_.radius);
    if (paths_.rays.full()) trace_connections();
    if (task_.squares) {
      const double hit = light.delta ? 0 : mis_ratio(value.pdf_w, light.pdf_w);
      squares_of_rays_[paths_.rays.count()] = path_tracer_square(luminance(radiance), weight, 1 + hit, task_.rare);
    }
    paths_.rays.add(at.start(light.direction), light.direction, t_max, alpha_key(path.key, reversed_index_, -vertex), i,
                    radiance);
  }

  // s > 1: to the vertices of the camera path's own light path.
  void connect(int vertex, std::uint32_t i, const PathVertex& at, const ShadingPoint* point) {
    const PathState& path = group_.paths[i];
    const V3f to_camera = -at.arrived;
    for (std::uint32_t v = paths_.lights.last(int(i)); v != kNoVertex;) {
      const LightVertex& light = paths_.lights.vertices()[v];
      v = light.previous;
      if (vertex + light.depth + 1 > task_.settings.max_segments) continue;
      const V3f between = light.surface.position - at.surface.position;
      const double squared = dot(V3d(between), V3d(between));
      if (!(squared > 0)) continue;
      const double distance = std::sqrt(squared);
      const V3f direction(V3d(between) / distance), back = -direction, to_light = -light.arrived;
      const BsdfValue camera_value = at.scatter(scene_, to_camera, direction, point, to_camera);
      if (is_black(camera_value.f_cos)) continue;
      const BsdfValue light_value = light.scatter(scene_, back, to_light, nullptr, to_light);
      if (is_black(light_value.f_cos)) continue;
      const double camera_reverse = at.scatter(scene_, direction, to_camera, point, to_camera).pdf_w;
      const double light_forward = light.scatter(scene_, to_light, back, nullptr, to_light).pdf_w;
      const double cos_camera = at.cosine(direction), cos_light = light.cosine(direction);
      const double weight =
          weight_of_connection(paths_.mis[i], light.mis, light_forward * cos_camera / squared, camera_reverse,
                               camera_value.pdf_w * cos_light / squared, light_value.pdf_w);
      // f_cos has the cosine at the camera's vertex; adjoint_weight() that at the light's.
      const Rgb leaving = adjoint_weight(light, light_value.f_cos, back, to_light);
      Rgb radiance = path.beta * camera_value.f_cos * light.throughput * leaving * float(weight / squared);
      if (scene_.features.absorption) {
        radiance *= shadow_transmittance(scene_, path.media, *at.surface.part, at.surface.front,
                                         dot(at.surface.geometric_normal, direction) > 0, float(distance));
      }
      if (is_black(radiance)) continue;
      if (paths_.rays.full()) trace_connections();
      if (task_.squares) {
        const double ratio = light.mis.path_tracer_behind(camera_value.pdf_w * cos_light / squared, light_value.pdf_w);
        squares_of_rays_[paths_.rays.count()] = path_tracer_square(luminance(radiance), weight, ratio, task_.rare);
      }
      paths_.rays.add_between(at.start(direction), light.start(back),
                              combine_hash(alpha_key(path.key, reversed_index_, -vertex), std::uint32_t(light.depth)),
                              i, radiance);
    }
  }

  // The window's light paths are as many as its samples. A wide filter spreads each over thousands of pixels, so that
  // they are handed over as they are spread.
  void committed() {
    SplatBuffer& buffer = *task_.film.splats();
    std::vector<Splat> splats;
    const auto hand_over = [&](std::uint64_t light_paths) {
      stats_.invalid_splats += buffer.add(task_.range.half, splats, light_paths);
      splats.clear();
    };
    for (const Arrival& arrival : arrivals_) {
      camera_.for_each_pixel(arrival.at.x, arrival.at.y, [&](int x, int y, double share) {
        // What other tiles' camera paths bring is all there is.
        if (!tiles_ || tiles_->on(x, y)) splats.push_back({x, y, arrival.radiance * float(share)});
      });
      if (splats.size() >= kMostSplats) hand_over(0);
    }
    hand_over(samples());
    if (task_.squares) task_.squares->add(task_.range.half, squares_, samples());
    stats_.light_paths += samples();
  }

  // Pairs of dimensions of a light path that choose points of the lens, by the vertex; beyond all others.
  static constexpr std::uint32_t kLensPair = 0x40000;

  static constexpr std::size_t kMostSplats = 1u << 16;  // that are handed over at a time

  struct FilmPoint {
    double x, y;
  };
  // Of a light path at the camera.
  struct Arrival {
    FilmPoint at;
    Rgb radiance;
  };

  CameraPaths& paths_;
  const CameraImportance camera_;
  const LightTiles* tiles_;  // null: light paths everywhere
  const double light_paths_;
  const bool light_only_;
  FilmPoint film_points_[ConnectionRays::kCapacity];  // by ray, as the next
  double squares_of_rays_[ConnectionRays::kCapacity];
  std::vector<Arrival> arrivals_;
  std::vector<Splat> squares_;
};

}  // namespace

bool run_bidirectional_kernel(const WindowTask& task, TraceStats& stats) {
  return BidirectionalKernel(task).run(stats);
}

}  // namespace helio
