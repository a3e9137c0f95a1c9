#include "tests/bench/scenes/error_scenes.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "renderer/metrics/error_metrics.h"
#include "renderer/scene/load/scene_loader.h"
#include "tests/bench/reports/checksum64.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/scenes/generated_scenes.h"
#include "tests/bench/scenes/scene_settings.h"

namespace helio::bench {

namespace fs = std::filesystem;

namespace {

// A folder, with a checksum of all that was read from it: names and bytes.
class ChecksumSource final : public FileSource {
 public:
  explicit ChecksumSource(const fs::path& folder) : folder_(make_directory_source(folder.string())) {}

  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    auto bytes = folder_->read(path, max_bytes);
    if (!bytes) return bytes;
    sum_.add_text(path);
    for (const std::uint8_t byte : *bytes) sum_.add_byte(byte);
    return bytes;
  }
  std::uint64_t checksum() const { return sum_.value(); }

 private:
  std::unique_ptr<FileSource> folder_;
  mutable Checksum64 sum_;
};

// Beside the scene, made by another renderer. False: there is none.
Result<bool> find_reference(ErrorScene& scene) {
  const std::string stem = scene.file.stem().string();
  for (const fs::path& folder : {scene.file.parent_path(), scene.file.parent_path().parent_path()}) {
    for (const char* kind : {".reference.exr", ".mean.exr"}) {
      const fs::path file = folder / (stem + kind), variance = folder / (stem + ".variance.exr");
      if (!fs::exists(file)) continue;
      auto picture = read_picture(file);
      if (!picture) return picture.error();
      scene.reference_file = file;
      scene.reference = std::move(*picture);
      scene.reference_variance = scene.reference;
      for (auto& channel : scene.reference_variance.channels) std::fill(channel.begin(), channel.end(), 0.0f);
      scene.reference_noise = scene.reference_variance;
      if (!fs::exists(variance)) return true;
      auto of_mean = read_picture(variance);
      if (!of_mean) return of_mean.error();
      scene.reference_variance = std::move(*of_mean);
      scene.reference_noise = scene.reference_variance;
      return true;
    }
  }
  return false;
}

}  // namespace

double reference_mse(const ErrorScene& scene) {
  return mean_of(scene.reference_variance);
}

double reference_relmse(const ErrorScene& scene) {
  const double mean = mean_of(scene.reference);
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < scene.reference.channels[c].size(); ++i) {
      const double variance = scene.reference_variance.channels[c][i], value = scene.reference.channels[c][i];
      if (variance > 0) sum += variance / (value * value + RelativeEpsilon::image_mean().value * mean * mean);
    }
  }
  return sum / (3.0 * double(scene.reference.view().pixels()));
}

Result<fs::path> find_error_scene(const BenchOptions& options, const std::string& name, SceneKind kind) {
  const fs::path shared = fs::path(options.shared) / "scenes", own = HELIO_SOURCE_DIR "/scenes";
  std::vector<fs::path> places{name};
  if (kind == SceneKind::mitsuba_xml) {
    places.push_back(shared / "bench/mitsuba" / (name + ".xml"));
    places.push_back(shared / "mitsuba-references" / (name + ".xml"));
  } else {
    for (const std::string& generated : generated_scenes()) {
      if (generated == name) return generate_scene(fs::path(options.cache) / "scenes", name);
    }
    places.push_back(shared / "bench" / (name + ".gltf"));
    places.push_back(own / name / (name + ".gltf"));
    places.push_back(shared / "glb" / (name + ".glb"));
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
  scene.checksum = source.checksum();
  scene.view = camera_pose(scene.scene->description().cameras.at(0));
  scene.view.aspect = 0;  // references are square pictures of the camera's vertical angle
  const auto found = options.own_references ? Result<bool>(false) : find_reference(scene);
  if (!found) return found.error();
  const SceneDescription& description = scene.scene->description();
  scene.settings = scene_settings(description, description.cameras.at(0));
  if (*found) {
    scene.settings.width = scene.reference.width;
    scene.settings.height = scene.reference.height;
    return scene;
  }
  RenderSettings settings = scene.settings;
  const double aspect = description.cameras.at(0).aspect;
  settings.height = options.size;
  settings.width = aspect > 0 ? std::max(1, int(std::lround(options.size * aspect))) : options.size;
  const ReferenceRequest request{scene.name, scene.checksum, scene.scene, scene.view, settings, samples};
  auto made = reference_picture(engine, options.cache, request);
  if (!made) return made.error();
  scene.reference_file = reference_file(options.cache, request);
  scene.reference = std::move(made->picture);
  scene.reference_variance = std::move(made->variance);
  scene.reference_noise = std::move(made->noise);
  scene.settings.width = settings.width;
  scene.settings.height = settings.height;
  return scene;
}

Result<std::optional<ErrorScene>> open_error_scene(const BenchOptions& options, const std::string& name,
                                                   RenderEngine& engine, std::uint32_t reference_samples) {
  const auto file = find_error_scene(options, name, SceneKind::any);
  if (!file && options.scenes.empty()) {
    note(file.error().to_string() + "; left out");
    return std::optional<ErrorScene>();
  }
  if (!file) return file.error();
  auto scene = load_error_scene(options, *file, engine, reference_samples);
  if (!scene) return scene.error();
  return std::optional<ErrorScene>(std::move(*scene));
}

Status measure_error_scenes(const BenchOptions& options, const std::vector<std::string>& defaults, RenderEngine& engine,
                            std::uint32_t reference_samples, const std::function<Status(const ErrorScene&)>& measure) {
  for (const std::string& name : options.scenes.empty() ? defaults : options.scenes) {
    const auto scene = open_error_scene(options, name, engine, reference_samples);
    if (!scene) return scene.error();
    if (!*scene) continue;
    if (const Status measured = measure(**scene); !measured) return measured;
  }
  return ok_status();
}

}  // namespace helio::bench
