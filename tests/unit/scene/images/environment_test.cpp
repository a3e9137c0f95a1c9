// The environment's geometry and parsing, and the exactness of its importance sampling.
#include "renderer/scene/images/environment.h"

#include <gtest/gtest.h>
#include <half.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "renderer/scene/load/scene_loader.h"
#include "tests/support/chi_square.h"
#include "tests/support/random.h"
#include "tests/unit/scene/images/image_encode.h"

namespace helio {
namespace {

using test::Random;

Image float_map(int width, int height, int channels, const std::vector<float>& texels) {
  Image image;
  image.name = "map";
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.format = TexelFormat::f32;
  image.texels.resize(texels.size() * sizeof(float));
  if (!texels.empty()) std::memcpy(image.texels.data(), texels.data(), image.texels.size());
  return image;
}

// An environment with everything that it refers to kept alive.
struct Sky {
  std::vector<Image> images;
  std::unique_ptr<TextureTable> textures;
  Environment environment;
  std::unique_ptr<EnvironmentMap> map;
  std::unique_ptr<EnvironmentDistribution> distribution;

  Sky(Image image, const M44d& to_world = M44d()) {
    images.push_back(std::move(image));
    textures = std::make_unique<TextureTable>(images);
    environment.image = 0;
    environment.to_world = to_world;
    map = std::make_unique<EnvironmentMap>(environment, textures.get());
    distribution = std::make_unique<EnvironmentDistribution>(*map);
  }
};

M44d some_rotation() {
  M44d m;
  m.setEulerAngles(Imath::V3d(0.3, 1.1, -0.7));
  return m;
}

Image random_map(int width, int height, double share_black, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> texels(std::size_t(width) * height * 3);
  for (std::size_t i = 0; i < texels.size(); i += 3) {
    const bool black = random.next_double() < share_black;
    for (int c = 0; c < 3; ++c) texels[i + std::size_t(c)] = black ? 0.0f : random.next_float();
  }
  return float_map(width, height, 3, texels);
}

// A sky of constant radiance with one texel of 1e5.
Image sun_map(int width, int height, int x, int y, float sky = 1) {
  std::vector<float> texels(std::size_t(width) * height, sky);
  texels[std::size_t(y) * width + x] = 1e5f;
  return float_map(width, height, 1, texels);
}

V3f random_direction(Random& random) {
  const float z = 1 - 2 * random.next_float(), phi = kTwoPi * random.next_float();
  const float r = safe_sqrt(1 - z * z);
  return normalize(V3f(r * std::cos(phi), z, r * std::sin(phi)));
}

void expect_near(const V3f& a, const V3f& b, float tolerance) {
  EXPECT_LT(length(a - b), tolerance) << a << " " << b;
}

TEST(Environment, FollowsTheDocumentedConvention) {
  // Mitsuba's envmap: left edge -z, a quarter +x, the centre +z, three quarters -x; the top row is up.
  expect_near(environment_direction({0.0f, 0.5f}), {0, 0, -1}, 1e-6f);
  expect_near(environment_direction({0.25f, 0.5f}), {1, 0, 0}, 1e-6f);
  expect_near(environment_direction({0.5f, 0.5f}), {0, 0, 1}, 1e-6f);
  expect_near(environment_direction({0.75f, 0.5f}), {-1, 0, 0}, 1e-6f);
  expect_near(environment_direction({0.1f, 0.0f}), {0, 1, 0}, 1e-6f);
  expect_near(environment_direction({0.1f, 1.0f}), {0, -1, 0}, 1e-6f);
  Random random(3);
  for (int i = 0; i < 10000; ++i) {
    const V3f direction = random_direction(random);
    const V2f uv = environment_uv(direction);
    EXPECT_TRUE(uv.x >= 0 && uv.x < 1 && uv.y >= 0 && uv.y < 1);
    expect_near(environment_direction(uv), direction, 2e-6f);
  }
  for (const V3f& axis : {V3f(0, 1, 0), V3f(0, -1, 0), V3f(0, 0, -1), V3f(-0.0f, 0, -1), V3f(-1e-30f, 0, -1)}) {
    const V2f uv = environment_uv(axis);
    EXPECT_TRUE(uv.x >= 0 && uv.x < 1 && uv.y >= 0 && uv.y < 1) << axis;
  }
}

TEST(Environment, MapAndRotationMeetTheDirection) {
  // Four columns of one row each with its own value; texel centres at u = 1/8, 3/8, 5/8, 7/8.
  const Sky sky(float_map(4, 1, 1, {1, 2, 3, 4}));
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(sky.map->radiance(environment_direction({(i + 0.5f) / 4, 0.5f})).x, i + 1, 1e-5f);
  }
  EXPECT_NEAR(sky.map->radiance({0, 0, -1}).x, 2.5f, 1e-5f);  // between columns 3 and 0
  // A quarter turn about y takes map -z to world -x (row vectors: p' = p M).
  M44d turn;
  turn.setEulerAngles(Imath::V3d(0, M_PI / 2, 0));
  const V3d moved = V3d(0, 0, -1) * turn;
  const Sky turned(float_map(4, 1, 1, {1, 2, 3, 4}), turn);
  EXPECT_NEAR(turned.map->radiance(V3f(moved)).x, 2.5f, 1e-5f);
  EXPECT_NEAR(turned.map->radiance(V3f(V3d(1, 0, 0) * turn)).x, sky.map->radiance({1, 0, 0}).x, 1e-5f);
}

TEST(Environment, ScaleMultipliesAndIntegerMapsAreSrgb) {
  std::vector<Image> images = {float_map(1, 1, 3, {1, 2, 3}), {}};
  images[1].width = images[1].height = images[1].channels = 1;
  images[1].texels = {128};
  const TextureTable textures(images);
  Environment environment;
  environment.image = 0;
  environment.radiance = Rgb(2, 0.5f, 10);
  EXPECT_EQ(EnvironmentMap(environment, &textures).radiance({0, 1, 0}), Rgb(2, 1, 30));
  environment.image = 1;
  environment.radiance = Rgb(1, 1, 1);
  EXPECT_NEAR(EnvironmentMap(environment, &textures).radiance({0, 1, 0}).x, srgb_to_linear(128 / 255.0f), 1e-6f);
  environment.image = -1;
  environment.radiance = Rgb(7, 8, 9);
  EXPECT_EQ(EnvironmentMap(environment, nullptr).radiance({1, 0, 0}), Rgb(7, 8, 9));
}

TEST(Environment, ParsesColours) {
  std::vector<Image> images;
  const Result<Environment> e = parse_environment(" 0.4, 0,6e2 ", nullptr, 0, images);
  ASSERT_TRUE(e.ok()) << e.error().to_string();
  EXPECT_EQ(e->radiance, Rgb(0.4f, 0, 600));
  EXPECT_LT(e->image, 0);
  EXPECT_TRUE(images.empty());
  const Result<Environment> limits = parse_environment("3.4e38,1e-50,1e-400", nullptr, 0, images);
  ASSERT_TRUE(limits.ok()) << limits.error().to_string();
  EXPECT_EQ(limits->radiance, Rgb(3.4e38f, 0, 0));
  for (const char* text : {"", "  ", "1,2", "1,2,3,4", "1,2,-3", "nan,1,1", "1,inf,1", "5", "1e39,1,1", "1,1,1e400"}) {
    const Result<Environment> bad = parse_environment(text, nullptr, 0, images);
    ASSERT_FALSE(bad.ok()) << text;
    EXPECT_EQ(bad.error().code, ErrorCode::invalid_argument) << text;
    EXPECT_EQ(bad.error().where, "environment");
    EXPECT_NE(bad.error().message.find("allowed"), std::string::npos) << bad.error().message;
  }
}

// A file source of one file, so that this test needs no disk.
class OneFile : public FileSource {
 public:
  OneFile(std::string name, std::vector<std::uint8_t> bytes) : name_(std::move(name)), bytes_(std::move(bytes)) {}
  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    if (path != name_) return Error{ErrorCode::not_found, "no such file", std::string(path)};
    if (bytes_.size() > max_bytes) return Error{ErrorCode::resource_exhausted, "too large", name_};
    return bytes_;
  }

 private:
  std::string name_;
  std::vector<std::uint8_t> bytes_;
};

TEST(Environment, ReadsMapsAndRefusesBadTexels) {
  const OIIO::ImageSpec spec(2, 1, 3, OIIO::TypeDesc::FLOAT);
  const std::vector<float> good = {1, 2, 3, -4, 5, 6};
  std::vector<Image> images(3);
  const OneFile source("sky.exr", test::encode_image("openexr", spec, good.data()));
  const Result<Environment> e = parse_environment("sky.exr", &source, 1 << 20, images);
  ASSERT_TRUE(e.ok()) << e.error().to_string();
  EXPECT_EQ(e->image, 3);
  ASSERT_EQ(images.size(), 4u);
  const TextureTable textures(std::span<const Image>(images).subspan(3));
  EXPECT_EQ(textures.texel(0, TexelEncoding::linear, 1, 0), V4f(0, 5, 6, 1));  // negative counts as 0

  const std::vector<float> bad = {1, 2, 3, 4, std::numeric_limits<float>::infinity(), 6};
  const OneFile broken("sky.exr", test::encode_image("openexr", spec, bad.data()));
  const Result<Environment> refused = parse_environment("sky.exr", &broken, 1 << 20, images);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().where, "sky.exr");
  EXPECT_NE(refused.error().message.find("(1, 0) channel 1 is inf"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("clamp the map"), std::string::npos) << refused.error().message;

  EXPECT_EQ(parse_environment("other.exr", &source, 1 << 20, images).error().code, ErrorCode::not_found);
  EXPECT_EQ(parse_environment("sky.exr", &source, 10, images).error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(parse_environment("sky.exr", nullptr, 1 << 20, images).error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(images.size(), 4u);
}

// A sun that half floats cannot hold, and texels that are no numbers: the message says what to do.
TEST(Environment, TexelsThatAreNotFiniteComeWithARemedy) {
  Image sun = float_map(2, 2, 1, {});
  sun.format = TexelFormat::f16;
  const half texels[4] = {half(1), half(2), half(3), half(1e6f)};
  sun.texels.resize(sizeof(texels));
  std::memcpy(sun.texels.data(), texels, sizeof(texels));
  const Status bright = prepare_environment_image(sun);
  ASSERT_FALSE(bright.ok());
  for (const char* part : {"texel (1, 1) channel 0 is inf", "65504", "32 bit float", "clamp"}) {
    EXPECT_NE(bright.error().message.find(part), std::string::npos) << bright.error().message;
  }
  Image broken = float_map(1, 1, 1, {std::numeric_limits<float>::quiet_NaN()});
  const Status no_number = prepare_environment_image(broken);
  ASSERT_FALSE(no_number.ok());
  EXPECT_NE(no_number.error().message.find("--fixnan"), std::string::npos) << no_number.error().message;
}

// Expected counts per cell from the density at cell centres, observed ones from samples; cells of the distribution's
// own grid or unions of them, so that the density is constant in each and the expectation exact.
test::ChiSquareResult chi_square_on_cells(const Sky& sky, int samples, int group, double& mass) {
  const EnvironmentDistribution& d = *sky.distribution;
  const int columns = d.columns() / group, rows = d.rows() / group;
  std::vector<double> observed(std::size_t(columns) * rows + 1, 0.0), expected(observed.size(), 0.0);
  mass = 0;
  for (int row = 0; row < d.rows(); ++row) {
    const double solid_angle =
        2 * M_PI / d.columns() * (std::cos(M_PI * row / d.rows()) - std::cos(M_PI * (row + 1) / d.rows()));
    for (int column = 0; column < d.columns(); ++column) {
      const V2f uv((column + 0.5f) / d.columns(), (row + 0.5f) / d.rows());
      const double p = d.pdf_w(sky.map->to_world(environment_direction(uv))) * solid_angle;
      mass += p;
      expected[std::size_t(row / group) * columns + column / group] += p * samples;
    }
  }
  Random random(77);
  for (int i = 0; i < samples; ++i) {
    const EnvironmentSample s = d.sample(random.next_v2f());
    EXPECT_EQ(s.pdf_w, d.pdf_w(s.direction));
    EXPECT_NEAR(length(s.direction), 1, 1e-6);
    if (s.pdf_w == 0) {
      observed.back() += 1;
      continue;
    }
    const V2f uv = environment_uv(sky.map->to_map(s.direction));
    const int column = int(uv.x * d.columns()) / group, row = int(uv.y * d.rows()) / group;
    observed[std::size_t(row) * columns + column] += 1;
  }
  EXPECT_LT(observed.back(), samples * 1e-5);  // rounding at the edge of darkness
  observed.pop_back();
  expected.pop_back();
  return test::chi_square_test(observed, expected);
}

// Ringing of a resampled map that nobody prepared: texels below 0 count as 0.
std::vector<float> with_negative() {
  std::vector<float> texels(32, 1.0f);
  texels[5] = -99;
  texels[17] = -3;
  return texels;
}

TEST(EnvironmentDistribution, SamplesFollowTheDensityThatTheyClaim) {
  struct Case {
    const char* name;
    Sky sky;
    int group;
  };
  Case cases[] = {{"noise", Sky(random_map(16, 8, 0, 1)), 1},
                  {"sparse, rotated", Sky(random_map(32, 16, 0.9, 2), some_rotation()), 1},
                  {"sun", Sky(sun_map(128, 64, 40, 12), some_rotation()), 4},
                  {"sun at the pole", Sky(sun_map(64, 32, 5, 0)), 2},
                  {"negative texels", Sky(float_map(8, 4, 1, with_negative())), 1},
                  {"black", Sky(float_map(8, 4, 1, std::vector<float>(32, 0.0f))), 1}};
  for (const Case& c : cases) {
    double mass = 0;
    const test::ChiSquareResult result = chi_square_on_cells(c.sky, 1000000, c.group, mass);
    EXPECT_TRUE(result.passes(test::kSignificance, 6)) << c.name << ": " << result.summary();
    EXPECT_NEAR(mass, 1, 1e-5) << c.name;
  }
}

TEST(EnvironmentDistribution, DensityIsPositiveWhereverLightComesFrom) {
  const Sky skies[] = {Sky(random_map(64, 32, 0.97, 4)), Sky(random_map(7, 5, 0.8, 5), some_rotation()),
                       Sky(sun_map(33, 17, 0, 16))};
  Random random(8);
  for (const Sky& sky : skies) {
    int lit = 0, bare = 0;
    for (int i = 0; i < 300000; ++i) {
      const V3f direction = random_direction(random);
      const float light = luminance(sky.map->radiance(direction));
      if (light <= 0) continue;
      ++lit;
      // Rounding may call a direction on the very edge of a lit texel lit, or its cell dark: there the light is a
      // vanishing fraction of a texel's.
      if (sky.distribution->pdf_w(direction) <= 0) {
        ++bare;
        EXPECT_LT(light, 1e-4f);
      }
    }
    EXPECT_GT(lit, 5000);
    EXPECT_LT(bare, 10);
  }
}

// The point of it all: radiance over density varies little, so the estimate of the integral is good.
void expect_good_estimate(const Sky& sky, double relative_deviation) {
  Random random(9);
  double sum = 0, square = 0;
  constexpr int kSamples = 200000;
  for (int i = 0; i < kSamples; ++i) {
    const EnvironmentSample s = sky.distribution->sample(random.next_v2f());
    if (s.pdf_w == 0) continue;
    const double value = luminance(sky.map->radiance(s.direction)) / s.pdf_w;
    sum += value;
    square += value * value;
  }
  const double mean = sum / kSamples, deviation = std::sqrt(square / kSamples - mean * mean);
  EXPECT_LT(deviation / mean, relative_deviation);
  // The table's total treats radiance and solid angle as independent within a cell: 1e-3 allows for that.
  EXPECT_NEAR(mean / sky.distribution->total_luminance(), 1, 5 * deviation / mean / std::sqrt(kSamples) + 1e-3);
}

TEST(EnvironmentDistribution, EstimatesAreGood) {
  expect_good_estimate(Sky(random_map(64, 32, 0, 6)), 0.2);
  // One texel of half a degree at 1e5 over a sky of 1, which gives most of the light here; and over a sky of nothing.
  // Along one axis the tent of a bilinear texel covers four cells with means 1/4, 3/4, 3/4, 1/4 and mean squares 1/12,
  // 7/12, ...; sampling by the means gives E[(f/p)^2] / E[f/p]^2 = 1/4 (16/12) + 3/4 (16 7 / (9 12)) = 10/9, on both
  // axes 100/81: a relative deviation of sqrt(19/81) = 0.484.
  expect_good_estimate(Sky(sun_map(720, 360, 200, 90, 1.0f)), 0.35);
  expect_good_estimate(Sky(sun_map(720, 360, 200, 90, 0.0f)), 0.484 * 1.02);
}

TEST(EnvironmentDistribution, LargeMapsStayWithinTheirMemory) {
  const int width = 8192, height = 4096;
  Image image;
  image.name = "8k";
  image.width = width;
  image.height = height;
  image.channels = 1;
  image.texels.assign(std::size_t(width) * height, 60);
  // A sun of half a degree: 11 texels across.
  for (int y = 1000; y < 1011; ++y) {
    for (int x = 3000; x < 3011; ++x) image.texels[std::size_t(y) * width + x] = 255;
  }
  const Sky sky(std::move(image));
  EXPECT_LE(sky.distribution->memory_bytes(), 4 * EnvironmentDistribution::kMaxCells * 101 / 100);
  EXPECT_EQ(sky.distribution->columns(), 4096);
  EXPECT_EQ(sky.distribution->rows(), 2048);
  expect_good_estimate(sky, 0.1);
}

TEST(EnvironmentDistribution, TotalOfAConstantSkyIsFourPi) {
  Environment environment;
  environment.radiance = Rgb(2, 2, 2);
  const EnvironmentDistribution d{EnvironmentMap(environment, nullptr)};
  EXPECT_NEAR(d.total_luminance(), 8 * M_PI, 1e-5);
  Random random(10);
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(d.pdf_w(random_direction(random)), 1 / (4 * M_PI), 1e-7);
}

}  // namespace
}  // namespace helio
