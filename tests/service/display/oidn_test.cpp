// The layer display by Open Image Denoise, from the flag to the tiles: with a fake of the library, and with the real
// one where HELIOGRAPH_OIDN names it.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>

#include "renderer/codec/tile_codec.h"
#include "server/base/server_config.h"
#include "server/stream/convert.h"
#include "tests/service/cli_test.h"
#include "tests/support/oidn.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

// HELIOGRAPH_OIDN as these tests want it, whatever the machine has.
class Variable {
 public:
  explicit Variable(const char* value) {
    if (const char* text = std::getenv("HELIOGRAPH_OIDN")) before_ = text;
    if (value) {
      setenv("HELIOGRAPH_OIDN", value, 1);
    } else {
      unsetenv("HELIOGRAPH_OIDN");
    }
  }
  ~Variable() {
    if (before_) {
      setenv("HELIOGRAPH_OIDN", before_->c_str(), 1);
    } else {
      unsetenv("HELIOGRAPH_OIDN");
    }
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  std::optional<std::string> before_;
};

TEST(OidnFormat, IsRefusedWithoutTheLibraryOrTheLayer) {
  const auto problems_of = [](int denoiser, bool display, bool has_oidn) {
    pb::TileFormat message;
    message.set_display_denoiser(pb::Denoiser(denoiser));
    message.set_display(display);
    Problems problems;
    const TileFormat format = read_tile_format(message, "format", problems, has_oidn);
    if (problems.empty()) {
      EXPECT_EQ(format.channels & kDisplayByOidn, denoiser == 1 ? unsigned(kDisplayByOidn) : 0u);
      return std::string();
    }
    return problems.to_error().message;
  };
  EXPECT_EQ(problems_of(0, false, false), "");
  EXPECT_EQ(problems_of(0, true, true), "");
  EXPECT_EQ(problems_of(1, true, true), "");
  EXPECT_EQ(problems_of(1, true, false),
            "format.display_denoiser: DENOISER_OIDN (1), but this daemon has no Open Image Denoise, which its operator "
            "provides by --oidn-library or HELIOGRAPH_OIDN; allowed: DENOISER_UNSPECIFIED (0), its own filter");
  EXPECT_EQ(problems_of(1, false, true),
            "format.display_denoiser: DENOISER_OIDN (1) without display; allowed: beside display alone");
  const std::string unknown = problems_of(2, true, true);
  EXPECT_EQ(unknown,
            "format.display_denoiser: unknown value 2; allowed: DENOISER_OIDN (1), or 0 for DENOISER_UNSPECIFIED");
}

TEST(OidnConfig, IsAFlagAndAVariableOfItsOwnName) {
  const Variable variable("/from/the/environment.so");
  auto request = parse_server_config("heliographd", {});
  ASSERT_TRUE(request) << request.error().to_string();
  EXPECT_EQ(request->config.oidn_library, "/from/the/environment.so");
  request = parse_server_config("heliographd", {"--oidn-library", "flag.so"});
  EXPECT_EQ(request->config.oidn_library, "flag.so");
  request = parse_server_config("heliographd", {"--help"});
  EXPECT_NE(request->print.find("HELIOGRAPH_OIDN"), std::string::npos);
  EXPECT_NE(example_config().find("\n#oidn-library =\n"), std::string::npos);
}

class OidnService : public ServiceTest {
 protected:
  void start_with(const std::string& library) {
    start([&](ServerConfig& config) { config.oidn_library = library; });
    scene_ = load_quad();
  }
  static pb::StreamRequest open(const std::string& session, pb::Denoiser denoiser) {
    pb::StreamRequest open;
    open.mutable_open()->set_session_id(session);
    pb::TileFormat& format = *open.mutable_open()->mutable_format();
    format.set_pixel_type(pb::PIXEL_TYPE_FLOAT);
    format.set_compression(pb::COMPRESSION_NONE);
    format.set_display(true);
    format.set_display_denoiser(denoiser);
    return open;
  }
  // Planes of the last tile, which is the whole picture.
  static std::map<std::string, std::vector<float>> last_tile(const std::vector<pb::StreamResponse>& messages) {
    std::map<std::string, std::vector<float>> planes;
    for (const auto& message : messages) {
      if (!message.has_tile()) continue;
      const std::string& exr = message.tile().exr();
      const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(exr.data()), exr.size()}, 1 << 20);
      EXPECT_TRUE(tile) << tile.error().to_string();
      for (const std::string& name : tile->names) planes[name] = *tile->find(name);
    }
    return planes;
  }
  // One picture of the session by each denoiser in turn, attached anew; fewer where a frame does not end.
  std::vector<std::map<std::string, std::vector<float>>> pictures_by(const std::vector<pb::Denoiser>& denoisers,
                                                                     const std::string& session) {
    std::vector<std::map<std::string, std::vector<float>>> pictures;
    for (const pb::Denoiser denoiser : denoisers) {
      StreamClient client(stub());
      client.send(open(session, denoiser));
      client.start_reading();
      if (pictures.empty()) client.send(view(1));
      if (!client.reader().wait_for_frame_end(1)) break;
      pictures.push_back(last_tile(client.reader().messages()));
      client.cancel();
    }
    return pictures;
  }

  std::string scene_;
};

TEST_F(OidnService, WithoutTheLibrarySessionsAndJobsAreRefused) {
  start();
  scene_ = load_quad();
  const std::vector<std::string> parts = {"format.display_denoiser", "no Open Image Denoise", "--oidn-library",
                                          "HELIOGRAPH_OIDN"};
  StreamClient client(stub());
  client.send(open(create_session(scene_, 16, 16, 2), pb::DENOISER_OIDN));
  client.start_reading();
  expect_status(client.status(), StatusCode::INVALID_ARGUMENT, parts);

  pb::RunJobRequest job;
  job.set_scene_id(scene_);
  job.mutable_budget()->set_samples(1);
  *job.mutable_format() = open("", pb::DENOISER_OIDN).open().format();
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, job);
  pb::RunJobResponse response;
  EXPECT_FALSE(reader->Read(&response));
  expect_status(reader->Finish(), StatusCode::INVALID_ARGUMENT, parts);
}

TEST_F(OidnService, ALibraryThatCannotBeUsedEndsTheStart) {
  ServerConfig config;
  config.listen.clear();
  config.oidn_library = "libm.so.6";
  const auto server = Server::start(config);
  ASSERT_FALSE(server);
  EXPECT_EQ(server.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(server.error().to_string().rfind("oidn-library: 'libm.so.6' lacks the symbol oidnNewDevice; allowed: ", 0),
            0u)
      << server.error().to_string();
}

TEST_F(OidnService, ASessionChangesItsDenoiserByAttachingAgain) {
  start_with(HELIO_FAKE_OIDN);
  const std::string session = create_session(scene_, 48, 48, 8);
  const auto pictures = pictures_by({pb::DENOISER_UNSPECIFIED, pb::DENOISER_OIDN, pb::DENOISER_UNSPECIFIED}, session);
  ASSERT_EQ(pictures.size(), 3u);
  const auto& by_oidn = pictures[1];
  EXPECT_EQ(pictures[0].at("R"), by_oidn.at("R"));  // the film is kept
  EXPECT_EQ(pictures[0].at("display.R"), pictures[2].at("display.R"));
  EXPECT_EQ(pictures[0].at("display.error"), pictures[2].at("display.error"));
  EXPECT_NE(pictures[0].at("display.R"), by_oidn.at("display.R"));
  for (const float error : by_oidn.at("display.error")) ASSERT_TRUE(std::isinf(error));
  // The lamp in the middle: radiance 1, faces the camera.
  const std::size_t middle = 24 * 48 + 24;
  EXPECT_GE(by_oidn.at("display.R")[middle], 0.5f);
  EXPECT_EQ(by_oidn.at("display.R")[0], 0);
}

TEST_F(OidnService, TheLayersMemoryIsRefusedBeyondTheLimit) {
  // The library's own memory is more than the limit, the layer of our own filter is not.
  start([&](ServerConfig& config) {
    config.oidn_library = HELIO_FAKE_OIDN;
    config.max_memory = 60u << 20;
  });
  scene_ = load_quad();
  const std::string session = create_session(scene_, 256, 256, 2);
  StreamClient client(stub());
  client.send(open(session, pb::DENOISER_OIDN));
  client.start_reading();
  client.send(view(1));
  client.half_close();
  expect_status(client.status(), StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "the layer display of 256 x 256"});
  StreamClient own(stub());
  own.send(open(session, pb::DENOISER_UNSPECIFIED));
  own.start_reading();
  own.send(view(2));
  EXPECT_TRUE(own.reader().wait_for_frame_end(2));
}

class OidnCli : public CliTest {
 protected:
  void expect_usage(const std::vector<std::string>& arguments, const std::string& part) {
    const ProcessResult result = heliograph(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    expect_one_line(result.err);
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  }
  std::vector<std::string> render(const std::vector<std::string>& more) const {
    std::vector<std::string> line = {
        "render",    std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf",
        "--size",    "64x64",
        "--samples", "4",
        "--output",  "q.exr"};
    line.insert(line.end(), more.begin(), more.end());
    return line;
  }
  std::map<std::string, std::vector<float>> exr(const std::string& name) {
    const std::string bytes = read_file(folder_ / name);
    const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
    EXPECT_TRUE(tile) << tile.error().to_string();
    std::map<std::string, std::vector<float>> planes;
    for (const std::string& plane : tile->names) planes[plane] = *tile->find(plane);
    return planes;
  }

  Variable none_{nullptr};
};

TEST_F(OidnCli, SaysWhatTheDenoiserNeeds) {
  expect_usage(render({"--denoiser", "oidn", "--png", "q.png"}),
               "--denoiser: 'oidn' needs Open Image Denoise, whose libOpenImageDenoise.so --oidn-library or "
               "HELIOGRAPH_OIDN has to name");
  expect_usage(render({"--denoiser", "oidn", "--oidn-library", HELIO_FAKE_OIDN}),
               "--denoiser: 'oidn' makes the layer display, for which --png or --layers display has to ask");
  expect_usage(render({"--denoiser", "oidn", "--oidn-library", HELIO_FAKE_OIDN, "--png", "q.png", "--raw"}),
               "--denoiser: 'oidn' makes the layer display");
  expect_usage(render({"--png", "q.png", "--oidn-library", HELIO_FAKE_OIDN}),
               "--oidn-library: is only valid with --denoiser oidn");
  expect_usage(render({"--png", "q.png", "--denoiser", "optix"}), "--denoiser: 'optix' is none of own, oidn");
  expect_usage(render({"--png", "q.png", "--denoiser", "oidn", "--oidn-library", "x.so", "--server", "127.0.0.1:1"}),
               "--oidn-library: does not go with --server");
  expect_usage(render({"--png", "q.png", "--denoiser", "oidn", "--oidn-library", "/no/such.so"}),
               "oidn-library: '/no/such.so' cannot be loaded");
  EXPECT_FALSE(exists("q.exr"));
}

TEST_F(OidnCli, RendersInProcessAndThroughADaemon) {
  const auto own = heliograph_json(render({"--png", "own.png"}));
  EXPECT_EQ(own["denoiser"], "own");
  const auto by_filter = exr("q.exr");
  const auto json =
      heliograph_json(render({"--png", "q.png", "--denoiser", "oidn", "--oidn-library", HELIO_FAKE_OIDN}));
  EXPECT_EQ(json["denoiser"], "oidn");
  EXPECT_EQ(json["png_layer"], "display");
  const auto in_process = exr("q.exr");
  EXPECT_EQ(in_process.at("R"), by_filter.at("R"));
  EXPECT_NE(in_process.at("display.R"), by_filter.at("display.R"));
  EXPECT_NE(read_file(folder_ / "q.png").find("Layer display"), std::string::npos);

  ServerConfig config;
  config.render_threads = 2;
  config.oidn_library = HELIO_FAKE_OIDN;
  const auto server = Server::start(config);
  ASSERT_TRUE(server) << server.error().to_string();
  heliograph_json(render({"--png", "q.png", "--denoiser", "oidn", "--server", (*server)->address()}));
  EXPECT_EQ(exr("q.exr"), in_process);
  heliograph_json({"move", "quad.gltf", "--turn", "10", "--size", "32x32", "--samples", "2", "--layers", "display",
                   "--denoiser", "oidn", "--server", (*server)->address(), "--output", "m.exr"});
  const auto moved = exr("m.0001.exr");
  for (const float error : moved.at("display.error")) ASSERT_TRUE(std::isinf(error));
}

// With the library:

TEST_F(OidnService, FullTierTilesAreByTheLibrary) {
  HELIO_NEEDS_OIDN();
  start_with(oidn_path());
  const std::string session = create_session(scene_, 96, 64, 8);
  const auto pictures = pictures_by({pb::DENOISER_UNSPECIFIED, pb::DENOISER_OIDN}, session);
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].at("R"), pictures[1].at("R"));
  EXPECT_NE(pictures[0].at("display.R"), pictures[1].at("display.R"));
  for (const float error : pictures[1].at("display.error")) ASSERT_TRUE(std::isinf(error));
  // The lamp's radiance is 1, and the film has no noise.
  const std::size_t middle = 32 * 96 + 48;
  EXPECT_NEAR(pictures[1].at("display.R")[middle], 1, 0.05);
}

TEST(OidnRoom, FullTierComesNearerToItsTruthThanTheFilm) {
  HELIO_NEEDS_OIDN();
  const TemporaryFolder folder;
  const auto render = [&](const std::string& samples, const std::string& name) {
    const ProcessResult result =
        run_program(HELIOGRAPH_PROGRAM,
                    {"render", std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf", "--size",
                     "128x128", "--samples", samples, "--layers", "display", "--denoiser", "oidn", "--output", name},
                    folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const std::string bytes = read_file(folder / name);
    return decode_tile({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20).value();
  };
  const DecodedTile truth = render("512", "truth.exr"), noisy = render("8", "noisy.exr");
  // Of what a screen shows: the edge of the lamp, of radiance 17, would count for more than all of the room.
  const auto error = [&](const char* channel) {
    const std::vector<float>&a = *noisy.find(channel), &b = *truth.find("G");
    double sum = 0;
    for (std::size_t i = 0; i < b.size(); ++i) sum += std::pow(std::min(a[i], 1.0f) - std::min(b[i], 1.0f), 2);
    return std::sqrt(sum / double(b.size()));
  };
  EXPECT_LT(error("display.G"), 0.5 * error("G"));
}

}  // namespace
}  // namespace helio::test
