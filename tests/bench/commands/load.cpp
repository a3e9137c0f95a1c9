// From the file to a scene that can be rendered, over reading the file and a bare Embree build of its triangles.
#include <tbb/task_arena.h>

#include <fstream>

#include "renderer/base/clock.h"
#include "renderer/scene/load/scene_loader.h"
#include "renderer/trace/accel/embree.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

// Arrays as Embree wants them: readable 16 bytes from the last vertex on.
struct BareMesh {
  std::vector<V3f> positions;
  std::size_t vertices = 0;
  std::vector<std::uint32_t> indices;
};

Result<std::vector<BareMesh>> read_meshes(const std::filesystem::path& file) {
  const auto source = make_directory_source(file.parent_path().string());
  auto description = load_scene(*source, file.filename().string(), {});
  if (!description) return description.error();
  std::vector<BareMesh> meshes;
  for (const Instance& instance : description->instances) {
    for (const TriangleMesh& mesh : description->objects[std::size_t(instance.object)].meshes) {
      BareMesh bare{mesh.positions, mesh.positions.size(), mesh.indices};
      bare.positions.emplace_back(0.0f);
      meshes.push_back(std::move(bare));
    }
  }
  return meshes;
}

double read_file_seconds(const std::filesystem::path& file) {
  const double started = now_s();
  std::ifstream stream(file, std::ios::binary);
  std::vector<char> bytes(std::filesystem::file_size(file));
  stream.read(bytes.data(), std::streamsize(bytes.size()));
  return now_s() - started;
}

double bare_build_seconds(RTCDevice device, const std::vector<BareMesh>& meshes) {
  const double started = now_s();
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  for (const BareMesh& mesh : meshes) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0,
                               sizeof(V3f), mesh.vertices);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                               3 * sizeof(std::uint32_t), mesh.indices.size() / 3);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene);
  const double seconds = now_s() - started;
  rtcReleaseScene(scene);
  return seconds;
}

}  // namespace

Status run_load(BenchContext& context, Figures& figures) {
  const auto file = context.room();
  if (!file) {
    note(file.error().to_string());
    return ok_status();
  }
  const int threads = context.options().threads;
  const auto meshes = read_meshes(*file);
  if (!meshes) return meshes.error();
  RTCDevice device = rtcNewDevice("start_threads=0,set_affinity=0");
  tbb::task_arena arena(threads);

  std::vector<double> ratio, ours, bare;
  for (int i = -1; i < context.options().repeat; ++i) {
    const double started = now_s();
    auto scene = load_bench_scene(*file, threads);
    const double load_seconds = now_s() - started;
    if (!scene) return scene.error();
    scene = std::shared_ptr<const RenderScene>();
    const double bare_seconds =
        read_file_seconds(*file) + arena.execute([&] { return bare_build_seconds(device, *meshes); });
    if (i < 0) continue;  // warm-up: the file is in the page cache from here on
    ratio.push_back(load_seconds / bare_seconds);
    ours.push_back(load_seconds);
    bare.push_back(bare_seconds);
  }
  rtcReleaseDevice(device);
  figures.add({"room.load", median(ratio), "x", 2.0, Better::lower});
  figures.add({"room.load.seconds", median(ours), "s", std::nullopt, Better::lower});
  figures.add({"room.load.bare_seconds", median(bare), "s", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace helio::bench
