// Lights as the integrator meets them: choose one, sample a direction to it, and the density of having done so.
//
// Emitters are numbered: emissive triangles and spheres, then punctual lights, then the environment. Everything is in
// rebased scene coordinates. Immutable after construction; safe to share between threads.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/scene_description.h"

namespace helio {

class TextureTable;            // renderer/scene/texture.h
class EnvironmentDistribution; // renderer/scene/environment.h

// A world-space emissive triangle or sphere, as gathered by the render scene.
struct AreaEmitter {
  enum class Shape : std::uint8_t { triangle, sphere };
  Shape shape = Shape::triangle;
  bool two_sided = false;
  V3f p0, e1, e2;          // triangle: corner and edges; sphere: p0 is the centre, e1.x the radius
  V3f normal;              // triangle: unit, front side (emission leaves along it)
  Rgb radiance;            // factor; times the texture where there is one
  TextureSlot texture;     // of the emission
  V2f uv[3];               // texture coordinates of the three corners, untransformed
  float power = 0;         // luminance of the emitted flux (texture mean included), > 0: filled by LightSampler
};

struct LightSample {
  V3f direction{0, 0, 0};  // unit, from the reference point to the light
  float distance = 0;      // to the light's surface; +inf: directional and environment
  Rgb radiance{0, 0, 0};   // arriving along the direction, unoccluded; for delta lights already divided by nothing:
                           // contribution is f_cos * radiance / pdf
  float pdf_w = 0;         // selection x solid angle density; for delta lights the selection probability alone; 0: none
  bool delta = false;      // cannot be hit by a BSDF sample: MIS weight 1
};

class LightSampler {
 public:
  struct Input {
    std::vector<AreaEmitter> areas;
    std::vector<PunctualLight> punctual;  // positions already rebased
    const Environment* environment = nullptr;                        // null: black
    std::shared_ptr<const EnvironmentDistribution> env_distribution; // null for constant environments
    const TextureTable* textures = nullptr;                          // outlives the sampler
    Box3f scene_bounds;
    bool use_tree = false;   // SceneFeatures::light_tree
  };
  explicit LightSampler(Input input);
  ~LightSampler();

  bool empty() const;
  std::size_t light_count() const;
  std::size_t memory_bytes() const;

  // One light sample for a shading point. `normal` is the geometric normal on the viewer's side, or zero when both
  // sides matter (transmission). u_select and u in [0, 1).
  LightSample sample(const V3f& point, const V3f& normal, float u_select, const V2f& u) const;

  // Density (selection x solid angle) with which sample() at `point` would have returned the direction that hit area
  // emitter `emitter` at distance `distance`, light surface cosine `cos_light` (front: > 0).
  float pdf_w_area(const V3f& point, const V3f& normal, std::uint32_t emitter, float distance, float cos_light) const;
  float pdf_w_environment(const V3f& point, const V3f& normal, const V3f& direction) const;

  // Radiance emitted by an area emitter towards a viewer on the side given by cos_light; uv for textured emission.
  Rgb emitted(std::uint32_t emitter, const V2f& uv, float cos_light) const;
  Rgb environment_radiance(const V3f& direction) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
