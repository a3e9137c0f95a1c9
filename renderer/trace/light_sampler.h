// Lights as the integrator meets them: choose one, sample a direction to it, and the density of having done so.
//
// Emitters are numbered as given: emissive triangles, spheres and ellipsoids. Everything is in rebased scene
// coordinates. Immutable after construction; safe to share between threads.
//
// One light costs no selection. Few are selected by power, many by a light tree. A density may be as large as 1e30, so
// that MIS weights must be formed from the ratio of two densities, not from their squares.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/scene_description.h"
#include "renderer/trace/alias_table.h"
#include "renderer/trace/area_emitter.h"
#include "renderer/trace/light_groups.h"
#include "renderer/trace/light_tree.h"
#include "renderer/trace/projector.h"
#include "renderer/trace/punctual_light.h"

namespace helio {

class TextureTable;    // renderer/scene/texture.h
class EnvironmentMap;  // renderer/scene/environment.h
class EnvironmentDistribution;

struct LightSample {
  V3f direction{0, 0, 0};  // unit, from the reference point to the light
  float distance = 0;      // to the light's surface; +inf: directional and environment
  Rgb radiance{0, 0, 0};   // arriving along the direction, unoccluded, times the alpha of the light's surface there;
                           // for delta lights already divided by nothing: contribution is f_cos * radiance / pdf
  float pdf_w = 0;         // selection x solid angle density; for delta lights the selection probability alone; 0: none
  bool delta = false;      // cannot be hit by a BSDF sample: MIS weight 1
  float cos_light = 1;     // |cosine| between the direction and the light's surface normal; 1 where there is no surface
};

class LightSampler {
 public:
  struct Input {
    std::vector<AreaEmitter> areas;
    std::vector<EmitterAlpha> alphas;                                 // AreaEmitter::alpha
    std::vector<PunctualLight> punctual;                              // positions already rebased
    const Environment* environment = nullptr;                         // null: black
    std::shared_ptr<const EnvironmentDistribution> env_distribution;  // null for constant environments
    double env_brightness = 1;  // of the environment over that of the map which env_distribution was made for
    const TextureTable* textures = nullptr;  // outlives the sampler
    Box3f scene_bounds;
    bool use_tree = false;  // SceneFeatures::light_tree
  };
  explicit LightSampler(Input input);
  ~LightSampler();
  LightSampler(const LightSampler&) = delete;
  LightSampler& operator=(const LightSampler&) = delete;

  bool empty() const { return selection_ == Selection::none; }
  // Lights to select from: degenerate and black ones do not count, two triangles of a parallelogram are one.
  std::size_t light_count() const { return areas_.size() + punctual_.size() + (environment_light_ ? 1 : 0); }
  // False: sample() does not read u_select.
  bool needs_selection() const { return selection_ == Selection::power || selection_ == Selection::tree; }
  // The only light, when it is an untextured, opaque parallelogram; else null.
  const AreaLight* plain_quad() const { return plain_quad_ ? areas_.data() : nullptr; }
  std::size_t memory_bytes() const;
  const std::vector<AreaEmitter>& emitters() const { return emitters_; }

  // One light sample for a shading point. `normal` is the unit geometric normal on the viewer's side, or zero when both
  // sides matter (transmission). u_select and u in [0, 1). Directions below the surface may be returned.
  LightSample sample(const V3f& point, const V3f& normal, float u_select, const V2f& u) const {
    if (plain_quad_ && !detail::is_near(areas_[0].shape, point)) [[likely]] {
      const AreaLight& light = areas_[0];
      const ShapeSample shape = detail::sample_planar_area(light.shape, point, u);
      return {shape.direction, shape.distance, light.radiance, shape.pdf_w, false, shape.cos_light};
    }
    return sample_any(point, normal, u_select, u);
  }

  // Density (selection x solid angle) with which sample() at `point` would have returned the unit direction that hit
  // area emitter `emitter` at distance `distance`, light surface cosine `cos_light` (front: > 0).
  float pdf_w_area(const V3f& point, const V3f& normal, const V3f& direction, std::uint32_t emitter, float distance,
                   float cos_light) const {
    const std::uint32_t light = light_of_emitter_[emitter];
    if (light == kNoLight) return 0;
    const float pdf_w = pdf_w_shape(areas_[light].shape, point, direction, distance, cos_light);
    return selection_ == Selection::one ? pdf_w : pdf_w * selection_probability(point, normal, light);
  }
  float pdf_w_environment(const V3f& point, const V3f& normal, const V3f& direction) const;

  // Radiance emitted by an opaque point of an area emitter towards a viewer on the side given by cos_light; uv for
  // textured emission.
  Rgb emitted(std::uint32_t emitter, const V2f& uv, float cos_light) const {
    const AreaEmitter& e = emitters_[emitter];
    if (!(cos_light > 0) && !(e.two_sided && cos_light < 0)) return {0, 0, 0};
    return e.texture.present() ? textured_emission(e, uv) : e.radiance;
  }
  // `direction` unit, from the scene outwards.
  Rgb environment_radiance(const V3f& direction) const;

 private:
  enum class Selection : std::uint8_t { none, one, power, tree };
  struct Selected {
    std::uint32_t light = 0;
    float probability = 0;
  };

  void add_areas(Input& input, std::vector<double>& flux, std::vector<LightBounds>& bounds);
  void add_punctual(const std::vector<PunctualLight>& lights, double scene_radius, std::vector<double>& flux,
                    std::vector<LightBounds>& bounds);
  // Leaves out one that gives no light.
  void add_projector(const PunctualLight& light, std::vector<double>& flux, std::vector<LightBounds>& bounds);
  void add_environment(const Input& input, double scene_radius, std::vector<double>& flux);

  LightSample sample_any(const V3f& point, const V3f& normal, float u_select, const V2f& u) const;
  LightSample sample_punctual(const PunctualSource& source, const V3f& point) const;
  LightSample sample_area(const AreaLight& light, const V3f& point, const V2f& u) const;
  LightSample sample_environment(const V3f& normal, const V2f& u) const;
  float environment_density(const V3f& normal, const V3f& direction) const;
  Rgb textured_emission(const AreaEmitter& emitter, const V2f& uv) const;

  Selected select(const V3f& point, const V3f& normal, float u) const;
  float selection_probability(const V3f& point, const V3f& normal, std::uint32_t light) const;

  Selection selection_ = Selection::none;
  bool plain_quad_ = false;         // the only light is an untextured, opaque parallelogram
  bool environment_light_ = false;  // the environment is not black
  // Lights are numbered: areas, punctual lights at a place, directional lights, environment.
  std::vector<AreaLight> areas_;
  std::vector<PunctualSource> punctual_;
  std::vector<Projector> projectors_;
  std::uint32_t finite_count_ = 0;  // lights before the first directional one
  std::vector<std::uint32_t> light_of_emitter_;
  std::vector<AreaEmitter> emitters_;
  std::vector<LightAlpha> alphas_;

  AliasTable power_;                // power: all lights; tree: the infinite ones
  LightTree tree_;                  // the finite ones
  float infinite_probability_ = 0;  // tree: of selecting an infinite light

  std::unique_ptr<const EnvironmentMap> environment_;  // null: black
  std::shared_ptr<const EnvironmentDistribution> env_distribution_;
  const TextureTable* textures_ = nullptr;
};

}  // namespace helio
