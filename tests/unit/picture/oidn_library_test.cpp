// Open Image Denoise as the display layer has it: libraries that are none, and with the library pictures whose truth is
// known.
#include "renderer/film/display/oidn_library.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/film/display/oidn_images.h"
#include "renderer/film/estimate/resolve.h"
#include "tests/support/oidn.h"
#include "tests/unit/picture/synthetic_film.h"

namespace helio::test {
namespace {

std::string refusal_of(const std::string& path) {
  const auto library = OidnLibrary::load(path, 1);
  return library ? "loaded" : library.error().to_string();
}

TEST(OidnLibrary, AMissingFileIsNamedWithWhatIsAllowed) {
  const auto missing = OidnLibrary::load("/nonexistent/libOpenImageDenoise.so.2", 1);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_EQ(missing.error().message,
            "'/nonexistent/libOpenImageDenoise.so.2' cannot be loaded (cannot open shared object file: No such file or "
            "directory); allowed: libOpenImageDenoise.so of Open Image Denoise 2.x, with its processor device");
  EXPECT_EQ(refusal_of(""),
            "'' cannot be loaded (the path is empty); allowed: libOpenImageDenoise.so of Open Image Denoise 2.x, with "
            "its processor device");
}

TEST(OidnLibrary, AnotherLibraryLacksASymbolThatIsNamed) {
  const auto other = OidnLibrary::load("libm.so.6", 1);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(other.error().message,
            "'libm.so.6' lacks the symbol oidnNewDevice; allowed: libOpenImageDenoise.so of Open Image Denoise 2.x, "
            "with its processor device");
}

TEST(OidnLibrary, LayersTakeTheirImagesAndTheLibrarysOwnMemory) {
  for (const std::size_t pixels : {std::size_t(1), std::size_t(640 * 360), std::size_t(1) << 26}) {
    EXPECT_EQ(DisplayLayer::bytes_by_oidn(pixels), 48 * pixels + OidnLibrary::scratch_bytes(pixels));
    EXPECT_GE(DisplayLayer::bytes_by_oidn(pixels), 64 * pixels);
  }
  // What the process grew by, as measured of 2.5.1.
  EXPECT_GT(OidnLibrary::scratch_bytes(640 * 360), 133u << 20);
  EXPECT_GT(OidnLibrary::scratch_bytes(1280 * 720), 510u << 20);
  EXPECT_GT(OidnLibrary::scratch_bytes(8192 * 8192), 1096u << 20);
}

TEST(OidnLibrary, OtherVersionsAndDevicesAreRefused) {
  const std::string allowed = "; allowed: libOpenImageDenoise.so of Open Image Denoise 2.x, with its processor device";
  const std::string quoted = std::string("'") + HELIO_FAKE_OIDN + "' ";
  {
    const FakeOidnDoes other("version=30102");
    EXPECT_EQ(refusal_of(HELIO_FAKE_OIDN), quoted + "is Open Image Denoise 3.1.2" + allowed);
  }
  {
    const FakeOidnDoes other("type=3");
    EXPECT_EQ(refusal_of(HELIO_FAKE_OIDN),
              quoted + "gives a device of type 3 where the processor's is asked for" + allowed);
  }
  EXPECT_EQ(refusal_of(HELIO_FAKE_OIDN_1),
            std::string("'") + HELIO_FAKE_OIDN_1 + "' is Open Image Denoise 1.4.3" + allowed);
  const auto library = OidnLibrary::load(HELIO_FAKE_OIDN, 1);
  ASSERT_TRUE(library) << library.error().to_string();
  EXPECT_EQ((*library)->version(), "2.5.1");
  EXPECT_EQ((*library)->path(), HELIO_FAKE_OIDN);
}

constexpr int kWidth = 150, kHeight = 70;

// A white floor in front of a blue wall, each lit unevenly, with exponential noise.
float truth(int x, int y, int c) {
  const float light = 0.5f + 0.4f * std::sin(float(x) * 0.04f) + float(y) * 0.01f;
  return y < 35 ? light * (c == 2 ? 0.6f : 0.2f) : 2 * light;
}

Film noisy_film(int samples_of_half, const PixelRect& region) {
  Film film(kWidth, kHeight);
  Random random(1);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = region.y0; y < region.y1; ++y) {
      for (int x = region.x0; x < region.x1; ++x) {
        for (int i = 0; i < samples_of_half; ++i) {
          const float noise = exponential(1, random);
          film.half(h, x, y).add(Rgb(truth(x, y, 0) * noise, truth(x, y, 1) * noise, truth(x, y, 2) * noise));
        }
      }
    }
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      PixelFeatures& f = film.features(x, y);
      f.count = f.hits = 1;
      f.depth = 1;
      f.normal[y < 35 ? 2 : 1] = 1;
      for (int c = 0; c < 3; ++c) f.albedo[c] = y < 35 && c < 2 ? 0.2f : 0.6f;
    }
  }
  return film;
}

void make(DisplayLayer& layer, const Film& film, const PixelRect& region, const CancelToken* cancel = nullptr) {
  layer.begin(region);
  for (int sweep = 0; sweep < layer.sweeps(); ++sweep) {
    const std::size_t parts = layer.parts();
    for (std::size_t i = 0; i < parts; ++i) layer.run(film, sweep, parts - 1 - i, cancel);
    layer.finish_sweep(sweep);
  }
}

ResolvedTile shown(const DisplayLayer& layer, const Film& film, const PixelRect& window) {
  ResolvedTile tile = resolve_tile(film, window, film.bounds(), kResolveAll);
  DisplayLayer::resolve(&layer, film, tile);
  return tile;
}

constexpr PixelRect kWhole{0, 0, kWidth, kHeight};

class FakeOidnLayer : public testing::Test {
 protected:
  std::shared_ptr<const OidnLibrary> library = OidnLibrary::load(HELIO_FAKE_OIDN, 1).value();
};

TEST_F(FakeOidnLayer, GetsTheMeanAndTheFeaturesOfTheRegion) {
  const PixelRect region{21, 3, 149, 69};
  Film film = noisy_film(2, region);
  film.half(0, 30, 10) = film.half(1, 30, 10) = HalfPixel();  // no samples
  film.half(1, 31, 10) = HalfPixel();                         // one half alone
  film.half(0, 32, 10).add(Rgb(-100.0f, -100.0f, -100.0f));
  film.features(33, 10).albedo[1] = 7;
  film.features(34, 10).normal[0] = std::numeric_limits<float>::quiet_NaN();
  DisplayLayer layer(kWidth, kHeight, library);
  make(layer, film, region);
  ASSERT_TRUE(layer.covers(region)) << layer.failure();
  EXPECT_FALSE(layer.covers(kWhole));
  const ResolvedTile tile = shown(layer, film, region);
  std::size_t i = 0;
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x, ++i) {
      const PixelFeatures& f = film.features(x, y);
      const bool samples = x != 30 || y != 10;
      for (int c = 0; c < 3; ++c) {
        const float albedo = std::min(f.albedo[c], 1.0f), normal = std::isnan(f.normal[c]) ? 0 : std::fabs(f.normal[c]);
        const float expected = samples ? std::max(tile.radiance[c][i], 0.0f) / 2 + albedo / 4 + normal / 8 : 0;
        ASSERT_EQ(tile.display[c][i], expected) << x << ' ' << y << ' ' << c;
        ASSERT_EQ(layer.shown(film, x, y, Rgb(9.0f, 9.0f, 9.0f))[c], expected);
      }
      ASSERT_EQ(tile.display_error[i], std::numeric_limits<float>::infinity());
    }
  }
}

TEST_F(FakeOidnLayer, AFailureShowsTheFilmUntilAnotherPicture) {
  const Film film = noisy_film(2, kWhole);
  DisplayLayer layer(kWidth, kHeight, library);
  make(layer, film, kWhole);
  EXPECT_TRUE(layer.known());
  {
    const FakeOidnDoes fail("fail");
    make(layer, film, kWhole);
  }
  EXPECT_FALSE(layer.known());
  EXPECT_EQ(layer.failure(), "Open Image Denoise: a failure by request");
  const ResolvedTile tile = shown(layer, film, kWhole);
  EXPECT_EQ(tile.display[2], tile.radiance[2]);
  layer.forget();
  EXPECT_EQ(layer.failure(), "");
  make(layer, film, kWhole);
  EXPECT_TRUE(layer.known());
}

TEST_F(FakeOidnLayer, ACancelIsNoFailure) {
  const Film film = noisy_film(2, kWhole);
  DisplayLayer layer(kWidth, kHeight, library);
  make(layer, film, kWhole);
  const FakeOidnDoes slow("slow");
  CancelToken raised;
  std::thread another([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    raised.cancel();
  });
  const double began = now_s();
  make(layer, film, kWhole, &raised);
  another.join();
  EXPECT_LT(now_s() - began, 5);
  EXPECT_FALSE(layer.known());  // half of the picture before is overwritten
  EXPECT_EQ(layer.failure(), "");
}

// With the library:

class OidnLayer : public testing::Test {
 protected:
  void SetUp() override {
    HELIO_NEEDS_OIDN();
    auto loaded = OidnLibrary::load(oidn_path(), 2);
    ASSERT_TRUE(loaded) << loaded.error().to_string();
    library = *loaded;
  }

  // Root mean squares of the radiance's error and of the display's.
  static std::pair<double, double> errors(const ResolvedTile& tile) {
    double raw = 0, display = 0;
    std::size_t i = 0;
    for (int y = tile.window.y0; y < tile.window.y1; ++y) {
      for (int x = tile.window.x0; x < tile.window.x1; ++x, ++i) {
        for (int c = 0; c < 3; ++c) {
          raw += std::pow(double(tile.radiance[c][i]) - truth(x, y, c), 2);
          display += std::pow(double(tile.display[c][i]) - truth(x, y, c), 2);
        }
      }
    }
    const double values = 3 * double(tile.window.area());
    return {std::sqrt(raw / values), std::sqrt(display / values)};
  }

  std::shared_ptr<const OidnLibrary> library;
};

TEST_F(OidnLayer, BringsANoisyFilmNearerToItsTruthAndTellsNoError) {
  EXPECT_EQ(library->version()[0], '2');
  for (const int samples : {1, 4, 16}) {
    const Film film = noisy_film(samples, kWhole);
    DisplayLayer layer(kWidth, kHeight, library);
    EXPECT_TRUE(layer.by_oidn());
    EXPECT_EQ(layer.bytes(), DisplayLayer::bytes_by_oidn(kWidth * kHeight));
    make(layer, film, kWhole);
    ASSERT_TRUE(layer.known()) << layer.failure();
    const ResolvedTile tile = shown(layer, film, kWhole);
    const auto [raw, display] = errors(tile);
    EXPECT_LT(display, 0.5 * raw) << samples;
    for (const float error : tile.display_error) ASSERT_EQ(error, std::numeric_limits<float>::infinity());
    // As previews have it.
    for (int c = 0; c < 3; ++c) EXPECT_EQ(layer.shown(film, 3, 5, Rgb(0.0f))[c], tile.display[c][5 * kWidth + 3]);
  }
}

TEST_F(OidnLayer, ARegionIsAPictureOfItsOwn) {
  const PixelRect region{21, 13, 140, 65};
  Film inside = noisy_film(4, region);
  DisplayLayer layer(kWidth, kHeight, library);
  make(layer, inside, region);
  ASSERT_TRUE(layer.covers(region)) << layer.failure();
  EXPECT_FALSE(layer.covers(kWhole));
  const ResolvedTile tile = shown(layer, inside, region);
  const auto [raw, display] = errors(tile);
  EXPECT_LT(display, 0.7 * raw);

  // What is beside it does not count.
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < 13; ++y) inside.half(h, 50, y).add(Rgb(1e6f, 1e6f, 1e6f));
  }
  DisplayLayer again(kWidth, kHeight, library);
  make(again, inside, region);
  EXPECT_EQ(shown(again, inside, region).display[1], tile.display[1]);
  // The layer of another region is another.
  make(layer, noisy_film(4, kWhole), kWhole);
  EXPECT_TRUE(layer.covers(kWhole));
}

TEST_F(OidnLayer, SamplesOutsideTheRangesOfTheNetworkAreTakenIn) {
  Film film = noisy_film(1, kWhole);
  for (int h = 0; h < kHalves; ++h) {
    film.half(h, 10, 10).add(Rgb(-5.0f, -5.0f, -5.0f));
    film.half(h, 20, 10).add(Rgb(3e38f, 3e38f, 3e38f));
  }
  film.features(30, 10).albedo[1] = 7;
  film.features(31, 10).normal[0] = std::numeric_limits<float>::quiet_NaN();
  DisplayLayer layer(kWidth, kHeight, library);
  make(layer, film, kWhole);
  ASSERT_TRUE(layer.known()) << layer.failure();
  const ResolvedTile tile = shown(layer, film, kWhole);
  for (const auto& plane : tile.display) {
    for (const float value : plane) ASSERT_TRUE(value >= 0 && std::isfinite(value)) << value;
  }
}

TEST_F(OidnLayer, ACancelEndsItEarlyAndTheFilmIsShown) {
  const PixelRect whole{0, 0, 600, 450};
  Film film(600, 450);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < 450; ++y) {
      for (int x = 0; x < 600; ++x) film.half(h, x, y).add(Rgb(0.5f, 0.25f, 0.125f));
    }
  }
  DisplayLayer layer(600, 450, library);
  const CancelToken never;
  double began = now_s();
  make(layer, film, whole, &never);
  const double whole_s = now_s() - began;
  EXPECT_TRUE(layer.known()) << layer.failure();
  CancelToken raised;
  std::thread another([&] {
    std::this_thread::sleep_for(std::chrono::duration<double>(0.1 * whole_s));
    raised.cancel();
  });
  began = now_s();
  make(layer, film, whole, &raised);
  const double cancelled_s = now_s() - began;
  another.join();
  EXPECT_LT(cancelled_s, 0.6 * whole_s);
  EXPECT_FALSE(layer.known());
  EXPECT_EQ(layer.failure(), "");  // it is made again
  const PixelRect window{0, 0, 64, 64};
  const ResolvedTile tile = shown(layer, film, window);
  EXPECT_EQ(tile.display[0], tile.radiance[0]);
  make(layer, film, whole, &never);
  EXPECT_TRUE(layer.known());
}

}  // namespace
}  // namespace helio::test
