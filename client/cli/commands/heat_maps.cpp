#include "client/cli/commands/heat_maps.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "renderer/codec/display_image.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

struct Look {
  const char* key;     // in the JSON
  const char* suffix;  // of the file
  const char* title;
  HeatRange range;
};

const Look& look_of(HeatMap map) {
  static const Look kError{"heatmap", "", "Standard error of each pixel over its mean", {1e-4f, 1, true}};
  static const Look kDensity{"density_map", ".density", "Samples of each pixel over their mean", {1.0f / 16, 16, true}};
  static const Look kReuse{"reuse_map", ".reuse", "Share of each pixel that earlier pictures brought", {0, 1, false}};
  switch (map) {
    case HeatMap::error:
      return kError;
    case HeatMap::density:
      return kDensity;
    case HeatMap::reuse:
      return kReuse;
  }
  return kError;
}

// 0 where neither is anything, +infinity where the mean is 0 and the error is not.
float relative_error(double variance, double mean) {
  if (variance == 0) return 0;
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double error = std::sqrt(variance);
  return mean > 0 ? float(std::min(error / mean, kLargest)) : std::numeric_limits<float>::infinity();
}

// Empty: the picture lacks a layer.
std::vector<float> relative_errors(const Picture& picture) {
  const std::vector<float>* planes[6] = {};
  const char* const names[6] = {"R", "G", "B", "variance.R", "variance.G", "variance.B"};
  for (int i = 0; i < 6; ++i) {
    planes[i] = picture.find(names[i]);
    if (!planes[i]) return {};
  }
  std::vector<float> errors(planes[0]->size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const auto mean = [&](int first) {
      return (double((*planes[first])[i]) + (*planes[first + 1])[i] + (*planes[first + 2])[i]) / 3;
    };
    errors[i] = relative_error(mean(3), mean(0));
  }
  return errors;
}

std::vector<float> values_of(const Picture& picture, HeatMap map) {
  if (map == HeatMap::error) return relative_errors(picture);
  const std::vector<float>* plane = picture.find(map == HeatMap::density ? "samples.density" : "history.weight");
  return plane ? *plane : std::vector<float>();
}

}  // namespace

std::vector<HeatMap> heat_maps_of(pb::Mode mode) {
  std::vector<HeatMap> maps{HeatMap::error};
  if (mode == pb::MODE_ADAPTIVE || mode == pb::MODE_COMBINED) maps.push_back(HeatMap::density);
  if (mode == pb::MODE_REPROJECT || mode == pb::MODE_COMBINED) maps.push_back(HeatMap::reuse);
  return maps;
}

void add_layers(const std::vector<HeatMap>& maps, pb::TileFormat& format) {
  for (const HeatMap map : maps) {
    if (map == HeatMap::error) format.set_without_variance(false);
    if (map == HeatMap::density) format.set_density(true);
    if (map == HeatMap::reuse) format.set_history(true);
  }
}

std::string heat_map_file(const std::string& name, HeatMap map) {
  const std::filesystem::path path(name);
  const std::string file = path.stem().string() + look_of(map).suffix + path.extension().string();
  return (path.parent_path() / file).string();
}

Status write_heat_maps(const std::string& name, const std::vector<HeatMap>& maps, const Picture& picture, Json& json) {
  for (const HeatMap map : maps) {
    const std::vector<float> values = values_of(picture, map);
    if (values.empty()) continue;
    const Look& look = look_of(map);
    const std::string path = heat_map_file(name, map);
    const Status written = write_heat_map_png(path, picture.window.width(), picture.window.height(), values.data(),
                                              look.range, look.title);
    if (!written) return written;
    json[look.key] = path;
    json[std::string(look.key) + "_range"] = {look.range.low, look.range.high};
  }
  return ok_status();
}

}  // namespace helio::cli
