#include "renderer/trace/lights/light_emission.h"

#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/texture.h"

namespace helio {

V2f sphere_uv(const V3f& local_direction) {
  return environment_uv(local_direction);
}

V2f light_point(const AreaLight& light, const V3f& point, const ShapeSample& sample) {
  if (light.shape.kind == ShapeKind::triangle || light.shape.kind == ShapeKind::parallelogram) return sample.st;
  return sphere_uv(local_direction(light.shape, point + sample.direction * sample.distance));
}

float coverage(const LightAlpha& alpha, const V2f& st, const TextureTable* textures) {
  float a = alpha.factor + alpha.factor_s * st.x + alpha.factor_t * st.y;
  if (alpha.texture.present()) {
    a *= textures->lookup(alpha.texture, alpha.uv + alpha.uv_s * st.x + alpha.uv_t * st.y).w;
  }
  if (alpha.mask) return a >= alpha.cutoff ? 1.0f : 0.0f;
  return std::clamp(a, 0.0f, 1.0f);
}

Rgb light_emission(const AreaLight& light, const TextureSlot& texture, const LightAlpha* alpha, const V2f& st,
                   const TextureTable* textures) {
  Rgb radiance = light.radiance;
  if (light.textured) {
    const V4f value = textures->lookup(texture, light.uv + light.uv_s * st.x + light.uv_t * st.y);
    radiance *= Rgb(value.x, value.y, value.z);
  }
  if (alpha) radiance *= coverage(*alpha, st, textures);
  return radiance;
}

}  // namespace helio
