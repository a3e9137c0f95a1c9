#include "renderer/trace/paths/sample_trace.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/camera/camera_importance.h"
#include "renderer/trace/paths/light_paths.h"
#include "renderer/trace/paths/light_vertex_cache.h"
#include "renderer/trace/paths/path_kernel.h"
#include "renderer/trace/paths/splat_connection.h"

namespace helio {
namespace {

// Looks at a vertex's values in the order in which the kernel makes them; the first that is not finite stands.
class Search {
 public:
  void look(float value, const char* what) {
    if (found_.empty() && !std::isfinite(value)) found_ = what;
  }
  void look(const V3f& value, const char* what) {
    if (found_.empty() && !is_finite(value)) found_ = what;
  }
  void name(const char* what) {
    if (found_.empty()) found_ = what;
  }
  const std::string& found() const { return found_; }

 private:
  std::string found_;
};

void look_at_surface(const VertexTrace& v, Search& search) {
  search.look(v.position, "the position");
  search.look(v.geometric_normal, "the geometric normal");
  search.look(v.shading_normal, "the shading normal");
  search.look(v.params.base_color, "the material's base color");
  search.look(v.params.alpha, "the material's alpha");
  search.look(v.params.metallic, "the material's metalness");
  search.look(v.params.transmission, "the material's transmission");
  search.look(v.params.ior, "the material's ior");
  search.look(v.params.specular, "the material's specular weight");
  search.look(v.params.specular_color, "the material's specular color");
  search.look(v.params.f0, "the material's f0");
  search.look(v.params.eta, "the conductor's eta");
  search.look(v.params.k, "the conductor's k");
}

void look_at_light(const LightTrace& light, Search& search) {
  if (light.sample.pdf_w == 0) return;
  search.look(light.sample.direction, "the direction to the light");
  search.look(light.sample.radiance, "the light's radiance");
  search.look(light.sample.pdf_w, "the light's density");
  if (!light.evaluated) return;
  search.look(light.f_cos, "the surface's value towards the light");
  search.look(light.bsdf_pdf_w, "the surface's density towards the light");
  if (!light.shadow_ray) return;
  search.look(light.mis_weight, "the light sample's weight");
  search.look(light.contribution, "the light sample's contribution");
}

// The pass of light paths that the sample drew on; null: cancelled.
std::shared_ptr<LightVertexCache> trace_pass(const std::shared_ptr<const RenderScene>& scene,
                                             const PathSettings& settings, const InvalidSample& sample,
                                             const CancelToken& cancel, Film& none) {
  auto pass = std::make_shared<LightVertexCache>(scene, settings, sample.half, sample.index, sample.light_paths,
                                                 mean_light_vertices(*scene, settings));
  TraceStats ignored;
  for (std::size_t b = 0; b < pass->batches(); ++b) {
    if (!pass->trace(b, nullptr, cancel, none, ignored)) return nullptr;
  }
  pass->index();
  for (std::size_t b = 0; b < pass->batches(); ++b) pass->gather(b);
  pass->finish();
  return pass;
}

// Which splats a film of the trace's size takes.
void judge_splats(const Camera& camera, SampleTrace& trace) {
  const CameraImportance importance(camera);
  const double most = SplatBuffer::most_radiance(trace.width, trace.height);
  for (LightVertexTrace& v : trace.light_vertices) {
    if (!v.splat || v.splat->occluded) continue;
    importance.for_each_pixel(v.splat->film_x, v.splat->film_y, [&](int, int, double share) {
      const Rgb brought = v.splat->contribution * float(share);
      for (int c = 0; c < 3; ++c) v.splat->taken &= std::abs(double(brought[c])) <= most;
    });
  }
}

}  // namespace

LightVertexTrace trace_of(const LightVertex& light, std::uint32_t instance_name) {
  LightVertexTrace v;
  v.segments = light.depth;
  v.arrived = light.arrived;
  v.distance = light.hit.t;
  v.instance = instance_name;
  v.primitive = light.hit.primitive;
  v.position = light.surface.position;
  v.geometric_normal = light.surface.geometric_normal;
  v.material = light.surface.part->material;
  v.throughput = light.throughput;
  return v;
}

SplatTrace trace_of(const SplatConnection& splat) {
  return {splat.camera.film_x, splat.camera.film_y, splat.weight, true, splat.radiance};
}

bool SampleTrace::valid() const {
  return is_finite(radiance) && std::all_of(light_vertices.begin(), light_vertices.end(),
                                            [](const auto& v) { return !v.splat || v.splat->taken; });
}

bool trace_sample(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  const CancelToken& cancel, SampleTrace& trace) {
  Film none(1, 1);  // the film's size is the trace's, its pixels are not touched
  const InvalidSample& sample = trace.sample;
  WindowTask task{scene.impl(),
                  camera,
                  settings,
                  {sample.half, sample.index, 1},
                  {sample.x, sample.y, sample.x + 1, sample.y + 1},
                  cancel,
                  none,
                  nullptr,
                  nullptr,
                  &trace};
  trace.vertices.clear();
  trace.light_vertices.clear();
  trace.radiance = Rgb(0, 0, 0);
  if (caches_light_vertices(settings.integrator)) {
    // It does not outlive this call, nor does the scene end before.
    const std::shared_ptr<const RenderScene> borrowed(std::shared_ptr<void>(), &scene);
    if (sample.light_path > 0) {
      const LightVertexCache pass(borrowed, settings, sample.half, sample.index, sample.light_paths,
                                  mean_light_vertices(scene, settings));
      const bool told = pass.tell(sample.light_path - 1, camera, cancel, trace);
      judge_splats(camera, trace);
      return told;
    }
    const auto pass = trace_pass(borrowed, settings, sample, cancel, none);
    task.lights = pass.get();
    return pass && run_cached_sample_trace_kernel(task);
  }
  if (sample.light_paths == 0) return run_sample_trace_kernel(task);
  const bool told = run_bidirectional_sample_trace_kernel(task);
  judge_splats(camera, trace);
  return told;
}

std::optional<NotFinite> first_not_finite(const SampleTrace& trace) {
  for (const LightVertexTrace& v : trace.light_vertices) {
    Search search;
    search.look(v.position, "the position");
    search.look(v.geometric_normal, "the geometric normal");
    search.look(v.throughput, "the light that arrives");
    if (v.splat && !v.splat->occluded) {
      search.look(float(v.splat->mis_weight), "the weight of what the camera sees of it");
      search.look(v.splat->contribution, "what the camera sees of it");
      if (!v.splat->taken) search.name("what the camera sees of it, which is more than splats can be");
    }
    if (!search.found().empty()) return NotFinite{v.number, search.found(), true};
  }
  for (std::size_t i = 0; i < trace.vertices.size(); ++i) {
    const VertexTrace& v = trace.vertices[i];
    Search search;
    search.look(v.origin, "the ray's origin");
    search.look(v.direction, "the ray's direction");
    if (v.hit) search.look(v.distance, "the distance to the hit");
    search.look(v.throughput, "the throughput after absorption");
    search.look(v.emitted, v.hit ? "the surface's emission" : "the environment's radiance");
    search.look(v.emitted_weight, "the emission's weight");
    search.look(v.throughput * v.emitted * v.emitted_weight, "the emission's contribution");
    if (v.hit) look_at_surface(v, search);
    look_at_light(v.light, search);
    for (const ConnectionTrace& connection : v.connections) {
      search.look(float(connection.mis_weight), "a connection's weight");
      search.look(connection.contribution, "a connection's contribution");
    }
    search.look(v.merged_contribution, "what light vertices nearby bring");
    if (v.sampled) {
      search.look(v.scatter.pdf_w, "the density of the sampled direction");
      search.look(v.scatter.weight, "the weight of the sampled direction");
      search.look(v.next_direction, "the sampled direction");
      search.look(v.next_throughput, "the throughput after scattering");
    }
    if (v.roulette) search.look(v.survival, "the probability of survival");
    const bool last = i + 1 == trace.vertices.size();
    search.look(last ? trace.radiance : trace.vertices[i + 1].radiance, "the sum of the contributions");
    if (!search.found().empty()) return NotFinite{v.number, search.found()};
  }
  return std::nullopt;
}

std::string why_ended(const VertexTrace& v, const PathSettings& settings) {
  if (v.goes_on) return "goes on";
  if (!v.hit) return is_finite(v.direction) ? "left the scene" : "has no direction that is finite";
  if (v.black_side) return "met a one-sided surface from behind";
  if (v.number >= settings.max_segments) return "has as many segments as max_segments allows";
  if (settings.integrator == Integrator::light) return "ends where it sees: light paths bring the rest";
  if (settings.integrator == Integrator::photon && v.scatter.valid() && !v.scatter.delta)
    return "ends where light paths arrive: they bring the rest";
  if (settings.technique && v.number + 1 >= settings.technique->camera_vertices)
    return "has as many vertices as the technique";
  if (!v.sampled) return "met a surface that reflects nothing";
  if (!v.scatter.valid()) return "sampled no direction";
  if (v.roulette) return "was ended by roulette";
  if (is_black(v.next_throughput)) return "lost its whole throughput, or its direction led below the surface";
  return "ended";
}

}  // namespace helio
