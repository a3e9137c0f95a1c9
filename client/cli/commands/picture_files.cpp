#include "client/cli/commands/picture_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "renderer/codec/atomic_file.h"
#include "renderer/codec/display_image.h"

namespace helio::cli {

Status write_picture(const std::string& path, const TileHeader& header, const std::vector<std::string>& names,
                     const std::vector<std::vector<float>>& planes) {
  std::vector<TileChannel> channels;
  for (std::size_t i = 0; i < names.size(); ++i) channels.push_back({names[i], planes[i].data(), true});
  const auto bytes = encode_tile(header, channels, {TilePixelType::float32, TileCompression::zip});
  if (!bytes) return bytes.error();
  return write_file_atomically(path, *bytes);
}

void add_file_options(CLI::App& app, FileOptions& options, bool numbered) {
  const std::string each = numbered ? " of each view; #### becomes the view's number, put before the extension when "
                                      "the name holds no #"
                                    : "";
  add_text(app, options.output, "--output,-o", numbered ? "PATTERN.exr" : "PICTURE.exr",
           "Picture" + each +
               ": R, G, B (mean radiance), variance.R, variance.G, variance.B (of that mean), samples, " +
               "as float. Default: NAME." + (numbered ? "####." : "") + "exr in the current folder for scene NAME.glb");
  add_text(app, options.png, "--png", numbered ? "PATTERN.png" : "FILE.png",
           "Also a picture for the eye" + std::string(numbered ? " of each view" : "") +
               ", exposed automatically: the layer display, filtered along surfaces where that makes the error "
               "smaller; the --output then holds it, too");
  add_flag(app, options.raw, "--raw", "The --png shows the mean radiance as it is, noise included");
  add_text(
      app, options.heatmap, "--heatmap", numbered ? "PATTERN.png" : "FILE.png",
      "Also a heat map" + std::string(numbered ? " of each view" : "") +
          ", dark (low) to pale (high): standard error of each pixel over its mean, 1e-4 to 1, logarithmic. In modes "
          "that have them also NAME.density.png (samples over their mean, 1/16 to 16, logarithmic) and "
          "NAME.reuse.png (share that earlier pictures brought, 0 to 1, linear); the --output then holds their "
          "layers");
  add_text(app, options.exposure, "--exposure", "STOPS",
           "Exposure of the --png in stops, [-64, 64], 0: radiance 1 is white. Default: automatic");
}

FileNames read_files(const FileOptions& options, const std::string& default_exr, heliograph::v1::Mode mode,
                     OptionReader& reader) {
  FileNames names;
  names.exr = reader.output_file(options.output).value_or(default_exr);
  names.png = reader.output_file(options.png).value_or("");
  names.heatmap = reader.output_file(options.heatmap).value_or("");
  if (!names.heatmap.empty()) names.heat_maps = heat_maps_of(mode);
  names.exposure_stops = reader.number(options.exposure, kExposureStops);
  if (options.exposure.given() && !options.png.given()) reader.problem(options.exposure, "is only valid with --png");
  names.raw = options.raw;
  if (options.raw && !options.png.given()) reader.problems().add("--raw", "is only valid with --png");
  return names;
}

std::string numbered_name(const std::string& pattern, int number) {
  const std::filesystem::path path(pattern);
  std::string name = path.filename().string();
  std::size_t first = name.find('#');
  if (first == std::string::npos) {
    first = name.size() - path.extension().string().size();
    name.insert(first, ".####");
    ++first;
  }
  const std::size_t end = std::min(name.find_first_not_of('#', first), name.size());
  name.replace(first, end - first, fmt::format("{:0{}}", number, end - first));
  return (path.parent_path() / name).string();
}

FileNames numbered(const FileNames& patterns, int number) {
  FileNames names = patterns;
  for (std::string* name : {&names.exr, &names.png, &names.heatmap}) {
    if (!name->empty()) *name = numbered_name(*name, number);
  }
  return names;
}

void add_layers(const FileNames& names, heliograph::v1::TileFormat& format) {
  add_layers(names.heat_maps, format);
  if (!names.png.empty() && !names.raw) format.set_display(true);
}

Status write_files(const FileNames& names, const Picture& picture, const Unsampled& unsampled, Json& json,
                   const std::string& origin) {
  const TileHeader header{picture.window, picture.frame_width, picture.frame_height,
                          fmt::format("{}", fmt::join(unsampled, "\n")), origin};
  Status written = write_picture(names.exr, header, picture.names, picture.planes);
  if (!written) return written;
  json["output"] = names.exr;
  json["unsampled"] = unsampled;
  if (picture.find("display.R")) json["denoiser"] = names.denoiser;

  const bool filtered = !names.raw && picture.find("display.R");
  const std::string prefix = filtered ? "display." : "";
  const std::vector<float>* const shown[] = {picture.find(prefix + "R"), picture.find(prefix + "G"),
                                             picture.find(prefix + "B")};
  if (!names.png.empty() && shown[0] && shown[1] && shown[2]) {
    const PictureView view{
        picture.window.width(), picture.window.height(), {shown[0]->data(), shown[1]->data(), shown[2]->data()}};
    const double exposure = names.exposure_stops ? std::exp2(*names.exposure_stops) : auto_exposure(view);
    const std::string layer = filtered ? "display" : "radiance";
    written = write_display_png(names.png, view, exposure, "Layer " + layer);
    if (!written) return written;
    json["png"] = names.png;
    json["png_layer"] = layer;
    json["exposure_stops"] = std::log2(exposure);
  }
  if (!names.heatmap.empty()) return write_heat_maps(names.heatmap, names.heat_maps, picture, json);
  return ok_status();
}

}  // namespace helio::cli
