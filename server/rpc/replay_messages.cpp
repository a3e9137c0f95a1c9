#include "server/rpc/replay_messages.h"

#include <algorithm>

namespace helio {
namespace {

constexpr std::size_t kMaxVertices = 1000;  // of about 1 kB: the message stays below 4 MiB

void write(const V3f& v, pb::Vec3f& message) {
  message.set_x(v.x);
  message.set_y(v.y);
  message.set_z(v.z);
}

void write_world(const V3f& rebased, const V3d& origin, pb::Vec3& message) {
  const V3d world = V3d(rebased) + origin;
  message.set_x(world.x);
  message.set_y(world.y);
  message.set_z(world.z);
}

const char* to_string(LobeModel model) {
  switch (model) {
    case LobeModel::lambert:
      return "lambert";
    case LobeModel::metallic_roughness:
      return "metallic_roughness";
    case LobeModel::specular_glossiness:
      return "specular_glossiness";
    case LobeModel::conductor:
      return "conductor";
    case LobeModel::stack:
      return "stack";
    case LobeModel::plastic:
      return "plastic";
    case LobeModel::pane:
      return "pane";
    case LobeModel::principled:
      return "principled";
    case LobeModel::blend:
      return "blend";
    case LobeModel::none:
      return "none";
  }
  return "unknown";
}

template <class Named>
std::string name_of(const std::vector<Named>& all, std::size_t index, const char* kind) {
  const bool named = index < all.size() && !all[index].name.empty();
  return named ? all[index].name : std::string(kind) + " " + std::to_string(index);
}

void write_light(const LightTrace& light, pb::TracedLight& message) {
  write(light.sample.direction, *message.mutable_direction());
  message.set_distance(light.sample.distance);
  write(light.sample.radiance, *message.mutable_radiance());
  message.set_pdf(light.sample.pdf_w);
  message.set_delta(light.sample.delta);
  message.set_evaluated(light.evaluated);
  if (!light.evaluated) return;
  write(light.f_cos, *message.mutable_f_cos());
  message.set_bsdf_pdf(light.bsdf_pdf_w);
  message.set_mis_weight(light.mis_weight);
  message.set_shadow_ray(light.shadow_ray);
  if (!light.shadow_ray) return;
  message.set_occluded(light.occluded);
  write(light.contribution, *message.mutable_contribution());
}

void write_connection(const ConnectionTrace& connection, pb::TracedConnection& message) {
  message.set_light_vertex(std::uint32_t(connection.light_vertex));
  message.set_distance(connection.distance);
  message.set_mis_weight(connection.mis_weight);
  message.set_occluded(connection.occluded);
  write(connection.contribution, *message.mutable_contribution());
}

void write_light_vertex(const LightVertexTrace& v, const RenderScene& scene, pb::TracedLightVertex& message) {
  const SceneDescription& description = scene.description();
  message.set_number(std::uint32_t(v.number));
  message.set_segments(std::uint32_t(v.segments));
  write_world(v.position, scene.origin(), *message.mutable_position());
  write(v.geometric_normal, *message.mutable_geometric_normal());
  write(v.arrived, *message.mutable_arrived());
  message.set_distance(v.distance);
  message.set_instance(name_of(description.instances, v.instance, "instance"));
  message.set_primitive(v.primitive);
  message.set_material(name_of(description.materials, v.material, "material"));
  write(v.throughput, *message.mutable_throughput());
  if (!v.splat) return;
  pb::TracedSplat& splat = *message.mutable_splat();
  splat.set_film_x(v.splat->film_x);
  splat.set_film_y(v.splat->film_y);
  splat.set_mis_weight(v.splat->mis_weight);
  splat.set_occluded(v.splat->occluded);
  write(v.splat->contribution, *splat.mutable_contribution());
}

void write_surface(const VertexTrace& v, const RenderScene& scene, pb::TracedVertex& message) {
  const SceneDescription& description = scene.description();
  message.set_distance(v.distance);
  message.set_instance(name_of(description.instances, v.instance, "instance"));
  message.set_primitive(v.primitive);
  write_world(v.position, scene.origin(), *message.mutable_position());
  write(v.geometric_normal, *message.mutable_geometric_normal());
  write(v.shading_normal, *message.mutable_shading_normal());
  message.set_front(v.front);
  message.set_material(name_of(description.materials, v.material, "material"));
  message.set_lobe_model(to_string(v.params.model));
  write(v.params.base_color, *message.mutable_base_color());
  message.set_alpha(v.params.alpha);
  message.set_metallic(v.params.metallic);
  message.set_transmission(v.params.transmission);
  message.set_ior(v.params.ior);
}

void write_scatter(const VertexTrace& v, pb::TracedVertex& message) {
  message.set_sampled(true);
  write(v.next_direction, *message.mutable_next_direction());
  message.set_next_pdf(v.scatter.pdf_w);
  message.set_next_delta(v.scatter.delta);
  message.set_next_transmitted(v.scatter.transmitted);
  write(v.scatter.weight, *message.mutable_weight());
  write(v.next_throughput, *message.mutable_next_throughput());
  message.set_roulette(v.roulette);
  if (!v.roulette) return;
  message.set_survival(v.survival);
  message.set_roulette_sample(v.roulette_sample);
}

void write_vertex(const VertexTrace& v, const RenderScene& scene, const PathSettings& settings,
                  pb::TracedVertex& message) {
  message.set_number(std::uint32_t(v.number));
  write_world(v.origin, scene.origin(), *message.mutable_origin());
  write(v.direction, *message.mutable_direction());
  message.set_pdf(v.pdf_w);
  write(v.radiance, *message.mutable_radiance_before());
  message.set_hit(v.hit);
  write(v.throughput, *message.mutable_throughput());
  if (!is_black(v.emitted)) {
    write(v.emitted, *message.mutable_emitted());
    message.set_emitted_weight(v.emitted_weight);
  }
  if (v.hit) write_surface(v, scene, message);
  if (v.light.sample.pdf_w != 0) write_light(v.light, *message.mutable_light());
  for (const ConnectionTrace& connection : v.connections) write_connection(connection, *message.add_connections());
  if (v.merged > 0) {
    message.set_merged(std::uint32_t(v.merged));
    write(v.merged_contribution, *message.mutable_merged_contribution());
  }
  if (v.sampled) write_scatter(v, message);
  message.set_outcome(why_ended(v, settings));
}

}  // namespace

pb::ReplaySampleResponse to_replay_response(const Replay& replay, const RenderScene& scene,
                                            const PathSettings& settings, const SampleTrace& trace) {
  pb::ReplaySampleResponse response;
  *response.mutable_sample() = replay.message;
  response.set_note(replay_note(replay.message));
  write(trace.radiance, *response.mutable_radiance());
  response.set_finite(trace.valid());
  if (const auto first = first_not_finite(trace)) {
    response.set_first_not_finite_vertex(std::uint32_t(first->vertex));
    response.set_first_not_finite(first->quantity);
    response.set_first_not_finite_on_light_path(first->on_light_path);
  }
  const std::size_t lights = std::min(trace.light_vertices.size(), kMaxVertices);
  for (std::size_t i = 0; i < lights; ++i)
    write_light_vertex(trace.light_vertices[i], scene, *response.add_light_vertices());
  const std::size_t told = std::min(trace.vertices.size(), kMaxVertices);
  for (std::size_t i = 0; i < told; ++i) write_vertex(trace.vertices[i], scene, settings, *response.add_vertices());
  response.set_vertices_left_out(std::uint32_t(trace.vertices.size() - told));
  return response;
}

}  // namespace helio
