#include "tests/bench/bench_context.h"

#include <tbb/task_arena.h>
#include <unistd.h>

#include "renderer/scene/load/scene_loader.h"
#include "tests/bench/peers/child_process.h"

namespace helio::bench {

namespace fs = std::filesystem;

BenchContext::BenchContext(BenchOptions options) : options_(std::move(options)) {
  std::string pattern = (fs::temp_directory_path() / "helio_bench.XXXXXX").string();
  if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make a folder like " + pattern);
  folder_ = pattern;
}

BenchContext::~BenchContext() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

Status BenchContext::make_room(const std::string& target) {
  if (fs::exists(folder_ / target)) return ok_status();
  if (room_error_) return *room_error_;
  const std::string python = options_.mitsuba_python.empty() ? "python3" : options_.mitsuba_python;
  auto process = ChildProcess::start({python, (bench_scenes() / "room.py").string(), (folder_ / target).string()});
  if (process && (*process)->wait() == 0) return ok_status();
  std::error_code ignored;
  fs::remove_all(folder_ / target, ignored);
  room_error_ = Error{ErrorCode::failed_precondition,
                      "no room: '" + python + " " + (bench_scenes() / "room.py").string() +
                          "' failed; it needs Python with numpy (--mitsuba-python, HELIO_MITSUBA_PYTHON)",
                      {}};
  return *room_error_;
}

Result<fs::path> BenchContext::room() {
  if (const Status made = make_room("room.glb"); !made) return made.error();
  return folder_ / "room.glb";
}

Result<fs::path> BenchContext::room_xml() {
  if (const Status made = make_room("room"); !made) return made.error();
  return folder_ / "room/room.xml";
}

Result<std::shared_ptr<const RenderScene>> load_bench_scene(const fs::path& file, int threads,
                                                            const std::string& environment,
                                                            TextureFilter texture_filter) {
  tbb::task_arena arena(threads);
  return arena.execute([&]() -> Result<std::shared_ptr<const RenderScene>> {
    const auto source = make_directory_source(file.parent_path().string());
    SceneLoadOptions load;
    load.environment = environment;
    auto description = load_scene(*source, file.filename().string(), load);
    if (!description) return description.error();
    RenderSceneOptions options;
    options.threads = threads;
    options.texture_filter = texture_filter;
    return RenderScene::build(std::move(description).value(), options);
  });
}

Camera first_camera(const RenderScene& scene, int size) {
  return Camera(camera_pose(scene.description().cameras.front()), size, size, scene.origin());
}

}  // namespace helio::bench
