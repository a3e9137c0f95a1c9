#include "renderer/trace/scene/light_gathering.h"

#include "renderer/scene/description/material_slots.h"
#include "renderer/scene/images/environment.h"
#include "renderer/trace/scene/placement.h"

namespace helio {
namespace {

V3f unit_or_zero(const V3d& v) {
  const double l = length(v);
  return l > 0 && std::isfinite(l) ? V3f(v / l) : V3f(0, 0, 0);
}

// Null where the slot has no texture or the mesh no coordinates for it.
const std::vector<V2f>* texture_coordinates(const TriangleMesh& mesh, const TextureSlot& slot) {
  if (!slot.present() || slot.texcoord >= kMaxTexcoordSets) return nullptr;
  const std::vector<V2f>& uvs = mesh.texcoords[std::size_t(slot.texcoord)];
  return uvs.empty() ? nullptr : &uvs;
}

class Gathering {
 public:
  Gathering(SceneData& data, LightSampler::Input& input) : data_(data), input_(input) {}

  void add_flat_parts() {
    for (std::size_t i = 0; i < data_.flat.size(); ++i) {
      PartRecord& part = data_.flat[i];
      part.first_emitter = kNoHit;
      if (data_.is_taken_out(i) || !emits(part.material)) continue;
      if (part.mesh) {
        part.first_emitter = add_mesh(
            *part.mesh, part.material, [](const V3f& p) { return p; }, false);
        continue;
      }
      AreaEmitter emitter;
      emitter.shape = AreaEmitter::Shape::sphere;
      emitter.p0 = part.center;
      emitter.e1 = V3f(part.radius, 0, 0);
      part.first_emitter = add_sphere(emitter, part.material);
    }
  }

  void add_instances() {
    data_.instance_emitters.clear();
    for (InstanceRecord& record : data_.instances) add_instance(record);
  }

 private:
  bool emits(std::uint32_t material) const {
    return data_.materials[material].emissive && !data_.materials[material].unlit;
  }

  void add_instance(InstanceRecord& record) {
    record.first_emitter_slot = kNoHit;
    const auto first = data_.object_parts.begin() + record.first_part, end = first + record.part_count;
    if (std::none_of(first, end, [&](const PartRecord& part) { return emits(part.material); })) return;
    const Linear linear(record);
    record.first_emitter_slot = std::uint32_t(data_.instance_emitters.size());
    for (auto part = first; part != end; ++part) {
      std::uint32_t emitter = kNoHit;
      if (emits(part->material) && part->mesh) {
        emitter = add_mesh(
            *part->mesh, part->material, [&](const V3f& p) { return record.point(p); }, linear.determinant() < 0);
      } else if (emits(part->material)) {
        emitter = add_sphere(sphere_emitter(*part, record, linear), part->material);
      }
      data_.instance_emitters.push_back(emitter);
    }
  }

  // A placed sphere: still one where it only grows, moves, and turns without a texture; an ellipsoid otherwise.
  AreaEmitter sphere_emitter(const PartRecord& part, const InstanceRecord& record, const Linear& linear) const {
    AreaEmitter emitter;
    emitter.p0 = record.point(part.center);
    const double scale = linear.uniform_scale();
    const bool textured = has_orientation(data_.description.materials[part.material]);
    if (scale > 0 && !(textured && turns(linear))) {
      emitter.shape = AreaEmitter::Shape::sphere;
      emitter.e1 = V3f(float(part.radius * scale), 0, 0);
      return emitter;
    }
    emitter.shape = AreaEmitter::Shape::ellipsoid;
    emitter.e1 = record.direction(V3f(part.radius, 0, 0));
    emitter.e2 = record.direction(V3f(0, part.radius, 0));
    emitter.e3 = record.direction(V3f(0, 0, part.radius));
    return emitter;
  }

  template <class ToWorld>
  std::uint32_t add_mesh(const TriangleMesh& mesh, std::uint32_t material_index, const ToWorld& to_world,
                         bool mirrored) {
    const Material& material = data_.description.materials[material_index];
    const MaterialRecord& record = data_.materials[material_index];
    const std::uint32_t first = std::uint32_t(input_.areas.size());
    const std::vector<V2f>* uvs = texture_coordinates(mesh, material.emission_texture);
    const std::vector<V2f>* alpha_uvs = texture_coordinates(mesh, alpha_slot(material));
    const bool alpha = has_alpha(material, &mesh, *data_.textures);
    for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
      const std::uint32_t* i = &mesh.indices[3 * t];
      AreaEmitter emitter{};
      emitter.two_sided = record.double_sided;
      emitter.p0 = to_world(mesh.positions[i[0]]);
      emitter.e1 = to_world(mesh.positions[i[1]]) - emitter.p0;
      emitter.e2 = to_world(mesh.positions[i[2]]) - emitter.p0;
      emitter.normal = unit_or_zero(V3d(cross(emitter.e1, emitter.e2)) * (mirrored ? -1.0 : 1.0));
      emitter.radiance = record.emission;
      emitter.texture = material.emission_texture;
      for (int k = 0; k < 3; ++k) emitter.uv[k] = uvs ? (*uvs)[i[k]] : V2f(0, 0);
      if (alpha) {
        EmitterAlpha& a = add_alpha(emitter, material);
        for (int k = 0; k < 3; ++k) {
          a.uv[k] = alpha_uvs ? (*alpha_uvs)[i[k]] : V2f(0, 0);
          if (!mesh.colors.empty()) a.factor[k] *= mesh.colors[i[k]].w;
        }
      }
      input_.areas.push_back(emitter);
    }
    return first;
  }

  // Everything but the shape is filled in.
  std::uint32_t add_sphere(AreaEmitter emitter, std::uint32_t material_index) {
    const Material& material = data_.description.materials[material_index];
    const MaterialRecord& record = data_.materials[material_index];
    emitter.two_sided = record.double_sided;
    emitter.radiance = record.emission;
    emitter.texture = material.emission_texture;
    if (has_alpha(material, nullptr, *data_.textures)) add_alpha(emitter, material);
    input_.areas.push_back(emitter);
    return std::uint32_t(input_.areas.size() - 1);
  }

  EmitterAlpha& add_alpha(AreaEmitter& emitter, const Material& material) {
    emitter.alpha = std::uint32_t(input_.alphas.size());
    EmitterAlpha& alpha = input_.alphas.emplace_back();
    alpha.texture = alpha_slot(material);
    for (float& factor : alpha.factor) factor = material.base_alpha;
    alpha.mask = material.alpha_mode == AlphaMode::mask;
    alpha.cutoff = material.alpha_cutoff;
    return alpha;
  }

  SceneData& data_;
  LightSampler::Input& input_;
};

// The environment's sampling table depends on the colour of its factor, not on its brightness: what is scaled keeps its
// table, and has the one that it would be loaded with.
void set_environment(SceneData& data, LightSampler::Input& input) {
  if (!data.description.environment) return;
  const Environment& environment = *data.description.environment;
  input.environment = &environment;
  if (environment.image < 0) return;
  EnvironmentTable& table = data.environment_table;
  Environment unit = environment;
  const float brightness = max_component(environment.radiance);
  if (brightness > 0) unit.radiance /= brightness;
  if (!table.distribution || table.radiance != unit.radiance || table.image != unit.image) {
    table.radiance = unit.radiance;
    table.image = unit.image;
    table.distribution = std::make_shared<EnvironmentDistribution>(EnvironmentMap(unit, data.textures));
  }
  input.env_distribution = table.distribution;
  input.env_brightness = brightness > 0 ? double(brightness) : 1.0;
}

}  // namespace

void gather_lights(SceneData& data, std::size_t emitter_count_hint) {
  LightSampler::Input input;
  input.areas.reserve(emitter_count_hint);
  Gathering gathering(data, input);
  gathering.add_flat_parts();
  gathering.add_instances();
  input.punctual = data.description.lights;
  for (PunctualLight& light : input.punctual) light.position -= data.origin;
  set_environment(data, input);
  input.textures = data.textures;
  input.scene_bounds = data.world_bounds.isEmpty()
                           ? Box3f(V3f(0, 0, 0), V3f(0, 0, 0))
                           : Box3f(V3f(data.world_bounds.min - data.origin), V3f(data.world_bounds.max - data.origin));
  input.use_tree = data.features.light_tree;
  data.lights = std::make_shared<LightSampler>(std::move(input));
}

}  // namespace helio
