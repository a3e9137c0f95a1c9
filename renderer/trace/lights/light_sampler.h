// Lights as the integrator meets them: choose one, sample a direction to it or a ray that leaves it, and the densities
// of having done so.
//
// Emitters are numbered as given: emissive triangles, spheres and ellipsoids. Everything is in rebased scene
// coordinates. Immutable after construction; safe to share between threads.
//
// One light costs no selection. Few are selected by power, many by a light tree; paths that start at a light select it
// by power always. A density may be as large as 1e30, so that MIS weights must be formed from the ratio of two
// densities, not from their squares.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"
#include "renderer/trace/lights/area_emitter.h"
#include "renderer/trace/lights/light_groups.h"
#include "renderer/trace/lights/light_tree.h"
#include "renderer/trace/lights/projector.h"
#include "renderer/trace/lights/punctual_light.h"
#include "renderer/trace/sampling/alias_table.h"

namespace helio {

class TextureTable;    // renderer/scene/images/texture.h
class EnvironmentMap;  // renderer/scene/images/environment.h
class EnvironmentDistribution;

struct LightSample {
  V3f direction{0, 0, 0};  // unit, from the reference point to the light
  float distance = 0;      // to the light's surface; +inf: directional and environment
  Rgb radiance{0, 0, 0};   // arriving along the direction, unoccluded, times the alpha of the light's surface there;
                           // for delta lights already divided by nothing: contribution is f_cos * radiance / pdf
  float pdf_w = 0;         // selection x solid angle density; for delta lights the selection probability alone; 0: none
  bool delta = false;      // cannot be hit by a BSDF sample: MIS weight 1
  float cos_light = 1;     // |cosine| between the direction and the light's surface normal; 1 where there is no surface
  std::uint32_t light = kNoLight;  // the sampler's number of the light
};

// Where a light path starts, and with which density (Veach 1997, 8.2; Georgiev 2012, "Implementing Vertex Connection
// and Merging").
struct EmissionSample {
  V3f origin{0, 0, 0};  // on the light itself; directional lights and the environment: on a disk that covers the scene
                        // as seen along the direction, outside of it
  V3f direction{0, 0, 0};  // unit, the way the light travels
  V3f normal{0, 0, 0};     // area lights: unit, on the side that emits; else 0
  // Throughput of the path, selection included: emitted radiance x cos_light / pdf_emission, radiant intensity /
  // pdf_emission of punctual lights (before range_window()), irradiance / pdf_emission of directional ones.
  Rgb weight{0, 0, 0};
  // Selection x density over area x solid angle. Points, spots and projectors: selection x solid angle; directional:
  // selection x area of the disk; environment: selection x area of the disk x solid angle. 0: no sample.
  double pdf_emission = 0;
  float cos_light = 1;             // between the direction and the normal; 1 where there is none
  std::uint32_t light = kNoLight;  // the sampler's number of the light
  bool finite = true;              // false: directional, environment
  bool delta = false;              // no ray can hit it: points, spots, projectors, directional lights
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

  enum class Selection : std::uint8_t { none, one, power, tree };
  // All that sample() and the densities below read, by reference: for twins of them on other devices. Valid while the
  // sampler is. Lights are numbered: areas, punctual lights at a place, directional lights, environment.
  struct Parts {
    Selection selection = Selection::none;
    std::span<const AreaLight> areas;
    std::span<const LightAlpha> alphas;  // AreaLight::alpha
    std::span<const PunctualSource> punctual;
    std::span<const Projector> projectors;                              // PunctualSource::projector
    std::span<const std::uint32_t> light_of_emitter;                    // kNoLight: never sampled
    std::uint32_t finite_count = 0;                                     // lights before the first directional one
    const AliasTable* power = nullptr;                                  // more than one light: all of them
    const LightTree* tree = nullptr;                                    // Selection::tree: the finite ones
    const AliasTable* infinite = nullptr;                               // Selection::tree: the others; may be empty
    float infinite_probability = 0;                                     // Selection::tree: of selecting one of them
    bool environment_light = false;                                     // the environment is one of the lights
    const EnvironmentMap* environment = nullptr;                        // null: black
    const EnvironmentDistribution* environment_distribution = nullptr;  // null: none or constant
  };
  Parts parts() const;

  // One light sample for a shading point. `normal` is the unit geometric normal on the viewer's side, or zero when both
  // sides matter (transmission). u_select and u in [0, 1). Directions below the surface may be returned.
  LightSample sample(const V3f& point, const V3f& normal, float u_select, const V2f& u) const {
    if (plain_quad_ && !detail::is_near(areas_[0].shape, point)) [[likely]] {
      const AreaLight& light = areas_[0];
      const ShapeSample shape = detail::sample_planar_area(light.shape, point, u);
      return {shape.direction, shape.distance, light.radiance, shape.pdf_w, false, shape.cos_light, 0};
    }
    return sample_any(point, normal, u_select, u);
  }

  struct Query {
    V3f point, normal;
    float u_select = 0;
    V2f u;
  };
  // sample() of each query, into samples[i], at less cost where lights are selected by the tree.
  void sample(std::span<const Query> queries, LightSample* samples) const;

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

  // A ray that leaves a light (light_sampler_emission.cpp). All variates in [0, 1).
  EmissionSample sample_emission(float u_select, const V2f& u_position, const V2f& u_direction) const;

  // Densities, as EmissionSample::pdf_emission, with which sample_emission() starts the path whose light another
  // technique found. An area emitter that a ray hit, cos_light as pdf_w_area(); 0 for emitters that are never sampled.
  double pdf_emission_area(std::uint32_t emitter, float cos_light) const;
  // `direction` unit, from the scene outwards.
  double pdf_emission_environment(const V3f& direction) const;
  // Of what sample() returned.
  double pdf_emission(const LightSample& sample) const;

  // Density with which sample() at `point` would have returned the point of the light where `emission` started, as
  // LightSample::pdf_w; `normal` as sample(). 0: from there the light is not seen.
  double pdf_w_direct(const EmissionSample& emission, const V3f& point, const V3f& normal) const;
  // What KHR_lights_punctual's range leaves of a light at a distance from it, [0, 1]; 1 where it has none.
  float range_window(std::uint32_t light, float distance) const;

 private:
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
  LightSample sample_selected(const Selected& selected, const V3f& point, const V3f& normal, const V2f& u) const;
  LightSample sample_punctual(const PunctualSource& source, const V3f& point) const;
  LightSample sample_area(const AreaLight& light, const V3f& point, const V2f& u) const;
  LightSample sample_environment(const V3f& normal, const V2f& u) const;
  float environment_density(const V3f& normal, const V3f& direction) const;
  Rgb textured_emission(const AreaEmitter& emitter, const V2f& uv) const;

  EmissionSample emit_area(const AreaLight& light, const V2f& u_position, const V2f& u_direction) const;
  EmissionSample emit_punctual(const PunctualSource& source, const V2f& u_position, const V2f& u_direction) const;
  EmissionSample emit_environment(const V2f& u_position, const V2f& u_direction) const;
  V3f disk_point(const V3f& direction, const V2f& u) const;
  double disk_density() const { return 1 / (std::numbers::pi * disk_radius_ * disk_radius_); }

  std::uint32_t environment_number() const { return std::uint32_t(areas_.size() + punctual_.size()); }
  double emission_probability(std::uint32_t light) const {
    return selection_ == Selection::one ? 1.0 : double(power_.probability(light));
  }
  Selected select(const V3f& point, const V3f& normal, float u) const;
  void select_by_tree(std::span<const Query> queries, Selected* selected) const;
  // Selection::tree: an infinite light, for u below infinite_probability_; else the u of the tree's choice.
  Selected select_infinite(float u) const;
  float rest_for_tree(float u) const;
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

  AliasTable power_;                // more than one light: all of them
  LightTree tree_;                  // tree: the finite ones
  AliasTable infinite_;             // tree: the others
  float infinite_probability_ = 0;  // tree: of selecting one of them

  V3f scene_center_{0, 0, 0};
  double disk_radius_ = 1;  // of the disks through which directional lights and the environment send their light

  std::unique_ptr<const EnvironmentMap> environment_;  // null: black
  std::shared_ptr<const EnvironmentDistribution> env_distribution_;
  const TextureTable* textures_ = nullptr;
};

}  // namespace helio
