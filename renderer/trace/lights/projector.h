// What a projector adds to a point light: a picture in its light, and the cosine by which a wall is lit evenly.
#pragma once

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

class TextureTable;  // renderer/scene/images/texture.h

// A PictureProjection in floats.
struct Projector {
  V3f across{0, 0, 0}, down{0, 0, 0}, depth{0, 0, -1}, axis{0, 0, -1};
  // The way back: the point of the picture at depth 1 is centre + (u - 1/2) along_u + (v - 1/2) along_v.
  V3f along_u{0, 0, 0}, along_v{0, 0, 0}, center{0, 0, -1};
  double determinant = 0;  // > 0, of the rows across, down, depth; 0: the picture is degenerate
  TextureSlot picture;
};

Projector make_projector(const PunctualLight& light);

// Factor on the light that a point source of PunctualLight::intensity in every direction sends along the unit
// `direction`: picture / (z^2 cos), z = depth.direction and cos that to the axis. Black beside the picture.
// `textures` may be null where there is no picture.
Rgb projected(const Projector& projector, const V3f& direction, const TextureTable* textures);

struct ProjectorDeparture {
  V3f direction{0, 0, 0};  // unit, the way the light travels
  Rgb factor{0, 0, 0};     // as projected()
  double pdf_w = 0;        // solid angle density, that of departure_pdf_w(); 0: none
};

// A direction to a point drawn uniformly over the picture. u in [0, 1)^2.
ProjectorDeparture depart(const Projector& projector, const V2f& u, const TextureTable* textures);
// For any unit direction into the picture.
double departure_pdf_w(const Projector& projector, const V3f& direction);

// For selection: what the light gives, and where.
struct ProjectorPower {
  double flux = 0;       // W, luminance; a picture that is dark but for a spot keeps a hundredth of its image's mean
  double intensity = 0;  // W / sr, luminance, mean over the cone
  float half_angle = 0;  // of the cone around the axis that holds the picture, [0, pi / 2]
};

ProjectorPower projector_power(const PunctualLight& light, const TextureTable* textures);

}  // namespace helio
