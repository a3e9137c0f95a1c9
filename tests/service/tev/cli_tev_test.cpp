// heliograph render, move and view with --tev: what the viewer gets, and that the picture is the same whatever becomes
// of it.
#include <signal.h>

#include <algorithm>
#include <cmath>

#include "cli_test.h"
#include "daemon_process.h"
#include "renderer/base/clock.h"
#include "renderer/codec/tile_codec.h"
#include "tests/support/tev_receiver.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

using CliTev = CliTest;

constexpr std::uint64_t kMaxPixels = 1 << 20;
const std::string kBox = std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf";

// Whether an image shows what the file holds: radiance and samples bit for bit, the error as the root of the mean
// variance.
void expect_same(const TevReceivedImage& image, const std::string& file) {
  const auto picture = read_exr(file, kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  ASSERT_EQ(image.width, picture->header.data_window.width());
  ASSERT_EQ(image.height, picture->header.data_window.height());
  for (const char* name : {"R", "G", "B", "samples", "display.R", "display.G", "display.B"}) {
    const bool there = std::count(image.channels.begin(), image.channels.end(), name) > 0;
    ASSERT_EQ(there, picture->find(name) != nullptr) << name;
    if (there) {
      EXPECT_EQ(image.plane(name), *picture->find(name)) << name;
    }
  }
  const std::vector<float>& error = image.plane("error");
  const auto &r = *picture->find("variance.R"), &g = *picture->find("variance.G"), &b = *picture->find("variance.B");
  ASSERT_EQ(error.size(), r.size());
  for (std::size_t i = 0; i < r.size(); ++i)
    ASSERT_NEAR(error[i], std::sqrt((r[i] + g[i] + b[i]) / 3), 1e-6f * (1 + error[i])) << i;
}

// The image of that name, once it is whole: the borders are taken away in the end.
TevReceivedImage whole_image(TevReceiver& receiver, const std::string& name) {
  EXPECT_TRUE(receiver.wait_for([&](const auto& images) {
    const auto found = images.find(name);
    return found != images.end() && found->second.drawings > 0 && found->second.drawn.empty();
  })) << name;
  EXPECT_EQ(receiver.errors(), std::vector<std::string>{});
  return receiver.images()[name];
}

TEST_F(CliTev, RenderShowsThePixelsOfTheFile) {
  TevReceiver receiver;
  auto json = heliograph_json(
      {"render", kBox, "--size", "100x70", "--samples", "16", "--output", "a.exr", "--tev", receiver.address()});
  EXPECT_EQ(json["tev"]["address"], receiver.address());
  EXPECT_EQ(json["tev"]["warning"], nullptr);
  EXPECT_GE(json["tev"]["updates"], 1);
  const std::string first = json["tev"]["image"];
  EXPECT_EQ(first.rfind("cornell-box j-", 0), 0u) << first;
  const TevReceivedImage image = whole_image(receiver, first);
  EXPECT_EQ(image.channels, (std::vector<std::string>{"R", "G", "B", "error", "samples"}));
  EXPECT_TRUE(image.grabbed);
  expect_same(image, folder_ / "a.exr");

  // Another run beside it, with the layer display and compressed on its way.
  json = heliograph_json({"render", kBox, "--size", "100x70", "--samples", "4", "--output", "b.exr", "--png", "b.png",
                          "--compression", "zip", "--tev", receiver.address()});
  const std::string second = json["tev"]["image"];
  EXPECT_NE(first, second);
  expect_same(whole_image(receiver, second), folder_ / "b.exr");
  EXPECT_EQ(receiver.images().size(), 2u);
}

TEST_F(CliTev, ARegionLiesAtItsPlaceInTheFrame) {
  TevReceiver receiver(folder_ / "tev.sock");
  const auto json = heliograph_json({"render", kBox, "--size", "64x48", "--region", "20,10,50,40", "--samples", "2",
                                     "--output", "r.exr", "--tev", receiver.address()});
  const TevReceivedImage image = whole_image(receiver, json["tev"]["image"]);
  const auto picture = read_exr(folder_ / "r.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  ASSERT_EQ(image.width, 64);
  ASSERT_EQ(image.height, 48);
  const PixelRect region{20, 10, 50, 40};
  ASSERT_EQ(picture->header.data_window, region);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const float shown = image.plane("G")[std::size_t(y * 64 + x)];
      if (region.contains(x, y)) {
        ASSERT_EQ(shown, (*picture->find("G"))[std::size_t((y - 10) * 30 + x - 20)]) << x << ' ' << y;
      } else {
        ASSERT_TRUE(std::isnan(shown)) << x << ' ' << y;
      }
    }
  }
}

TEST_F(CliTev, MoveShowsTheNewestViewInOneImage) {
  TevReceiver receiver;
  auto json = heliograph_json({"move", kBox, "--size", "80x60", "--orbit", "10", "--steps", "2", "--samples", "4",
                               "--output", "m.exr", "--tev", receiver.address()});
  const std::string name = json["tev"]["image"];
  EXPECT_EQ(name.rfind("cornell-box s-", 0), 0u) << name;
  const TevReceivedImage image = whole_image(receiver, name);
  EXPECT_EQ(image.created, 1);
  expect_same(image, folder_ / "m.0002.exr");
  EXPECT_EQ(receiver.images().size(), 1u);

  json = heliograph_json({"move", kBox, "--size", "80x60", "--turn", "10", "--steps", "4", "--play", "20", "--samples",
                          "4", "--output", "p.exr", "--tev", receiver.address()});
  expect_same(whole_image(receiver, json["tev"]["image"]), folder_ / "p.0004.exr");
}

TEST_F(CliTev, ThePictureIsTheSameWithAViewerThatIsAbsent) {
  const std::vector<std::string> line = {"render", kBox, "--size", "64x64", "--samples", "16", "--output", "a.exr"};
  ASSERT_EQ(heliograph(line).exit_code, 0);
  auto with_tev = line;
  with_tev[7] = "b.exr";
  const std::string address = "127.0.0.1:" + std::to_string(TevReceiver().port());
  with_tev.insert(with_tev.end(), {"--tev", address});
  const double begun_s = now_s();
  const ProcessResult result = heliograph(with_tev);
  EXPECT_LT(now_s() - begun_s, 20 * kPatience);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "heliograph: warning: tev at " + address +
                " does not answer (Connection refused); rendering goes on, and tev is tried again every 5 s\n");
  EXPECT_NE(result.out.find("b.exr: 64x64, 16 samples"), std::string::npos) << result.out;
  EXPECT_EQ(read_exr(folder_ / "a.exr", kMaxPixels)->channels, read_exr(folder_ / "b.exr", kMaxPixels)->channels);

  with_tev.push_back("--json");
  const ProcessResult told = heliograph(with_tev);
  EXPECT_EQ(told.err, "");
  const auto json = nlohmann::json::parse(told.out);
  EXPECT_NE(json["tev"]["warning"].get<std::string>().find("does not answer"), std::string::npos);
  EXPECT_EQ(json["tev"]["updates"], 0);
}

TEST_F(CliTev, AViewerThatGoesInTheMiddleChangesNothing) {
  TevReceiver receiver;
  Process render(HELIOGRAPH_PROGRAM,
                 {"render", kBox, "--size", "320x240", "--time", "3", "--output", "a.exr", "--tev", receiver.address()},
                 folder_.path());
  ASSERT_TRUE(
      receiver.wait_for([](const auto& images) { return !images.empty() && images.begin()->second.updates > 3; }));
  receiver.stop();
  const ProcessResult result = render.wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_EQ(result.err.rfind("heliograph: warning: tev at " + receiver.address(), 0), 0u) << result.err;
  const auto picture = read_exr(folder_ / "a.exr", kMaxPixels);
  ASSERT_TRUE(picture);
  EXPECT_GT(picture->find("samples")->front(), 0);
}

TEST_F(CliTev, AViewerThatReadsNothingDelaysTheEndByTwoSecondsAtMost) {
  TevReceiver receiver(0, 1 << 16);
  receiver.read(false);
  // 20 MB a picture, which no connection takes without a reader.
  const std::vector<std::string> line = {
      "render", folder_ / "quad.gltf", "--size", "1200x900", "--samples", "2", "--output", "a.exr"};
  double begun_s = now_s();
  ASSERT_EQ(heliograph(line).exit_code, 0);
  const double without_s = now_s() - begun_s;
  auto with_tev = line;
  with_tev.insert(with_tev.end(), {"--tev", receiver.address()});
  begun_s = now_s();
  const ProcessResult result = heliograph(with_tev);
  EXPECT_LT(now_s() - begun_s, without_s + 2 + 3 * kPatience);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find("it lacks the last state of the picture"), std::string::npos) << result.err;
}

TEST_F(CliTev, AViewerThatComesLaterIsFound) {
  HELIO_FULL_TIER_ONLY();  // a try every five seconds
  const int port = TevReceiver().port();
  Process render(HELIOGRAPH_PROGRAM,
                 {"render", kBox, "--size", "64x64", "--time", "12", "--output", "a.exr", "--tev",
                  "127.0.0.1:" + std::to_string(port)},
                 folder_.path());
  ASSERT_TRUE(render.wait_for_errors("does not answer"));
  TevReceiver receiver(port);
  EXPECT_TRUE(
      receiver.wait_for([](const auto& images) { return !images.empty() && images.begin()->second.updates > 0; }, 7));
  const ProcessResult result = render.wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  ASSERT_EQ(receiver.images().size(), 1u);
  expect_same(whole_image(receiver, receiver.images().begin()->first), folder_ / "a.exr");
}

TEST_F(CliTev, ViewRendersTheScenesCameraBesideThePage) {
  TevReceiver receiver;
  {
    Process view(HELIOGRAPH_PROGRAM,
                 {"view", folder_ / "quad.gltf", "--http", "127.0.0.1:0", "--no-browser", "--tev", receiver.address()},
                 folder_.path());
    ASSERT_TRUE(view.wait_for_output("Ctrl-C ends")) << view.errors();
    ASSERT_TRUE(view.wait_for_output("notice: tev at " + receiver.address() + " shows the scene's camera 'front'"));
    // The middle of the square, which emits 2.
    ASSERT_TRUE(receiver.wait_for([](const auto& images) {
      if (images.empty()) return false;
      const TevReceivedImage& image = images.begin()->second;
      return image.plane("R")[std::size_t(image.width * (image.height / 2) + image.width / 2)] == 2;
    }));
    const std::string name = receiver.images().begin()->first;
    EXPECT_EQ(name.rfind("quad j-", 0), 0u) << name;
    view.send_signal(SIGINT);
    EXPECT_EQ(view.wait().exit_code, 0);
    EXPECT_EQ(view.errors(), "");
  }
  // By a daemon; an absent viewer is no reason to fail.
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--http", "127.0.0.1:0"});
  Process view(HELIOGRAPH_PROGRAM,
               {"view", folder_ / "quad.gltf", "--server", daemon.address(), "--no-browser", "--tev",
                "127.0.0.1:" + std::to_string(TevReceiver().port())},
               folder_.path());
  ASSERT_TRUE(view.wait_for_errors("does not answer"));
  view.send_signal(SIGINT);
  const ProcessResult absent = view.wait();
  EXPECT_EQ(absent.exit_code, 0) << absent.err;
  EXPECT_EQ(std::count(absent.err.begin(), absent.err.end(), '\n'), 1) << absent.err;
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(CliTev, AddressesOfAnotherFormAreRefusedBeforeAnythingIsRendered) {
  ProcessResult result = heliograph({"render", "quad.gltf", "--tev", "nowhere", "--samples", "-1"});
  EXPECT_EQ(result.exit_code, 2);
  expect_one_line(result.err);
  EXPECT_NE(result.err.find("--tev: 'nowhere' is not HOST:PORT with a port in [1, 65535], such as 127.0.0.1:14158"),
            std::string::npos)
      << result.err;
  EXPECT_NE(result.err.find("--samples"), std::string::npos) << result.err;
  result = heliograph({"move", "quad.gltf", "--turn", "5", "--tev", "no-such-host.invalid:14158"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("--tev: the host of 'no-such-host.invalid:14158' cannot be found"), std::string::npos)
      << result.err;
  // The scene is taken for the address: the message says so.
  result = heliograph({"render", "--tev", "quad.gltf"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("a FILE stands before --tev, or after its address"), std::string::npos) << result.err;
  EXPECT_FALSE(exists("quad.exr"));
  // Without an address it is tev's own.
  result = heliograph({"render", "quad.gltf", "--size", "8x8", "--samples", "1", "--tev", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out)["tev"]["address"], "127.0.0.1:14158");
}

}  // namespace
}  // namespace helio::test
