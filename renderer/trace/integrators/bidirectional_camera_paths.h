// Camera paths of the bidirectional techniques, on top of what all camera paths do: what they meet (s = 0), light
// samples (s = 1), and the joining of a camera vertex to a light vertex (s > 1), each with its weight
// (bidirectional_mis.h). Which light vertices a camera vertex is joined to is the kernel's on top of this.
#pragma once

#include <cmath>
#include <memory>

#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/camera/camera_importance.h"
#include "renderer/trace/integrators/camera_path_kernel.h"
#include "renderer/trace/paths/connection_rays.h"
#include "renderer/trace/paths/light_paths.h"

namespace helio {

// A camera path's share of what PathGroup keeps.
struct BidirectionalGroup {
  MisState mis[kGroupPaths];
  ConnectionRays rays;
};

// Kernel derives from this, which gives CameraPathKernel its light(), and has prepare_paths(), join(), by join_to(),
// and, where what stands below does not suit its techniques, its own
//   bool samples_lights(int vertex) const, bool ends_with(const BsdfSample&) const       at a vertex
template <typename Kernel, typename Recorder>
class BidirectionalCameraPaths : public CameraPathKernel<Kernel, Recorder> {
  using Base = CameraPathKernel<Kernel, Recorder>;

 protected:
  using Base::alpha_key, Base::group_, Base::kernel, Base::lights_, Base::recorder_, Base::reversed_index_,
      Base::scene_, Base::stats_, Base::task_;

  friend Base;
  friend PathKernelBase<Kernel, Recorder>;

  BidirectionalCameraPaths(const WindowTask& task, const TechniqueCounts& counts)
      : Base(task),
        camera_(task.splat_camera ? *task.splat_camera : task.camera),
        counts_(counts),
        light_only_(task.settings.integrator == Integrator::light),
        technique_(task.settings.technique ? &*task.settings.technique : nullptr),
        paths_(thread_paths()) {
    paths_.rays.clear();  // what an exception may have left
  }

  bool shows_emission(int vertex) const { return shows(0, vertex + 1); }
  bool ends_at_surfaces() const { return light_only_; }
  bool samples_lights(int vertex) const { return shows(1, vertex + 1); }
  bool ends_with(const BsdfSample&) const { return false; }
  bool stops(int vertex, const BsdfSample& sample) {
    return (technique_ && vertex + 1 >= technique_->camera_vertices) || kernel().ends_with(sample);
  }
  void trace_joined() { trace_connections(); }

  void arrived(int vertex, std::uint32_t path, const PathVertex& at) {
    paths_.mis[path].arrive(at.hit.t, at.cosine(-at.arrived), vertex > 1 || camera_.finite());
  }

  void scattered(const CameraVertex& v, const V3f& direction) {
    MisState& mis = paths_.mis[v.path];
    const V3f to_camera = -v.at.arrived;
    if (!v.sample.delta) {
      const BsdfValue reverse = v.at.scatter(scene_, direction, to_camera, v.shading_point(), to_camera);
      mis.scatter(v.sample.pdf_w, reverse.pdf_w, v.at.cosine(direction), counts_);
    } else if (v.at.mirrors_back(*v.point, to_camera, direction)) {
      mis.scatter_delta(v.at.cosine(direction));
    } else {
      mis.scatter_one_way();
    }
  }

  static BidirectionalGroup& thread_paths() {
    static thread_local std::unique_ptr<BidirectionalGroup> paths(new BidirectionalGroup);
    return *paths;
  }

  std::uint64_t light_paths() const { return std::uint64_t(counts_.light_paths); }

  // Whether the picture shows paths of s light and t camera vertices.
  bool shows(int s, int t) const {
    return !technique_ || (technique_->light_vertices == s && technique_->camera_vertices == t);
  }
  // With which a path of MIS weight `weight` counts.
  double counting(double weight) const { return technique_ && technique_->unweighted ? 1 : weight; }

  void start_camera_paths(int count) {
    Base::start_cones(count);
    for (int i = 0; i < count; ++i) {
      paths_.mis[i] = MisState::camera(camera_.density(group_.rays[i].direction), counts_.light_paths);
    }
  }

  template <typename Function>
  void trace_rays(Function&& arrived) {
    if (task_.log) task_.log->add(paths_.rays.rays(), nullptr, std::size_t(paths_.rays.count()), true);
    stats_.rays += std::uint64_t(paths_.rays.count());
    stats_.shadow_rays += std::uint64_t(paths_.rays.count());
    paths_.rays.trace(*scene_.accel, arrived);
  }

  void trace_connections() {
    trace_rays([&](int ray, std::uint32_t path, const Rgb& radiance) {
      recorder_.joined(path, ray, paths_.rays.rays()[ray].direction, radiance);
      recorder_.ray_arrived(ray);
      group_.paths[path].radiance += radiance;
      if (task_.squares) add_squares(path, squares_of_rays_[ray]);
    });
    recorder_.rays_traced();
  }

  // The picture of squares has an end, and what lies beyond it is no less rare. A sum holds 2^32 of the largest.
  Rgb that_enters(const RareSquares& squares) const {
    const double most = 0x1p-20 * SplatBuffer::most_radiance(task_.film.width(), task_.film.height());
    const auto entering = [&](double square) { return float(std::min(square / unit_of_squares(task_.rare), most)); };
    return {entering(squares.path), entering(squares.bdpt), 0};
  }

  // Of the pixel that the path is a sample of.
  void add_squares(std::uint32_t path, const RareSquares& squares) {
    const int x = group_.pixel_x[path], y = group_.pixel_y[path];
    if (task_.window.contains(x, y)) squares_.push_back({x, y, that_enters(squares * counts_.light_paths)});
  }

  float environment_weight(int vertex, std::uint32_t i) {
    if (!shows(0, vertex + 1)) return 0;
    if (vertex == 1) return 1;
    const PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    const double pdf_w = lights_.pdf_w_environment(ray.origin, path.normal, ray.direction);
    const double weight = weight_of_hit(paths_.mis[i], pdf_w, lights_.pdf_emission_environment(ray.direction), counts_);
    if (task_.squares) add_hit_squares(i, lights_.environment_radiance(ray.direction), weight, pdf_w);
    return float(counting(weight));
  }

  void add_hit_squares(std::uint32_t i, const Rgb& radiance, double weight, double pdf_direct) {
    const double brought = weight * luminance(group_.paths[i].beta * radiance);
    add_squares(i, rare_squares(brought, weight, 1 + pdf_direct * pdf_direct * paths_.mis[i].vcm, task_.rare));
  }

  float emission_weight(int vertex, std::uint32_t i, std::uint32_t emitter, const Rgb& radiance, float distance,
                        float cos_light) {
    if (vertex == 1) return 1;
    const PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    const double pdf_w = lights_.pdf_w_area(ray.origin, path.normal, ray.direction, emitter, distance, cos_light);
    const double pdf_area = pdf_w * std::fabs(cos_light) / (double(distance) * distance);
    const double weight =
        weight_of_hit(paths_.mis[i], pdf_area, lights_.pdf_emission_area(emitter, cos_light), counts_);
    if (task_.squares) add_hit_squares(i, radiance, weight, pdf_area);
    return float(counting(weight));
  }

  // s = 1.
  void light(int vertex, const CameraVertex& v, const LightSample& light) {
    const std::uint32_t i = v.path;
    const PathVertex& at = v.at;
    const ShadingPoint* point = v.shading_point();
    const PathState& path = group_.paths[i];
    const Surface& surface = at.surface;
    recorder_.light_sample(i, light);
    if (!(light.pdf_w > 0) || is_black(light.radiance)) return;
    const V3f to_camera = -at.arrived;
    const auto [value, reverse] = at.scatter_both_ways(scene_, to_camera, light.direction, point);
    recorder_.light_value(i, light, value);
    if (is_black(value.f_cos)) return;
    const double weight =
        weight_of_light_sample(paths_.mis[i], light.pdf_w, lights_.pdf_emission(light), light.delta, light.distance,
                               light.cos_light, at.cosine(light.direction), value.pdf_w, reverse.pdf_w, counts_);
    Rgb radiance = path.beta * value.f_cos * light.radiance * float(counting(weight) / light.pdf_w);
    if (scene_.features.absorption) {
      radiance *= shadow_transmittance(scene_, path.media, *surface.part, surface.front,
                                       dot(surface.geometric_normal, light.direction) > 0, light.distance);
    }
    const float t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene_.radius);
    if (paths_.rays.full()) trace_connections();
    if (task_.squares) {
      const double hit = light.delta ? 0 : mis_ratio(value.pdf_w, light.pdf_w);
      squares_of_rays_[paths_.rays.count()] = rare_squares(luminance(radiance), weight, 1 + hit, task_.rare);
    }
    recorder_.shadow_ray(i, t_max, radiance);
    recorder_.light_ray(i, paths_.rays.count(), counting(weight));
    paths_.rays.add(at.start(light.direction), light.direction, t_max, alpha_key(path.key, reversed_index_, -vertex), i,
                    radiance);
  }

  // s > 1: to a light vertex, which stands for `share` of those that a camera path is to be joined to.
  // `number` tells the connections of a camera vertex apart. light_point: the light vertex as its light sees it; null:
  // not at hand.
  void join_to(int vertex, const CameraVertex& v, const LightVertex& light, const ShadingPoint* light_point,
               std::uint32_t number, double share) {
    const std::uint32_t i = v.path;
    const PathVertex& at = v.at;
    const ShadingPoint* point = v.shading_point();
    if (vertex + light.depth + 1 > task_.settings.max_segments) return;
    if (!shows(light.depth + 1, vertex + 1)) return;
    const PathState& path = group_.paths[i];
    const V3f between = light.surface.position - at.surface.position;
    const V3f to_camera = -at.arrived, to_light = -light.arrived;
    if (!at.may_scatter(to_camera, between) || !light.may_scatter(-between, to_light)) return;
    const double squared = dot(V3d(between), V3d(between));
    if (!(squared > 0)) return;
    const double distance = std::sqrt(squared);
    const V3f direction(V3d(between) / distance), back = -direction;
    const auto [camera_value, camera_reverse] = at.scatter_both_ways(scene_, to_camera, direction, point);
    if (is_black(camera_value.f_cos)) return;
    recorder_.connection_value(direction, camera_value);
    Late<ShadingPoint> made;
    if (!light_point && light.keeps_its_point()) light_point = &light.look_from(scene_, to_light, made);
    const auto [light_forward, light_value] = light.scatter_both_ways(scene_, to_light, back, light_point);
    if (is_black(light_value.f_cos)) return;
    const double cos_camera = at.cosine(direction), cos_light = light.cosine(direction);
    const double weight =
        weight_of_connection(paths_.mis[i], light.mis, light_forward.pdf_w * cos_camera / squared, camera_reverse.pdf_w,
                             camera_value.pdf_w * cos_light / squared, light_value.pdf_w, counts_);
    // f_cos has the cosine at the camera's vertex; adjoint_weight() that at the light's.
    const Rgb leaving = adjoint_weight(light, light_value.f_cos, back, to_light);
    Rgb radiance =
        path.beta * camera_value.f_cos * light.throughput * leaving * float(share * counting(weight) / squared);
    if (scene_.features.absorption) {
      radiance *= shadow_transmittance(scene_, path.media, *at.surface.part, at.surface.front,
                                       dot(at.surface.geometric_normal, direction) > 0, float(distance));
    }
    if (is_black(radiance)) return;
    if (paths_.rays.full()) trace_connections();
    if (task_.squares) {
      const double ratio = light.mis.path_tracer_behind(camera_value.pdf_w * cos_light / squared, light_value.pdf_w);
      squares_of_rays_[paths_.rays.count()] = rare_squares(luminance(radiance), weight, ratio, task_.rare);
    }
    recorder_.connection(i, paths_.rays.count(), light, distance, counting(weight), radiance);
    paths_.rays.add_between(at.start(direction), light.start(back),
                            combine_hash(alpha_key(path.key, reversed_index_, -vertex), number), i, radiance);
  }

  const CameraImportance camera_;
  const TechniqueCounts counts_;
  const bool light_only_;
  const Technique* technique_;  // null: all together
  BidirectionalGroup& paths_;
  RareSquares squares_of_rays_[ConnectionRays::kCapacity];  // by ray
  std::vector<Splat> squares_;
};

}  // namespace helio
