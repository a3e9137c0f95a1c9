// What a kernel is told to write down of what it does: nothing where it renders, everything about one sample where that
// sample is traced again (sample_trace.h). Of the first nothing is left in the compiled kernel. Others note what later
// pictures draw on, as direction_recorder.h does.
#pragma once

#include <algorithm>
#include <vector>

#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/paths/light_paths.h"
#include "renderer/trace/paths/path_group.h"
#include "renderer/trace/paths/path_kernel.h"
#include "renderer/trace/paths/sample_trace.h"
#include "renderer/trace/paths/splat_connection.h"
#include "renderer/trace/sampling/mis.h"

namespace helio {

// How a path goes on after a scattering: its throughput behind it, what roulette says, and whether it does.
struct Onward {
  Rgb throughput;
  bool roulette = false;
  float survival = 1, u = 0;
  bool goes_on = false;
};

// Events of the vertices of a batch interleave (camera_path_kernel.h): segment() to scattering() of all, then scatter()
// of all, then light_sample() to onward() of each. Where kFollowsVertices is true, all events of a first vertex come
// before those of the next; of later vertices they interleave.
struct NoRecorder {
  static constexpr bool kRecordsSample = false;
  static constexpr bool kRecordsForReuse = false;
  static constexpr bool kFollowsVertices = false;
  static constexpr bool kListsPixels = false;  // WindowTask::pixels in place of the window and the film

  explicit NoRecorder(const WindowTask&) {}
  static PixelRect film_bounds(const WindowTask& task) { return task.film.bounds(); }
  void placed(std::uint32_t) {}
  void segment(int, std::uint32_t, const PathGroup&) {}
  void hit(std::uint32_t, const Hit&, std::uint32_t, const Rgb&) {}
  void emission(std::uint32_t, const Rgb&, float) {}
  void surface(std::uint32_t, const Surface&, const SurfaceParams&, const V3f&, const V3f&, bool) {}
  // The BSDF of the vertex of the last surface(), there until it goes on or ends; null: it is Lambert.
  void scattering(const Bsdf*) {}
  void light_sample(std::uint32_t, const LightSample&) {}
  void light_value(std::uint32_t, const LightSample&, const BsdfValue&) {}
  void shadow_ray(std::uint32_t, float, const Rgb&) {}
  // Of kernels that join vertices, in place of the two above and below: nothing lies between the vertex and a light or
  // a light path's vertex in this direction, and this is what that brings.
  void joined(std::uint32_t, int, const V3f&, const Rgb&) {}
  void occluded(std::uint32_t, bool) {}
  void scatter(std::uint32_t, const BsdfSample&, const Frame&) {}
  void onward(std::uint32_t, const Onward&) {}
  void light_vertex(std::uint32_t, const LightVertex&, std::uint32_t) {}
  void splat(std::uint32_t, int, const LightVertex&, const SplatConnection&) {}
  void merged(std::uint32_t, int, const Rgb&) {}
  void light_ray(std::uint32_t, int, double) {}
  // Before connection(), if that comes, and straight after the vertex was looked at.
  void connection_value(const V3f&, const BsdfValue&) {}
  void connection(std::uint32_t, int, const LightVertex&, double, double, const Rgb&) {}
  void ray_arrived(int) {}
  void rays_traced() {}
};

// `path` is an index in the group throughout; what is said of other paths than the watched one goes nowhere.
class SampleRecorder {
 public:
  static constexpr bool kRecordsSample = true;
  static constexpr bool kRecordsForReuse = false;
  static constexpr bool kFollowsVertices = false;
  static constexpr bool kListsPixels = false;

  explicit SampleRecorder(const WindowTask& task) : trace_(*task.trace) {}

  static PixelRect film_bounds(const WindowTask& task) { return {0, 0, task.trace->width, task.trace->height}; }
  void placed(std::uint32_t path) { recorded_ = path; }

  // The path arrives at its next vertex, or leaves the scene.
  void segment(int vertex, std::uint32_t path, const PathGroup& group) {
    if (path != recorded_) return;
    VertexTrace& v = trace_.vertices.emplace_back();
    const PathState& state = group.paths[path];
    v.number = vertex;
    v.origin = group.rays[path].origin;
    v.direction = group.rays[path].direction;
    v.pdf_w = state.pdf_w;
    v.radiance = state.radiance;
    v.throughput = state.beta;
  }

  // `beta`: the throughput that arrives.
  void hit(std::uint32_t path, const Hit& hit, std::uint32_t instance_name, const Rgb& beta) {
    VertexTrace& v = note(path);
    v.hit = true;
    v.throughput = beta;
    v.distance = hit.t;
    v.instance = instance_name;
    v.primitive = hit.primitive;
  }

  void emission(std::uint32_t path, const Rgb& radiance, float weight) {
    VertexTrace& v = note(path);
    v.emitted = radiance;
    v.emitted_weight = weight;
  }

  void surface(std::uint32_t path, const Surface& surface, const SurfaceParams& params, const V3f& normal,
               const V3f& geometric_normal, bool black) {
    VertexTrace& v = note(path);
    v.position = surface.position;
    v.geometric_normal = geometric_normal;
    v.shading_normal = normal;
    v.front = surface.front;
    v.material = surface.part->material;
    v.black_side = black;
    v.params = params;
    v.params.layers = nullptr;
  }

  void scattering(const Bsdf*) {}

  void light_sample(std::uint32_t path, const LightSample& light) { note(path).light.sample = light; }

  void light_value(std::uint32_t path, const LightSample& light, const BsdfValue& value) {
    LightTrace& trace = note(path).light;
    trace.evaluated = true;
    trace.f_cos = value.f_cos;
    trace.bsdf_pdf_w = value.pdf_w;
    trace.mis_weight = light.delta ? 1.0f : mis_weight(light.pdf_w, value.pdf_w);
  }

  void shadow_ray(std::uint32_t path, float t_max, const Rgb& contribution) {
    LightTrace& trace = note(path).light;
    trace.shadow_ray = true;
    trace.t_max = t_max;
    trace.contribution = contribution;
  }

  void occluded(std::uint32_t path, bool occluded) { note(path).light.occluded = occluded; }
  void joined(std::uint32_t, int, const V3f&, const Rgb&) {}

  void scatter(std::uint32_t path, const BsdfSample& sample, const Frame& frame) {
    VertexTrace& v = note(path);
    v.sampled = true;
    v.scatter = sample;
    if (sample.valid()) v.next_direction = frame.to_world(sample.wi);
  }

  // Comes where the sampled direction leads away from the surface.
  void onward(std::uint32_t path, const Onward& onward) {
    VertexTrace& v = note(path);
    v.next_throughput = onward.throughput;
    v.roulette = onward.roulette;
    v.survival = onward.survival;
    v.roulette_sample = onward.u;
    v.goes_on = onward.goes_on;
  }

  // ---- paths with light paths: rays are numbered within their batch, and those that nothing stops are said to arrive

  void light_vertex(std::uint32_t path, const LightVertex& light, std::uint32_t instance_name) {
    if (path != recorded_) return;
    trace_.light_vertices.push_back(trace_of(light, instance_name));
    trace_.light_vertices.back().number = int(trace_.light_vertices.size());
  }

  // Of a light vertex that was told before.
  void splat(std::uint32_t path, int ray, const LightVertex& light, const SplatConnection& splat) {
    if (path != recorded_) return;
    newest(light).splat = trace_of(splat);
    rays_.push_back({ray, kSplat, newest(light).number});
  }

  void merged(std::uint32_t path, int light_vertices, const Rgb& contribution) {
    VertexTrace& v = note(path);
    v.merged = light_vertices;
    v.merged_contribution = contribution;
  }

  // After light_value() and shadow_ray().
  void light_ray(std::uint32_t path, int ray, double mis_weight) {
    if (path != recorded_) return;
    LightTrace& light = trace_.vertices.back().light;
    light.mis_weight = float(mis_weight);
    light.occluded = true;
    rays_.push_back({ray, kLightSample, 0});
  }

  void connection_value(const V3f&, const BsdfValue&) {}
  void connection(std::uint32_t path, int ray, const LightVertex& light, double distance, double mis_weight,
                  const Rgb& contribution) {
    if (path != recorded_) return;
    std::vector<ConnectionTrace>& all = trace_.vertices.back().connections;
    rays_.push_back({ray, all.size(), 0});
    all.push_back({newest(light).number, distance, mis_weight, true, contribution});
  }

  void ray_arrived(int ray) {
    for (const TracedRay& traced : rays_) {
      if (traced.number != ray) continue;
      if (traced.connection == kSplat) {
        trace_.light_vertices[std::size_t(traced.light_vertex) - 1].splat->occluded = false;
      } else if (traced.connection == kLightSample) {
        trace_.vertices.back().light.occluded = false;
      } else {
        trace_.vertices.back().connections[traced.connection].occluded = false;
      }
    }
  }

  void rays_traced() { rays_.clear(); }

  // What the film would be offered.
  void ended(const Rgb& radiance) { trace_.radiance = radiance; }

 private:
  // The newest vertex of the sample that is watched; of all others, something that nobody reads.
  VertexTrace& note(std::uint32_t path) { return path == recorded_ ? trace_.vertices.back() : ignored_; }

  // The one told last that lies as far from its light.
  LightVertexTrace& newest(const LightVertex& light) {
    return *std::find_if(trace_.light_vertices.rbegin(), trace_.light_vertices.rend(),
                         [&](const LightVertexTrace& v) { return v.segments == light.depth; });
  }

  static constexpr std::size_t kLightSample = ~std::size_t(0), kSplat = kLightSample - 1;
  struct TracedRay {
    int number;
    std::size_t connection;  // of the newest vertex; or kLightSample, or kSplat of a light vertex
    int light_vertex;        // LightVertexTrace::number
  };

  SampleTrace& trace_;
  std::uint32_t recorded_ = ~0u;
  std::vector<TracedRay> rays_;  // of the sample, in the batch in hand
  VertexTrace ignored_;
};

}  // namespace helio
