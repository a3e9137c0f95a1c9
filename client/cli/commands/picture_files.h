// The files that a picture is left in.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/heat_maps.h"
#include "client/cli/options.h"
#include "client/cli/terminal.h"
#include "client/picture.h"
#include "renderer/codec/tile_codec.h"

namespace helio::cli {

struct FileOptions {
  TextOption output, png, heatmap, exposure;
  bool raw = false;
};
// `numbered`: the names are patterns, one file a view.
void add_file_options(CLI::App& app, FileOptions& options, bool numbered);

struct FileNames {
  std::string exr;                       // always written
  std::string png;                       // empty: none
  std::string heatmap;                   // name of the heat maps, see heat_map_file(); empty: none
  std::vector<HeatMap> heat_maps;        // those that are written
  bool raw = false;                      // the PNG shows the film as it is, not the layer display
  std::string denoiser = "own";          // that made the layer display
  std::optional<double> exposure_stops;  // none: automatic
};
// `default_exr` is used without --output. Folders must exist: nothing is rendered for a file that cannot be written.
FileNames read_files(const FileOptions& options, const std::string& default_exr, heliograph::v1::Mode mode,
                     OptionReader& reader);

// "shot.####.exr" -> "shot.0007.exr"; a name without '#' gets ".####" before its extension.
std::string numbered_name(const std::string& pattern, int number);
FileNames numbered(const FileNames& patterns, int number);

// Asks for the layers that the files are made of.
void add_layers(const FileNames& names, heliograph::v1::TileFormat& format);

// FrameBegin.unsampled.
using Unsampled = std::vector<std::string>;

// A picture with float channels, zip, at `path`, whole or not at all.
Status write_picture(const std::string& path, const TileHeader& header, const std::vector<std::string>& names,
                     const std::vector<std::vector<float>>& planes);

// Writes what `names` asks for and adds "output", "png", "png_layer", "denoiser", "unsampled" and what
// write_heat_maps() adds to `json`. The EXR holds float channels, zip, with the picture's window as its data window,
// `unsampled` as its comments, and `origin` (PictureOrigin as JSON; empty: not). The PNG is exposed for the eye; it and
// the JSON name the layer that it shows, "display" or "radiance".
Status write_files(const FileNames& names, const Picture& picture, const Unsampled& unsampled, Json& json,
                   const std::string& origin = {});

}  // namespace helio::cli
