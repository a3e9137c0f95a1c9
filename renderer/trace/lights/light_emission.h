// What leaves a point of an area light: its radiance, texture and alpha included. Next-event estimation and the lights'
// powers read it; it is what rays that hit the light find on average.
#pragma once

#include "renderer/trace/lights/light_groups.h"

namespace helio {

class TextureTable;  // renderer/scene/images/texture.h

// (u, v) of a point of a sphere or ellipsoid from its direction in the unit sphere's space (not necessarily unit):
// longitude and latitude of glTF's y-up space, laid out as environment.h does.
V2f sphere_uv(const V3f& local_direction);

// (s, t) of the point where a sample of the light's shape from `point` meets it.
V2f light_point(const AreaLight& light, const V3f& point, const ShapeSample& sample);

// `texture`: the emission's slot, read where light.textured; `alpha`: null for opaque lights. `textures` may be null
// when nothing is textured.
Rgb light_emission(const AreaLight& light, const TextureSlot& texture, const LightAlpha* alpha, const V2f& st,
                   const TextureTable* textures);

// Share in [0, 1] of what an opaque surface of this alpha would emit.
float coverage(const LightAlpha& alpha, const V2f& st, const TextureTable* textures);

}  // namespace helio
