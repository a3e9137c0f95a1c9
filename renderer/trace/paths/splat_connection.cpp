#include "renderer/trace/paths/splat_connection.h"

namespace helio {

std::optional<SplatConnection> connect_to_camera(const SceneData& scene, const CameraImportance& camera,
                                                 const LightVertex& vertex, const ShadingPoint* point,
                                                 const V2f& lens, const TechniqueCounts& counts, bool unweighted,
                                                 bool with_share) {
  const CameraConnection c = camera.connect(vertex.surface.position, lens);
  if (!(c.density > 0) || !(c.distance > 0)) return std::nullopt;
  const V3f to_light = -vertex.arrived;
  Rgb matte;
  const bool asks = with_share && !vertex.lambert;
  const BsdfValue value = vertex.scatter(scene, c.direction, to_light, point, to_light, asks ? &matte : nullptr);
  if (is_black(value.f_cos)) return std::nullopt;
  const double pdf_camera = c.pdf_area(vertex.cosine(c.direction), camera.finite());
  const float arriving = vertex.cosine(to_light);
  if (!(arriving > 0)) return std::nullopt;
  SplatConnection splat;
  splat.camera = c;
  if (asks) splat.share = varying_share(value.f_cos, matte);
  if (!unweighted) splat.weight = weight_of_splat(vertex.mis, pdf_camera, value.pdf_w, counts);
  // adjoint_weight() times the geometry term to the camera times its importance: the cosine is in pdf_camera.
  splat.radiance = vertex.throughput * value.f_cos * float(splat.weight * pdf_camera / arriving);
  if (scene.features.absorption) {
    splat.radiance *= shadow_transmittance(scene, vertex.media, *vertex.surface.part, vertex.surface.front,
                                           dot(vertex.surface.geometric_normal, c.direction) > 0, c.distance);
  }
  if (is_black(splat.radiance)) return std::nullopt;
  splat.path_tracer = vertex.mis.path_tracer_behind(pdf_camera / counts.light_paths, value.pdf_w);
  return splat;
}

}  // namespace helio
