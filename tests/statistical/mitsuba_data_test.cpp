// The 48 x 48 test scenes of Mitsuba's own data repository against their reference pictures.
//
// Their variance pictures hold the variance of one sample; both were written by Mitsuba's reference tool, by default
// from 32,000 samples per pixel, and went from XYZ to linear sRGB by the linear map, variances too: taken back, the
// channels are those of XYZ, in which everything is compared. Pixels with less than 1e-4 of variance count as that, as
// in Mitsuba's test. Two segments per path.
//
// wood.jpg, which four of the five scenes use, is not part of the data at hand: another image stands in for it, and
// pixels in or next to which the object that wears it is seen are left out.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "renderer/film/history/film_history.h"
#include "renderer/scene/load/scene_loader.h"
#include "renderer/trace/reuse/reprojection.h"
#include "tests/statistical/estimates.h"
#include "tests/support/test_scenes.h"

namespace helio {
namespace {

constexpr const char* kFolder = "scenes/mitsuba-xml/mitsuba-data";
constexpr const char* kScenes = "tests/scenes/bsdf_spheres/";
constexpr const char* kMissing = "common/textures/wood.jpg";
constexpr const char* kStandIn = "common/textures/noise_8x8.png";
constexpr double kReferenceSamples = 32'000, kLeastVariance = 1e-4;

// Linear sRGB to XYZ (IEC 61966-2-1, D65).
constexpr double kToXyz[3][3] = {
    {0.412453, 0.357580, 0.180423}, {0.212671, 0.715160, 0.072169}, {0.019334, 0.119193, 0.950227}};

V3d to_xyz(const V3d& rgb) {
  V3d xyz(0, 0, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) xyz[i] += kToXyz[i][j] * rgb[j];
  return xyz;
}

class StandInSource final : public FileSource {
 public:
  explicit StandInSource(const std::string& root) : files_(make_directory_source(root)) {}
  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    Result<std::vector<std::uint8_t>> bytes = files_->read(path, max_bytes);
    if (bytes.ok() || path != kMissing) return bytes;
    return files_->read(kStandIn, max_bytes);
  }

 private:
  std::unique_ptr<FileSource> files_;
};

std::vector<V3d> read_xyz(const std::filesystem::path& path, int& width, int& height) {
  std::vector<V3d> pixels = test::read_pixels(path, width, height);
  for (V3d& pixel : pixels) pixel = to_xyz(pixel);
  return pixels;
}

// In XYZ. The channels of a sample rise and fall together at most: their deviations are added, not their variances.
test::Estimate estimate_of(const Film& film) {
  test::Estimate e{film.width(), film.height(), {}, {}};
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const test::PixelMoments m = test::moments_of(film, x, y);
      e.mean.push_back(to_xyz(m.mean));
      const V3d xyz = to_xyz(V3d(std::sqrt(m.variance.x), std::sqrt(m.variance.y), std::sqrt(m.variance.z)));
      e.variance.push_back(xyz * xyz);
    }
  }
  return e;
}

// By instance of the description: whether it wears the texture of that name.
std::vector<bool> wearers(const SceneDescription& scene, const std::string& image) {
  std::vector<bool> wears;
  for (const Instance& instance : scene.instances) {
    const Object& object = scene.objects[std::size_t(instance.object)];
    const int material = object.meshes.empty() ? object.spheres[0].material : object.meshes[0].material;
    const int texture = scene.materials[std::size_t(material)].base_color_texture.image;
    wears.push_back(texture >= 0 && scene.images[std::size_t(texture)].name.find(image) != std::string::npos);
  }
  return wears;
}

// Pixels whose neighbourhood shows a wearer.
std::vector<bool> left_out(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, int width,
                           int height, const std::vector<bool>& wears) {
  Film film(width, height, {.history = true});
  ReprojectionStats stats;
  Reprojection(scene, film, film.bounds(), pose, {}, {}).carry(film.bounds(), stats);
  std::vector<bool> out(std::size_t(film.width()) * std::size_t(film.height()), false);
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const std::uint32_t instance = film.history()->centre(x, y).instance;
      if (instance >= wears.size() || !wears[instance]) continue;
      for (int j = std::max(0, y - 1); j <= std::min(film.height() - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(film.width() - 1, x + 1); ++i)
          out[std::size_t(j) * std::size_t(film.width()) + std::size_t(i)] = true;
    }
  }
  return out;
}

struct DataScene {
  const char* name;
  double least_share;  // of the pixels that are compared
};

class MitsubaData : public testing::TestWithParam<DataScene> {};

TEST_P(MitsubaData, PassesTheZTests) {
  HELIO_SHARED_OR_SKIP(root, kFolder);
  const std::string name = GetParam().name;
  const StandInSource source(root.string());
  const bool missing = !std::filesystem::exists(root / kMissing);
  Result<SceneDescription> description = load_scene(source, kScenes + ("test_" + name) + "_path.xml", {});
  ASSERT_TRUE(description.ok()) << description.error().to_string();
  EXPECT_TRUE(description->report.unread.empty()) << description->report.unread.front();
  test::Estimate reference;
  const std::filesystem::path refs = root / kScenes / "refs";
  reference.mean = read_xyz(refs / ("test_" + name + "_ref_rgb.exr"), reference.width, reference.height);
  reference.variance = read_xyz(refs / ("test_" + name + "_ref_rgb_var.exr"), reference.width, reference.height);
  ASSERT_EQ(reference.mean.size(), reference.variance.size());
  ASSERT_FALSE(reference.mean.empty());
  for (V3d& variance : reference.variance)
    for (int c = 0; c < 3; ++c) variance[c] = std::max(variance[c], kLeastVariance) / kReferenceSamples;

  const std::vector<bool> wears = wearers(*description, "wood.jpg");
  const CameraPose pose = camera_pose(description->cameras.front());
  const auto scene = test::build(std::move(*description));
  ASSERT_TRUE(scene);
  PathSettings settings;
  settings.max_segments = 2;
  const Film film = test::render(*scene, pose, reference.width, reference.height, 1024, settings);
  test::Estimate rendering = estimate_of(film);
  double compared = double(rendering.mean.size());
  if (missing) {
    const std::vector<bool> out = left_out(scene, pose, film.width(), film.height(), wears);
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (!out[i]) continue;
      rendering.mean[i] = reference.mean[i];
      --compared;
    }
  }
  compared /= double(rendering.mean.size());
  const test::ZTestResult result = test::z_test(rendering, reference);
  std::printf("%s: %s, %.1f %% of the pixels compared\n", name.c_str(), result.to_string().c_str(), 100 * compared);
  EXPECT_TRUE(result.passed()) << result.to_string();
  EXPECT_GE(compared, GetParam().least_share);
}

INSTANTIATE_TEST_SUITE_P(Scenes, MitsubaData,
                         testing::Values(DataScene{"constant", 0.95}, DataScene{"arealight", 0.95},
                                         DataScene{"pointlight", 0.95}, DataScene{"roughdielectric", 1},
                                         DataScene{"textured_diffuse", 0.3}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace helio
