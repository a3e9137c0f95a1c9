// Makes a reference of own_reference_test.cpp by the second estimator: NAME.mean.exr and NAME.variance.exr (of the
// mean), 32x32, float, 10 path segments.
//
// usage: helio_make_reference SCENES_FOLDER NAME SAMPLES SEED OUTPUT_FOLDER     (SCENES_FOLDER/NAME/NAME.gltf)
#include <cstdio>
#include <cstdlib>
#include <string>

#include "renderer/codec/tile_codec.h"
#include "renderer/scene/load/scene_loader.h"
#include "renderer/trace/camera/camera.h"
#include "tests/statistical/bsdf_only_tracer.h"

using namespace helio;

namespace {

constexpr int kSide = 32;

Status write(const std::string& path, const std::vector<V3d>& pixels) {
  std::vector<float> planes[3];
  for (const V3d& pixel : pixels) {
    for (int c = 0; c < 3; ++c) planes[c].push_back(float(pixel[c]));
  }
  const TileChannel channels[] = {
      {"R", planes[0].data(), true}, {"G", planes[1].data(), true}, {"B", planes[2].data(), true}};
  return write_exr(path, {{0, 0, kSide, kSide}, kSide, kSide}, channels,
                   {TilePixelType::float32, TileCompression::none});
}

int fail(const std::string& message) {
  std::fprintf(stderr, "helio_make_reference: %s\n", message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  char* end = nullptr;
  const unsigned long samples = argc == 6 ? std::strtoul(argv[3], &end, 10) : 0;
  const bool counted = end && *end == 0 && samples >= 2 && samples <= 1ul << 30;
  const unsigned long long seed = counted ? std::strtoull(argv[4], &end, 10) : 0;
  if (!counted || *end != 0) {
    return fail("usage: helio_make_reference SCENES_FOLDER NAME SAMPLES SEED OUTPUT_FOLDER; SAMPLES in [2, 2^30]");
  }
  const std::string name = argv[2];
  auto description = load_scene(*make_directory_source(std::string(argv[1]) + "/" + name), name + ".gltf", {});
  if (!description) return fail(description.error().to_string());
  const CameraPose pose = camera_pose(description->cameras.at(0));
  const auto scene = RenderScene::build(std::move(*description), {});
  if (!scene) return fail(scene.error().to_string());
  if (!test::suits_bsdf_only((*scene)->features())) {
    return fail(name + " has point lights or media that absorb, which paths without light sampling do not see");
  }
  test::BsdfOnlySettings settings;
  settings.samples = std::uint32_t(samples);
  settings.seed = seed;
  const test::Estimate estimate = test::trace_bsdf_only(**scene, pose, kSide, kSide, settings);
  const std::string base = std::string(argv[5]) + "/" + name;
  for (const auto& [kind, pixels] : {std::pair(".mean.exr", &estimate.mean), {".variance.exr", &estimate.variance}}) {
    if (const Status status = write(base + kind, *pixels); !status.ok()) return fail(status.error().to_string());
  }
  V3d mean(0, 0, 0), error(0, 0, 0);
  for (std::size_t i = 0; i < estimate.mean.size(); ++i) {
    mean += estimate.mean[i] / double(estimate.mean.size());
    error += estimate.variance[i];
  }
  std::printf("%s: mean %.6f %.6f %.6f, standard error %.2e\n", name.c_str(), mean.x, mean.y, mean.z,
              std::sqrt(std::max({error.x, error.y, error.z})) / double(estimate.mean.size()));
  return 0;
}
