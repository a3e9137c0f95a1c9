#include "error_scenes.h"

#include <spdlog/fmt/fmt.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "figures.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/scene/scene_loader.h"

namespace helio::bench {

namespace fs = std::filesystem;

namespace {

constexpr const char* kChannels[3] = {"R", "G", "B"};
constexpr std::uint64_t kMostPixels = 1 << 26;
// No curve's: those count from 0.
constexpr std::uint64_t kReferenceSeeds[2] = {0x5eed000000000001, 0x5eed000000000002};

// A folder, with a checksum of all that was read from it (FNV-1a, 64 bits, over names and bytes).
class ChecksumSource final : public FileSource {
 public:
  explicit ChecksumSource(const fs::path& folder) : folder_(make_directory_source(folder.string())) {}

  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    auto bytes = folder_->read(path, max_bytes);
    if (!bytes) return bytes;
    for (const char letter : path) add(std::uint8_t(letter));
    for (const std::uint8_t byte : *bytes) add(byte);
    return bytes;
  }
  std::uint64_t checksum() const { return sum_; }

 private:
  void add(std::uint8_t byte) const { sum_ = (sum_ ^ byte) * 0x100000001b3u; }

  std::unique_ptr<FileSource> folder_;
  mutable std::uint64_t sum_ = 0xcbf29ce484222325u;
};

double mean_of(const LoopPicture& picture) {
  double sum = 0;
  for (const auto& channel : picture.channels) {
    for (const float value : channel) sum += value;
  }
  return sum / (3.0 * double(picture.view().pixels()));
}

// Beside the scene, made by another renderer. False: there is none.
Result<bool> find_reference(ErrorScene& scene) {
  const std::string stem = scene.file.stem().string();
  for (const fs::path& folder : {scene.file.parent_path(), scene.file.parent_path().parent_path()}) {
    for (const char* kind : {".reference.exr", ".mean.exr"}) {
      const fs::path file = folder / (stem + kind), variance = folder / (stem + ".variance.exr");
      if (!fs::exists(file)) continue;
      auto picture = read_picture(file);
      if (!picture) return picture.error();
      scene.reference = std::move(*picture);
      if (!fs::exists(variance)) return true;
      const auto of_mean = read_picture(variance);
      if (!of_mean) return of_mean.error();
      scene.reference_mse = mean_of(*of_mean);
      return true;
    }
  }
  return false;
}

// Two independent pictures of half the samples: their mean is the reference, ((a - b) / 2)^2 its squared error.
Status render_reference(RenderEngine& engine, RenderSettings settings, std::uint32_t samples, ErrorScene& scene,
                        std::vector<float> (&variance)[3]) {
  LoopPicture halves[2];
  for (int h = 0; h < 2; ++h) {
    settings.seed = kReferenceSeeds[h];
    auto picture = render_picture(engine, scene.scene, settings, samples / 2);
    if (!picture) return picture.error();
    halves[h] = std::move(*picture);
  }
  scene.reference = halves[0];
  for (int c = 0; c < 3; ++c) {
    variance[c].resize(halves[0].channels[c].size());
    for (std::size_t i = 0; i < variance[c].size(); ++i) {
      const double a = halves[0].channels[c][i], b = halves[1].channels[c][i];
      scene.reference.channels[c][i] = float(0.5 * (a + b));
      variance[c][i] = float(0.25 * (a - b) * (a - b));
    }
  }
  return ok_status();
}

Status make_reference(const BenchOptions& options, RenderEngine& engine, std::uint32_t samples, std::uint64_t checksum,
                      ErrorScene& scene) {
  RenderSettings settings;
  const double aspect = scene.scene->description().cameras.at(0).aspect;
  settings.height = options.size;
  settings.width = aspect > 0 ? std::max(1, int(std::lround(options.size * aspect))) : options.size;
  const fs::path file = fs::path(options.cache) / fmt::format("{}-{}x{}-{}-{:016x}.exr", scene.name, settings.width,
                                                              settings.height, samples, checksum);
  if (!fs::exists(file)) {
    note(fmt::format("{}: rendering a reference of {} samples into {}", scene.name, samples, file.string()));
    std::error_code error;
    fs::create_directories(options.cache, error);
    if (error) return Error{ErrorCode::permission_denied, "cannot be made: " + error.message(), options.cache};
    std::vector<float> variance[3];
    if (const Status made = render_reference(engine, settings, samples, scene, variance); !made) return made;
    std::vector<TileChannel> channels;
    for (int c = 0; c < 3; ++c) channels.push_back({kChannels[c], scene.reference.channels[c].data(), true});
    for (int c = 0; c < 3; ++c) channels.push_back({std::string("variance.") + kChannels[c], variance[c].data(), true});
    const TileHeader header{{0, 0, settings.width, settings.height}, settings.width, settings.height};
    const Status written = write_exr(file.string(), header, channels, {TilePixelType::float32, TileCompression::zip});
    if (!written) return written;
  }
  auto picture = read_picture(file);
  if (!picture) return picture.error();
  scene.reference = std::move(*picture);
  const auto variance = read_picture(file, "variance.");
  if (!variance) return variance.error();
  scene.reference_mse = mean_of(*variance);
  return ok_status();
}

}  // namespace

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

Result<fs::path> find_error_scene(const BenchOptions& options, const std::string& name, SceneKind kind) {
  const fs::path shared = fs::path(options.shared) / "scenes", own = HELIO_SOURCE_DIR "/scenes";
  std::vector<fs::path> places{name};
  if (kind == SceneKind::mitsuba_xml) {
    places.push_back(shared / "bench/mitsuba" / (name + ".xml"));
    places.push_back(shared / "mitsuba-references" / (name + ".xml"));
  } else {
    places.push_back(shared / "bench" / (name + ".gltf"));
    places.push_back(own / name / (name + ".gltf"));
  }
  std::string tried;
  for (const fs::path& place : places) {
    std::error_code ignored;
    if (fs::is_regular_file(place, ignored)) return place;
    tried += (tried.empty() ? "" : ", ") + place.string();
  }
  return Error{ErrorCode::not_found, "none of these is a file: " + tried, "scene " + name};
}

Result<ErrorScene> load_error_scene(const BenchOptions& options, const fs::path& file, RenderEngine& engine,
                                    std::uint32_t samples) {
  ErrorScene scene;
  scene.name = file.stem().string();
  scene.file = file;
  const ChecksumSource source(file.parent_path());
  tbb::task_arena arena(options.threads);
  auto built = arena.execute([&]() -> Result<std::shared_ptr<const RenderScene>> {
    auto description = load_scene(source, file.filename().string(), {});
    if (!description) return description.error();
    RenderSceneOptions build;
    build.threads = options.threads;
    return RenderScene::build(std::move(description).value(), build);
  });
  if (!built) return built.error();
  scene.scene = std::move(*built);
  const auto found = find_reference(scene);
  if (!found) return found.error();
  if (*found) return scene;
  if (const Status made = make_reference(options, engine, samples, source.checksum(), scene); !made)
    return made.error();
  return scene;
}

}  // namespace helio::bench
