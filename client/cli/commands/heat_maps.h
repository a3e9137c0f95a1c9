// Heat maps of a picture: where it is uncertain, where its samples went, and what earlier pictures brought.
#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal.h"
#include "client/picture.h"
#include "heliograph/v1/types.pb.h"
#include "renderer/base/result.h"

namespace helio::cli {

// Each has one colour scale, whatever the picture, so that views and modes can be compared.
enum class HeatMap {
  // Standard error of the pixel over its mean, both over the channels; logarithmic, 1e-4 to 1. Black pixels without
  // variance are at the low end, those of unknown variance, and black ones with some, at the high end.
  error,
  density,  // samples.density, the paper's probability over its mean (1: as many as the mean); logarithmic, 1/16 to 16
  reuse,    // history.weight; linear, 0 to 1
};

// Those that a picture of this mode has something to say in.
std::vector<HeatMap> heat_maps_of(heliograph::v1::Mode mode);

// Asks for the layers that they are made of.
void add_layers(const std::vector<HeatMap>& maps, heliograph::v1::TileFormat& format);

// The error map has the name itself; "shot.png" -> "shot.density.png", "shot.reuse.png".
std::string heat_map_file(const std::string& name, HeatMap map);

// Writes them and adds to `json`: "heatmap", "density_map", "reuse_map", each with its "..._range" of two numbers. A
// picture that lacks a map's layers is left without it.
Status write_heat_maps(const std::string& name, const std::vector<HeatMap>& maps, const Picture& picture, Json& json);

}  // namespace helio::cli
