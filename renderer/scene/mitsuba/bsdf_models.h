// BSDF plugins that scatter by themselves: diffuse, conductor, roughconductor, dielectric, roughdielectric,
// thindielectric, plastic, roughplastic, principled, null. Those that hold others are in mitsuba/bsdfs.h.
#pragma once

#include <optional>

#include "renderer/scene/mitsuba/context.h"
#include "renderer/scene/mitsuba/textures.h"

namespace helio::mitsuba {

// None: of another type.
std::optional<Material> read_bsdf_model(const Plugin& plugin, LoadContext& context);

// Lambert, black from behind.
Material diffuse_material(const ColorOrTexture& reflectance);

}  // namespace helio::mitsuba
