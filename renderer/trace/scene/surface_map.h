// Normal and bump maps that give scattering a frame of its own: MapRule other than bend, as Mitsuba's normalmap and
// bumpmap.
//
// The surface keeps its shading normal; its material scatters about the mapped one, seen from there, and what the two
// disagree about, directions above the one and below the other, is black. The map's frame is (u, n x u, n), u along
// growing texture coordinates. Shadowing: Conty Estevez, Lecocq and Stein 2019.
#pragma once

#include "renderer/trace/scene/surface.h"
#include "renderer/trace/scene/surface_layers.h"

namespace helio {

// Sets params.mapped, map_normal and map_alpha2 = min(1, tan^2 / 8) of the angle between the normals. Nothing where
// there are no texture coordinates. Arguments as of evaluate_material().
void set_mapped_normal(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, const Surface& surface,
                       SurfaceParams& params);

// World space: the frame that the directions of `params` are in.
Frame scattering_frame(const Surface& surface, const SurfaceParams& params);

}  // namespace helio
