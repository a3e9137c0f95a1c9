// One table of the channels of a picture, for resolving, encoding, requests and reports.
//
// To add a channel: its bit, kResolveAll and its vectors here; its row and function in channels.cpp; a bool field of
// its name in the protocol's TileFormat. Encoder and conversion read the table, and the command's --layers TileFormat's
// fields; the help of --layers (client/cli/render_options.cpp) is written by hand.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "renderer/film/core/film.h"

namespace helio {

// Planar pixels of a window of the film, row-major, top row first. Vectors have window.area() entries, or none when not
// asked for.
struct ResolvedTile {
  PixelRect window;
  std::vector<float> radiance[3];
  // Variance of the mean, per channel, from differences of the halves, pooled; of a film with history the square of
  // what reuse may have added is in it (FilmHistory::bias2).
  std::vector<float> variance[3];
  std::vector<float> samples;  // valid samples, both halves, carried ones included
  std::vector<float> alpha, depth, normal[3], albedo[3];
  // Carried samples; all 0 in films without history.
  std::vector<float> history_weight;  // of carried samples in the pixel's mean, [0, 1]
  std::vector<float> bias_bound;      // root of FilmHistory::bias2: radiance, >= 0
  // Camera moves since the history was traced times history_weight, [0, 255]; RootByte may overstate by up to half.
  std::vector<float> history_age;
  std::vector<float> density;         // fresh samples over their mean in the picture, >= 0
  // For the eye, linear radiance, biased (display/display_layer.h); previews have nothing else.
  std::vector<float> display[3];
  std::vector<float> display_error;   // root of the mean square over channels, by estimate, >= 0; of films alone
  std::uint64_t invalid_samples = 0;  // splats among them

  std::size_t bytes() const;
};

// Sets of channels; radiance is always among them.
enum ResolveChannels : unsigned {
  kResolveVariance = 1,
  kResolveSamples = 2,
  kResolveAlpha = 4,
  kResolveDepth = 8,
  kResolveNormal = 16,
  kResolveAlbedo = 32,
  kResolveHistory = 64,
  kResolveDensity = 128,
  kResolveDisplay = 256,
  kResolveAll = 511,
  // No channel: beside kResolveDisplay, Open Image Denoise makes the display layer (display/oidn_library.h).
  kDisplayByOidn = 512,
};

// How a plane is stored where halves are asked for.
enum class Storage {
  half,
  positive_half,  // what is above 0 stays so
  count,          // half as long as it holds the integers, float beyond that
  float32,
};

struct ChannelPlane {
  const char* name;  // in EXR files
  const std::vector<float>& (*of)(const ResolvedTile& tile);
  Storage storage = Storage::half;
};

struct Channel {
  bool in(unsigned channels) const { return bit == 0 || (channels & bit) != 0; }

  unsigned bit;      // 0: radiance
  const char* name;  // as requests have it; "": radiance
  bool by_default;   // requests leave it out by "without_NAME"; others ask for it by NAME
  std::span<const ChannelPlane> planes;
  // Fills the planes of a tile whose window is set. Null: resolve_tile() does so row by row, or DisplayLayer.
  void (*resolve)(const Film& film, double mean_samples, ResolvedTile& tile);
};

// In the order of the files.
std::span<const Channel> channel_table();

}  // namespace helio
