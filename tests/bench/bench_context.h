// The scenes of the benches, made once per run, and the folder that they are made in.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "renderer/base/result.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"
#include "tests/bench/bench_options.h"

namespace helio::bench {

class BenchContext {
 public:
  explicit BenchContext(BenchOptions options);
  ~BenchContext();  // removes the folder
  BenchContext(const BenchContext&) = delete;
  BenchContext& operator=(const BenchContext&) = delete;

  const BenchOptions& options() const { return options_; }
  const std::filesystem::path& folder() const { return folder_; }

  std::filesystem::path bench_scenes() const { return std::filesystem::path(options_.shared) / "scenes/bench"; }
  std::filesystem::path cornell() const { return bench_scenes() / "cornell.gltf"; }
  std::filesystem::path cornell_xml() const { return bench_scenes() / "mitsuba/cornell.xml"; }

  // The 1.02 M triangle room, written by room.py on first use. failed_precondition: no Python with numpy; the same
  // answer every time.
  Result<std::filesystem::path> room();
  Result<std::filesystem::path> room_xml();

 private:
  Status make_room(const std::string& target);

  BenchOptions options_;
  std::filesystem::path folder_;
  std::optional<Error> room_error_;
};

// `environment`: as in SceneLoadOptions.
Result<std::shared_ptr<const RenderScene>> load_bench_scene(const std::filesystem::path& file, int threads,
                                                            const std::string& environment = {},
                                                            TextureFilter texture_filter = TextureFilter::bilinear);

// The scene's first camera on a square film of `size` pixels a side.
Camera first_camera(const RenderScene& scene, int size);

}  // namespace helio::bench
