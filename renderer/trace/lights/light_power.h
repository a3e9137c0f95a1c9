// How much light each light gives: what selection by power weighs them with, and reports.
#pragma once

#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/images/texture.h"
#include "renderer/trace/lights/area_emitter.h"
#include "renderer/trace/lights/light_groups.h"
#include "renderer/trace/lights/punctual_light.h"

namespace helio {

// Mean luminance of the radiance that every area light emits, its texture and alpha averaged over its own area by
// lookups (as many as it covers texels, within bounds). A light that lies in a dark or transparent part of a texture
// that is not so everywhere keeps a hundredth of the texture's mean, so that a narrow bright spot between the lookups
// is still found. 0: black texture, or transparent everywhere. `textures` may be null when no light is textured.
std::vector<double> mean_radiances(const AreaLights& lights, const std::vector<AreaEmitter>& emitters,
                                   const TextureTable* textures);

// Luminance of the flux in W. For directional lights and an environment (whose `mean_radiance` is the mean luminance
// over the sphere): the flux through the cross section of a sphere of radius `scene_radius`.
double area_flux(const AreaLight& light, double mean_radiance);
double punctual_flux(const PunctualLight& light, double scene_radius);  // but of projectors: projector_power()
double environment_flux(double mean_radiance, double scene_radius);

}  // namespace helio
