#include "tests/bench/scenes/reference_pictures.h"

#include <spdlog/fmt/fmt.h>

#include "renderer/codec/tile_codec.h"
#include "tests/bench/reports/checksum64.h"
#include "tests/bench/reports/figures.h"

namespace helio::bench {

namespace fs = std::filesystem;

namespace {

constexpr const char* kChannels[3] = {"R", "G", "B"};
constexpr std::uint64_t kMostPixels = 1 << 26;
constexpr std::uint64_t kReferenceSeeds[2] = {0x5eed000000000001, 0x5eed000000000002};

void add(Checksum64& sum, const V3d& v) {
  for (int axis = 0; axis < 3; ++axis) sum.add_number(v[axis]);
}

void add(Checksum64& sum, const CameraPose& view) {
  sum.add_number(std::uint64_t(view.projection));
  for (const V3d* v : {&view.position, &view.right, &view.up, &view.forward}) add(sum, *v);
  for (const double number : {view.vertical_fov, view.half_height, view.lens_radius, view.focus_distance}) {
    sum.add_number(number);
  }
}

void add(Checksum64& sum, const RenderSettings& settings) {
  for (const int number : {settings.max_segments, settings.roulette_from, int(settings.roulette),
                           int(settings.filter.kind), int(settings.integrator)}) {
    sum.add_number(std::uint64_t(number));
  }
  sum.add_number(settings.filter.scale);
  const PixelRect region = settings.rendered_region();
  for (const int edge : {region.x0, region.y0, region.x1, region.y1}) sum.add_number(std::uint64_t(edge));
}

// Two independent pictures of half the samples: their mean is the reference, ((a - b) / 2)^2 its squared error.
Status render(RenderEngine& engine, const ReferenceRequest& request, LoopPicture& mean, LoopPicture& variance) {
  RenderSettings settings = request.settings;
  settings.mode = RenderMode::pt;
  LoopPicture halves[2];
  for (int h = 0; h < 2; ++h) {
    settings.seed = kReferenceSeeds[h];
    auto picture = render_picture(engine, request.scene, settings, request.samples / 2, request.view);
    if (!picture) return picture.error();
    halves[h] = std::move(*picture);
  }
  mean = variance = halves[0];
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < mean.channels[c].size(); ++i) {
      const double a = halves[0].channels[c][i], b = halves[1].channels[c][i];
      mean.channels[c][i] = float(0.5 * (a + b));
      variance.channels[c][i] = float(0.25 * (a - b) * (a - b));
    }
  }
  return ok_status();
}

// The mean over each pixel and its neighbours.
LoopPicture smoothed(const LoopPicture& picture) {
  LoopPicture out = picture;
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const PixelRect around = intersect({x - 1, y - 1, x + 2, y + 2}, {0, 0, picture.width, picture.height});
        double sum = 0;
        for (int py = around.y0; py < around.y1; ++py) {
          for (int px = around.x0; px < around.x1; ++px)
            sum += double(picture.channels[c][std::size_t(py) * std::size_t(picture.width) + std::size_t(px)]);
        }
        out.channels[c][std::size_t(y) * std::size_t(picture.width) + std::size_t(x)] =
            float(sum / double(around.area()));
      }
    }
  }
  return out;
}

Status make(RenderEngine& engine, const ReferenceRequest& request, const fs::path& file) {
  note(fmt::format("{}: rendering a reference of {} samples into {}", request.name, request.samples, file.string()));
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) {
    return Error{ErrorCode::permission_denied, "cannot be made: " + error.message(), file.parent_path().string()};
  }
  LoopPicture mean, variance;
  if (const Status rendered = render(engine, request, mean, variance); !rendered) return rendered;
  std::vector<TileChannel> channels;
  for (int c = 0; c < 3; ++c) channels.push_back({kChannels[c], mean.channels[c].data(), true});
  for (int c = 0; c < 3; ++c) {
    channels.push_back({std::string("variance.") + kChannels[c], variance.channels[c].data(), true});
  }
  const TileHeader header{{0, 0, mean.width, mean.height}, mean.width, mean.height};
  return write_exr(file.string(), header, channels, {TilePixelType::float32, TileCompression::zip});
}

}  // namespace

fs::path reference_file(const fs::path& folder, const ReferenceRequest& request) {
  Checksum64 sum;
  sum.add_number(request.scene_checksum);
  add(sum, request.view);
  add(sum, request.settings);
  return folder / fmt::format("{}-{}x{}-{}-{:016x}.exr", request.name, request.settings.width, request.settings.height,
                              request.samples, sum.value());
}

Result<Reference> reference_picture(RenderEngine& engine, const fs::path& folder, const ReferenceRequest& request) {
  const fs::path file = reference_file(folder, request);
  if (!fs::exists(file)) {
    if (const Status made = make(engine, request, file); !made) return made.error();
  }
  auto picture = read_picture(file);
  if (!picture) return picture.error();
  auto noise = read_picture(file, "variance.");
  if (!noise) return noise.error();
  LoopPicture variance = smoothed(*noise);
  return Reference{std::move(*picture), std::move(variance), std::move(*noise)};
}

Result<LoopPicture> read_picture(const fs::path& file, const std::string& prefix) {
  auto decoded = read_exr(file.string(), kMostPixels);
  if (!decoded) return decoded.error();
  LoopPicture picture;
  picture.width = decoded->header.data_window.width();
  picture.height = decoded->header.data_window.height();
  for (int c = 0; c < 3; ++c) {
    const std::string name = prefix + kChannels[c];
    const std::vector<float>* channel = decoded->find(name);
    if (!channel) return Error{ErrorCode::invalid_argument, "has no channel " + name, file.string()};
    picture.channels[c] = *channel;
  }
  return picture;
}

double mean_of(const LoopPicture& picture) {
  double sum = 0;
  for (const auto& channel : picture.channels) {
    for (const float value : channel) sum += value;
  }
  return sum / (3.0 * double(picture.view().pixels()));
}

}  // namespace helio::bench
