// One sample told vertex by vertex: what the path kernels did for it, in the bits in which they did it. For whoever asks
// why a sample is what it is, first of all one that is not finite (heliograph replay).
//
// Positions and directions are in the scene's rebased coordinates (RenderScene::origin()).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/trace/bsdf/bsdf_values.h"
#include "renderer/trace/bsdf/surface_params.h"
#include "renderer/trace/lights/light_sampler.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// Next-event estimation at a vertex.
struct LightTrace {
  LightSample sample;            // pdf_w 0: no light was sampled
  bool evaluated = false;        // the light sends something here; the three below are set
  Rgb f_cos{0, 0, 0};            // of the surface towards the light
  float bsdf_pdf_w = 0;          // with which the surface would have sampled the direction
  float mis_weight = 0;
  bool shadow_ray = false;       // one was traced; the three below are set
  float t_max = 0;
  bool occluded = false;
  Rgb contribution{0, 0, 0};     // what is added where the ray is not occluded
};

// A vertex joined to one of the sample's light path, or to one that all pixels share.
struct ConnectionTrace {
  int light_vertex = 0;  // LightVertexTrace::number
  double distance = 0;
  double mis_weight = 0;
  bool occluded = true;
  Rgb contribution{0, 0, 0};  // what is added where nothing lies between
};

// A vertex and the segment that led to it. Members stay at their defaults where the path ended before they mattered.
struct VertexTrace {
  int number = 0;                // 1: where the camera ray arrives
  V3f origin{0, 0, 0}, direction{0, 0, 0};
  float pdf_w = 0;               // of the direction; 0: camera ray or delta
  Rgb radiance{0, 0, 0};         // collected before this vertex
  bool hit = false;              // false: the ray left the scene
  float distance = 0;
  std::uint32_t instance = ~0u, primitive = ~0u;  // as in PixelFeatures

  Rgb throughput{0, 0, 0};       // from the camera to here, absorption included
  Rgb emitted{0, 0, 0};          // towards the path: by the surface, or by the environment
  float emitted_weight = 1;      // of multiple importance sampling

  V3f position{0, 0, 0}, geometric_normal{0, 0, 0}, shading_normal{0, 0, 0};  // normals on the viewer's side
  bool front = true;
  std::uint32_t material = 0;    // index in the scene's description
  bool black_side = false;       // one-sided, seen from behind
  SurfaceParams params;          // `layers` is null
  LightTrace light;
  std::vector<ConnectionTrace> connections;  // that bring something where nothing lies between
  int merged = 0;                            // light vertices nearby that were merged with it
  Rgb merged_contribution{0, 0, 0};          // what all of them bring

  bool sampled = false;          // a direction was asked for; the two below are set
  BsdfSample scatter;            // wi in the shading frame
  V3f next_direction{0, 0, 0};
  Rgb next_throughput{0, 0, 0};  // after scattering, before roulette
  bool roulette = false;         // was played; the two below are set
  float survival = 1, roulette_sample = 0;
  bool goes_on = false;
};

// A light vertex joined to the camera.
struct SplatTrace {
  double film_x = 0, film_y = 0;  // pixels
  double mis_weight = 0;
  bool occluded = true;
  Rgb contribution{0, 0, 0};  // what its light path alone would make of the pixel's radiance where nothing lies between
  bool taken = true;          // by the film: not where that is more than it holds
};

// A vertex of the light path that goes with the sample, of those that can be joined: surfaces that only mirror are left
// out. Where light paths are shared, one that a vertex was to be joined to.
struct LightVertexTrace {
  int number = 0;                                 // of those that are told, from 1
  int segments = 0;                               // from the light
  V3f arrived{0, 0, 0};                           // unit, along the segment that led to it
  float distance = 0;                             // which is that long
  std::uint32_t instance = ~0u, primitive = ~0u;  // as in PixelFeatures
  V3f position{0, 0, 0}, geometric_normal{0, 0, 0};
  std::uint32_t material = 0;  // index in the scene's description
  Rgb throughput{0, 0, 0};     // of the light that arrives
  std::optional<SplatTrace> splat;  // nothing: the camera does not see it, or does not ask (photon)
};

// Of what a kernel holds; `number` and `splat` are the caller's to set.
struct LightVertex;
struct SplatConnection;
LightVertexTrace trace_of(const LightVertex& light, std::uint32_t instance_name);
SplatTrace trace_of(const SplatConnection& splat);

struct SampleTrace {
  int width = 0, height = 0;   // of the film
  InvalidSample sample;        // which one, finite or not
  std::vector<LightVertexTrace> light_vertices;
  std::vector<VertexTrace> vertices;
  Rgb radiance{0, 0, 0};       // what the film was offered

  // Whether the film took all that the sample and its light path brought.
  bool valid() const;
};

// Traces one sample with the kernel that trace_window() takes for the scene, together with the rest of its group, so
// that it is the same in every bit. `trace` holds the film's size and the sample when called: a pixel inside the film,
// half 0 or 1, and with light_paths one that was made with them. Where all pixels share light paths their pass is
// traced as well; with light_path that light path alone is told. False when cancelled.
bool trace_sample(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  const CancelToken& cancel, SampleTrace& trace);

// Where a value first was NaN or infinite, following the order of computation. Nothing: all are finite.
struct NotFinite {
  int vertex = 0;        // VertexTrace::number; on the light path: LightVertexTrace::number
  std::string quantity;  // "the light's radiance", ...
  bool on_light_path = false;
};
std::optional<NotFinite> first_not_finite(const SampleTrace& trace);

// Why the path went no further than this vertex, as a clause: "left the scene", "was ended by roulette", ...
std::string why_ended(const VertexTrace& vertex, const PathSettings& settings);

}  // namespace helio
