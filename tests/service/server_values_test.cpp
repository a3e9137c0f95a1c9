// The server's values: configuration, conversions, memory account, timers.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <future>
#include <random>

#include "renderer/base/clock.h"
#include "renderer/codec/checksum.h"
#include "renderer/codec/sha256.h"
#include "server/base/grpc_status.h"
#include "server/base/memory_account.h"
#include "server/base/server_config.h"
#include "server/base/task_thread.h"
#include "server/base/timer_queue.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"
#include "server/stream/tile_encoder.h"

namespace helio {
namespace {

TEST(ServerConfig, FlagsSetEveryOption) {
  const auto request = parse_server_config(
      "heliographd", {"--listen", "[::1]:7000", "--scene-root", "/a", "--scene-root", "/b", "--max-memory", "3G",
                      "--max-film-pixels=5000", "--session-grace", "1.5", "--render-threads", "3"});
  ASSERT_TRUE(request.ok()) << request.error().to_string();
  EXPECT_EQ(request->config.listen, "[::1]:7000");
  EXPECT_EQ(request->config.scene_roots, (std::vector<std::string>{"/a", "/b"}));
  EXPECT_EQ(request->config.max_memory, 3ull << 30);
  EXPECT_EQ(request->config.max_film_pixels, 5000u);
  EXPECT_EQ(request->config.session_grace_s, 1.5);
  EXPECT_EQ(request->config.render_threads, 3);
}

TEST(ServerConfig, AllProblemsAtOnce) {
  const auto request = parse_server_config(
      "heliographd", {"--max-sessions", "-1", "--max-memory", "7Q", "--session-grace", "nan", "--log-level", "loud"});
  ASSERT_FALSE(request.ok());
  const std::string text = request.error().to_string();
  for (const char* part : {"--max-sessions: '-1'; allowed: [0, 65536]", "--max-memory: '7Q'", "--session-grace: 'nan'",
                           "--log-level: 'loud'; allowed: trace, debug"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  EXPECT_FALSE(parse_server_config("heliographd", {"--max-memory"}).ok());
  EXPECT_FALSE(parse_server_config("heliographd", {"--max-memory", "99999999999999999999"}).ok());
  EXPECT_FALSE(parse_server_config("heliographd", {"--max-memory", "9999999T"}).ok());
}

TEST(ServerConfig, ProblemsOfEveryKindAtOnce) {
  const auto path = std::filesystem::temp_directory_path() / ("helio-bad-config-" + std::to_string(getpid()) + ".conf");
  std::ofstream(path) << "max-jobz = 1\n";
  const auto request = parse_server_config("heliographd", {"--listen", "0.0.0.0:99999", "--render-threads", "-1",
                                                           "--bogus=3", "word", "--config", path.string()});
  std::filesystem::remove(path);
  ASSERT_FALSE(request.ok());
  EXPECT_EQ(request.error().code, ErrorCode::invalid_argument);
  const std::string text = request.error().to_string();
  for (const char* part : {"--listen: '0.0.0.0:99999'; allowed: HOST:PORT, PORT from 0 (any free) to 65535",
                           "--render-threads: '-1'; allowed: [0, 1024]", "--bogus: is not an option of heliographd",
                           "word: is not an option", "--config: unknown name 'max-jobz'"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in: " << text;
  }
}

TEST(ServerConfig, DevicesAreAListWithTheCpu) {
  EXPECT_FALSE(ServerConfig().vulkan_devices);
  for (const char* text : {"cpu,vulkan", "vulkan, cpu"}) {
    const auto request = parse_server_config("heliographd", {"--devices", text});
    ASSERT_TRUE(request.ok()) << request.error().to_string();
    EXPECT_TRUE(request->config.vulkan_devices) << text;
  }
  for (const char* text : {"", "vulkan", "cpu,cpu", "cpu,gpu", "cpu,vulkan,"}) {
    const auto request = parse_server_config("heliographd", {"--devices", text});
    ASSERT_FALSE(request.ok()) << text;
    EXPECT_EQ(request.error().message, "--devices: '" + std::string(text) + "'; allowed: cpu, cpu,vulkan");
  }
  // Files are split at commas when they are read; flags still win over them.
  const auto path = std::filesystem::temp_directory_path() / ("helio-devices-" + std::to_string(getpid()) + ".conf");
  for (const char* line : {"devices = cpu,vulkan", "devices = \"vulkan,cpu\"", "devices = vulkan, cpu"}) {
    std::ofstream(path) << line << "\n";
    const auto from_file = parse_server_config("heliographd", {"--config", path.string()});
    ASSERT_TRUE(from_file.ok()) << from_file.error().to_string();
    EXPECT_TRUE(from_file->config.vulkan_devices) << line;
    const auto overridden = parse_server_config("heliographd", {"--config", path.string(), "--devices", "cpu"});
    ASSERT_TRUE(overridden.ok()) << overridden.error().to_string();
    EXPECT_FALSE(overridden->config.vulkan_devices) << line;
  }
  std::filesystem::remove(path);
}

TEST(ServerConfig, FlagsWinOverEnvironmentWinsOverFile) {
  const auto path = std::filesystem::temp_directory_path() / ("helio-config-" + std::to_string(getpid()) + ".conf");
  std::ofstream(path) << "max-jobs = 1\nmax-sessions = 1\nmax-scenes = 1\n";
  setenv("HELIOGRAPH_MAX_SESSIONS", "2", 1);
  setenv("HELIOGRAPH_MAX_SCENES", "2", 1);
  const auto request = parse_server_config("heliographd", {"--config", path.string(), "--max-scenes", "3"});
  unsetenv("HELIOGRAPH_MAX_SESSIONS");
  unsetenv("HELIOGRAPH_MAX_SCENES");
  ASSERT_TRUE(request.ok()) << request.error().to_string();
  EXPECT_EQ(request->config.max_jobs, 1);
  EXPECT_EQ(request->config.max_sessions, 2);
  EXPECT_EQ(request->config.max_scenes, 3);
  std::ofstream(path) << "max-jobz = 1\n";
  const auto unknown = parse_server_config("heliographd", {"--config", path.string()});
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().to_string().find("'max-jobz'"), std::string::npos) << unknown.error().to_string();
  std::filesystem::remove(path);
}

TEST(ServerConfig, StrictIsAFlagOrAValue) {
  const auto strict = [](const std::vector<std::string>& arguments) {
    const auto request = parse_server_config("heliographd", arguments);
    EXPECT_TRUE(request.ok()) << request.error().to_string();
    return request.ok() && request->config.strict;
  };
  EXPECT_FALSE(strict({}));
  EXPECT_TRUE(strict({"--strict"}));
  EXPECT_TRUE(strict({"--strict", "--max-jobs", "1"}));
  EXPECT_TRUE(strict({"--strict", "on"}));
  EXPECT_FALSE(strict({"--strict=off"}));
  setenv("HELIOGRAPH_STRICT", "on", 1);
  EXPECT_TRUE(strict({}));
  EXPECT_FALSE(strict({"--strict", "off"}));
  unsetenv("HELIOGRAPH_STRICT");
  EXPECT_NE(parse_server_config("heliographd", {"--strict=maybe"}).error().to_string().find("allowed: on, off"),
            std::string::npos);
}

TEST(ServerConfig, HelpNamesEveryOptionWithItsDefault) {
  const auto request = parse_server_config("heliographd", {"--help"});
  ASSERT_TRUE(request.ok());
  for (const ConfigOption& option : config_options()) {
    EXPECT_NE(request->print.find("--" + option.name), std::string::npos) << option.name;
  }
  EXPECT_NE(request->print.find("HELIOGRAPH_MAX_MEMORY"), std::string::npos);
  EXPECT_NE(request->print.find("[127.0.0.1:0]"), std::string::npos);
  EXPECT_GT(complete(ServerConfig()).max_memory, 0u);
}

TEST(Convert, PosesSurviveTheWire) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const V3d position(normal(random), normal(random), normal(random));
    // Every eighth direction lies near an axis, where one component of the quaternion vanishes.
    V3d direction(normal(random), normal(random), normal(random));
    if (i % 8 == 0) direction = V3d(i % 3 == 0, i % 3 == 1, i % 3 == 2) * (i % 16 ? 1.0 : -1.0) + direction * 1e-9;
    const auto pose = look_at(position, position + direction, V3d(0.3, 1, 0.2), 0.5);
    ASSERT_TRUE(pose.ok());
    Problems problems;
    CameraPose sent = *pose;
    sent.aspect = i % 2 == 0 ? 0 : 0.5 + i;
    const CameraPose back = read_camera(to_message(sent), {}, "camera", problems);
    ASSERT_TRUE(problems.empty());
    EXPECT_EQ(back.aspect, sent.aspect);
    EXPECT_LT(length(back.right - pose->right), 1e-9);
    EXPECT_LT(length(back.up - pose->up), 1e-9);
    EXPECT_LT(length(back.forward - pose->forward), 1e-9);
    EXPECT_EQ(back.position, pose->position);
    EXPECT_EQ(back.vertical_fov, pose->vertical_fov);
  }
}

TEST(Convert, OrthographicViewsSurviveTheWire) {
  CameraPose pose;
  pose.projection = Projection::orthographic;
  pose.half_height = 2.5;
  pose.lens_radius = 0.1;
  pose.focus_distance = 4;
  Problems problems;
  const CameraPose back = read_camera(to_message(pose), {}, "camera", problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(back.projection, Projection::orthographic);
  EXPECT_EQ(back.half_height, 2.5);
  EXPECT_EQ(back.lens_radius, 0.1);
  EXPECT_EQ(back.focus_distance, 4);
}

TEST(Convert, ModesSurviveTheWireWithTheirOptions) {
  for (const RenderMode mode : kEveryRenderMode) {
    RenderSettings settings;
    settings.mode = mode;
    if (allocates(mode)) settings.adaptive = {8, 32, ErrorMeasure::rmse};
    const pb::RenderSettings message = to_message(settings);
    EXPECT_EQ(message.variant(), mode == RenderMode::pt ? pb::VARIANT_UNSPECIFIED : pb::VARIANT_BOUNDED);
    Problems problems;
    EXPECT_EQ(read_settings(message, {}, "settings", problems), settings) << to_string(mode);
    EXPECT_TRUE(problems.empty());
    settings.variant = mode == RenderMode::pt ? ModeVariant::bounded : ModeVariant::paper;
    // Not sent where counts do not differ: read back as the variant's default.
    if (mode == RenderMode::reproject) settings.adaptive.min_samples = kPaperMinSamples;
    if (reuses(mode)) settings.reprojection = {1, 0.25};
    EXPECT_EQ(read_settings(to_message(settings), {}, "settings", problems), settings) << to_string(mode);
    EXPECT_TRUE(problems.empty());
  }
  for (const Integrator integrator : kEveryIntegrator) {
    RenderSettings settings;
    settings.integrator = integrator;
    Problems problems;
    EXPECT_EQ(read_settings(to_message(settings), {}, "settings", problems), settings) << to_string(integrator);
    EXPECT_TRUE(problems.empty());
  }
  for (const Technique technique : {Technique{0, 2}, {2, 1}, {3, 4}}) {
    RenderSettings settings;
    settings.integrator = Integrator::bdpt;
    settings.technique = technique;
    Problems problems;
    EXPECT_EQ(read_settings(to_message(settings), {}, "settings", problems), settings);
    EXPECT_TRUE(problems.empty());
  }
  for (const RouletteRule rule : {RouletteRule::root, RouletteRule::throughput}) {
    RenderSettings settings;
    settings.roulette = rule;
    Problems problems;
    EXPECT_EQ(read_settings(to_message(settings), {}, "settings", problems), settings);
    EXPECT_TRUE(problems.empty());
  }
  pb::RenderSettings unknown;
  unknown.set_integrator(pb::Integrator(17));
  Problems refused;
  read_settings(unknown, {}, "settings", refused);
  EXPECT_NE(refused.to_error().to_string().find("settings.integrator: unknown value 17; allowed: INTEGRATOR_PATH (1)"),
            std::string::npos)
      << refused.to_error().to_string();
  pb::RenderSettings odd;
  odd.set_mode(pb::MODE_COMBINED);
  odd.mutable_adaptive()->set_min_samples(7);
  Problems problems;
  read_settings(odd, {}, "settings", problems);
  EXPECT_NE(problems.to_error().message.find("settings.adaptive.min_samples: 7 is odd"), std::string::npos);
}

// The validator names fields as the protocol spells them.
TEST(Convert, EveryPathOfTheValidatorIsAField) {
  const auto expect_field = [](const google::protobuf::Descriptor* message, const std::string& path) {
    const std::size_t dot = path.find('.');
    const auto* field = message->FindFieldByName(path.substr(0, dot));
    ASSERT_NE(field, nullptr) << path;
    if (dot != std::string::npos) field = field->message_type()->FindFieldByName(path.substr(dot + 1));
    ASSERT_NE(field, nullptr) << path;
  };
  for (const auto& field : settings_fields()) expect_field(pb::RenderSettings::descriptor(), field.path);
  for (const auto& field : budget_fields()) expect_field(pb::Budget::descriptor(), field.path);
}

// Fields that no longer offer a choice are read as 0 or as they always are now, as older clients send them.
TEST(Convert, SettingsThatAreConstantsNowAreTakenAsThatAlone) {
  pb::RenderSettings settings;
  settings.mutable_light_cache()->set_shrinking(0.75);
  settings.mutable_reprojection()->set_mapping(pb::REPROJECTION_MAPPING_REVERSE);
  pb::Budget budget;
  budget.set_error_measure(pb::ERROR_MEASURE_RMSE);
  Problems problems;
  EXPECT_EQ(read_settings(settings, {}, "settings", problems), RenderSettings());
  EXPECT_EQ(read_budget(budget, "budget", problems), Budget());
  EXPECT_TRUE(problems.empty());
  settings.mutable_light_cache()->set_shrinking(std::nan(""));
  settings.mutable_reprojection()->set_mapping(pb::REPROJECTION_MAPPING_FORWARD);
  settings.mutable_technique()->set_unweighted(true);
  budget.set_error_measure(pb::ERROR_MEASURE_RELMSE);
  read_settings(settings, {}, "settings", problems);
  read_budget(budget, "budget", problems);
  std::vector<std::string> places;
  for (const Problems::Item& item : problems.items()) {
    if (item.message.find("(no longer a choice)") != std::string::npos) places.push_back(item.where);
  }
  EXPECT_EQ(places, (std::vector<std::string>{"settings.technique.unweighted", "settings.reprojection.mapping",
                                              "settings.light_cache.shrinking", "budget.error_measure"}));
}

TEST(GrpcStatus, LongMessagesAreCutAtACharacter) {
  std::string text(kMaxStatusMessage - 1, 'x');
  text += "\xC3\xA9\xC3\xA9";  // two characters of two bytes
  const grpc::Status status = to_grpc_status(Error{ErrorCode::not_found, text, {}});
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(status.error_message(), std::string(kMaxStatusMessage - 1, 'x') + " ...");
}

TEST(MemoryAccount, CountsWhatIsHeld) {
  MemoryAccount account(100);
  auto first = account.reserve(60, "a");
  ASSERT_TRUE(first.ok());
  const auto second = account.reserve(50, "a film");
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::resource_exhausted);
  EXPECT_NE(second.error().message.find("max_memory: 50 bytes are needed for a film, 40 of 100 are left"),
            std::string::npos);
  Reservation moved = std::move(*first);
  EXPECT_EQ(account.used(), 60u);
  moved.release();
  EXPECT_EQ(account.used(), 0u);
  EXPECT_FALSE(account.reserve(~0ull, "everything").ok());
}

TEST(TimerQueue, CallsInOrderOfTime) {
  TimerQueue timers;
  std::promise<void> done;
  std::vector<int> order;
  const double now = now_s();
  timers.call_at(now + 0.03, [&] {
    order.push_back(2);
    done.set_value();
  });
  timers.call_at(now + 0.01, [&] { order.push_back(1); });
  timers.call_at(now + 1000, [&] { order.push_back(3); });
  done.get_future().wait();
  EXPECT_EQ(order, (std::vector<int>{1, 2}));
}

TEST(TaskThread, BoundsItsQueueAndDropsIt) {
  std::promise<void> release, started;
  auto kept = std::make_shared<int>(1);
  {
    TaskThread thread(1);
    EXPECT_TRUE(thread.submit([&] {
      started.set_value();
      release.get_future().wait();
    }));
    started.get_future().wait();
    EXPECT_TRUE(thread.busy());
    EXPECT_TRUE(thread.submit([kept] {}));
    EXPECT_FALSE(thread.submit([] {})) << "one waits already";
    thread.stop();
    EXPECT_EQ(kept.use_count(), 1) << "what waited is gone";
    EXPECT_FALSE(thread.submit([] {}));
    release.set_value();
  }
}

TEST(Sha256, KnownDigests) {
  // FIPS 180-2, appendix B.1.
  Sha256 hash;
  hash.update(std::string_view("abc"));
  EXPECT_EQ(to_hex(hash.finish()), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_file("/nonexistent").error().code, ErrorCode::not_found);
}

// Pictures that are nearly done have variances below the smallest half, 6e-8; a client must not take them for certain.
TEST(TileEncoder, VariancesBelowTheSmallestHalfAreNoCertainty) {
  FrameTile tile;
  tile.pixels.window = {0, 0, 3, 1};
  for (int c = 0; c < 3; ++c) {
    tile.pixels.radiance[c] = {1e-9f, 0, 0.5f};
    tile.pixels.variance[c] = {1e-9f, 0, 0.25f};
  }
  for (const TilePixelType type : {TilePixelType::half, TilePixelType::float32}) {
    TileFormat format;
    format.encoding.pixel_type = type;
    format.channels = kResolveVariance;
    const auto encoded = encode(tile, 3, 1, format);
    ASSERT_TRUE(encoded.ok()) << encoded.error().to_string();
    const auto decoded = decode_tile(encoded->bytes, 3);
    ASSERT_TRUE(decoded.ok()) << decoded.error().to_string();
    const bool half = type == TilePixelType::half;
    for (const char* name : {"variance.R", "variance.G", "variance.B"}) {
      ASSERT_TRUE(decoded->find(name)) << name;
      EXPECT_EQ(*decoded->find(name), (std::vector<float>{half ? 0x1p-24f : 1e-9f, 0, 0.25f})) << name;
    }
    EXPECT_EQ(*decoded->find("G"), (std::vector<float>{half ? 0.0f : 1e-9f, 0, 0.5f}));
  }
}

FrameTile preview_tile() {
  FrameTile tile;
  tile.tag = {1, 2, 3};
  tile.preview = tile.final = true;
  tile.pixels.window = {16, 8, 48, 24};
  const std::size_t area = std::size_t(tile.pixels.window.area());
  tile.pixels.display[0].assign(area, 0.25f);
  tile.pixels.display[1].assign(area, 1e9f);
  tile.pixels.display[2].assign(area, 0);
  return tile;
}

TEST(TileEncoder, PreviewsHaveDisplayAloneInHalf) {
  TileFormat format;  // of the film; only its compression counts
  format.encoding = {TilePixelType::float32, TileCompression::zip};
  format.channels = kResolveAll;
  const FrameTile tile = preview_tile();
  const auto encoded = encode(tile, 64, 48, format);
  ASSERT_TRUE(encoded.ok()) << encoded.error().to_string();
  const pb::Tile message = to_message(*encoded, "s");
  EXPECT_TRUE(message.preview());
  EXPECT_TRUE(message.final());
  EXPECT_EQ(message.crc32(), crc32_of(encoded->bytes.data(), encoded->bytes.size()));
  EXPECT_EQ(message.jpeg_crc32(), 0u);
  const auto decoded = decode_tile(encoded->bytes, 1000);
  ASSERT_TRUE(decoded.ok()) << decoded.error().to_string();
  EXPECT_EQ(decoded->names, (std::vector<std::string>{"display.B", "display.G", "display.R"}));
  EXPECT_EQ(decoded->header.data_window, tile.pixels.window);
  EXPECT_EQ((*decoded->find("display.R"))[7], 0.25f);
  EXPECT_EQ((*decoded->find("display.G"))[7], 65504) << "the largest half";
}

TEST(TileEncoder, PreviewsComeAsJpegWhereAskedFor) {
  TileFormat format;
  format.preview_jpeg = 80;
  const auto encoded = encode(preview_tile(), 64, 48, format, -1);
  ASSERT_TRUE(encoded.ok()) << encoded.error().to_string();
  ASSERT_GT(encoded->bytes.size(), 4u);
  EXPECT_EQ(encoded->bytes[0], 0xff);
  EXPECT_EQ(encoded->bytes[1], 0xd8);
  pb::StreamResponse response;
  const std::vector<std::uint8_t> file = encoded->bytes;
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(to_stream_response(*encoded, "s").Dump(&slices).ok());
  std::string bytes;
  for (const grpc::Slice& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  ASSERT_TRUE(response.ParseFromString(bytes));
  const pb::Tile& tile = response.tile();
  EXPECT_TRUE(tile.exr().empty());
  EXPECT_EQ(tile.crc32(), 0u);
  EXPECT_EQ(tile.jpeg(), std::string(file.begin(), file.end()));
  EXPECT_EQ(tile.jpeg_crc32(), crc32_of(file.data(), file.size()));
}

TEST(TileEncoder, TilesOfTheFilmAreNeverJpeg) {
  FrameTile tile = preview_tile();
  tile.preview = false;
  for (int c = 0; c < 3; ++c) tile.pixels.radiance[c] = tile.pixels.display[c];
  TileFormat format;
  format.channels = 0;
  const auto plain = encode(tile, 64, 48, format);
  format.preview_jpeg = 80;
  const auto encoded = encode(tile, 64, 48, format, 3);
  ASSERT_TRUE(plain.ok() && encoded.ok());
  EXPECT_FALSE(encoded->jpeg);
  EXPECT_EQ(encoded->bytes, plain->bytes);
}

TEST(Convert, PreviewSettings) {
  pb::RenderSettings message;
  Problems problems;
  RenderSettings settings = read_settings(message, {}, "settings", problems);
  EXPECT_EQ(settings.preview.rate, 0);
  EXPECT_EQ(settings.preview.budget_s, 0.045);
  EXPECT_EQ(to_message(settings).preview_rate(), 0);
  EXPECT_EQ(to_message(settings).preview_budget_ms(), 0) << "without previews every message is as it was";
  message.set_preview_rate(30);
  message.set_preview_budget_ms(28);
  settings = read_settings(message, {}, "settings", problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(settings.preview.rate, 30);
  EXPECT_NEAR(settings.preview.budget_s, 0.028, 1e-12);
  EXPECT_EQ(to_message(settings).preview_rate(), 30);
  EXPECT_NEAR(to_message(settings).preview_budget_ms(), 28, 1e-9);

  message.set_preview_rate(121);
  message.set_preview_budget_ms(4);
  read_settings(message, {}, "settings", problems);
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_EQ(problems.items()[0].where, "settings.preview_rate");
  EXPECT_NE(problems.items()[0].message.find("121; allowed: [0, 120]"), std::string::npos)
      << problems.items()[0].message;
  EXPECT_EQ(problems.items()[1].where, "settings.preview_budget_ms");
  EXPECT_NE(problems.items()[1].message.find("[5, 1000]"), std::string::npos) << problems.items()[1].message;
}

TEST(Convert, PreviewJpegIsAQuality) {
  pb::TileFormat message;
  Problems problems;
  EXPECT_EQ(read_tile_format(message, "format", problems).preview_jpeg, 0);
  message.set_preview_jpeg(100);
  EXPECT_EQ(read_tile_format(message, "format", problems).preview_jpeg, 100);
  EXPECT_TRUE(problems.empty());
  message.set_preview_jpeg(101);
  read_tile_format(message, "format", problems);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems.items()[0].where, "format.preview_jpeg");
  EXPECT_EQ(problems.items()[0].message, "101; allowed: [0, 100]");
}

TEST(Convert, VarianceEveryIsANumberOfTiles) {
  pb::TileFormat message;
  Problems problems;
  EXPECT_EQ(read_tile_format(message, "format", problems).variance_every, 1);
  message.set_variance_every(1000);
  EXPECT_EQ(read_tile_format(message, "format", problems).variance_every, 1000);
  EXPECT_TRUE(problems.empty());
  message.set_variance_every(1001);
  read_tile_format(message, "format", problems);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems.items()[0].where, "format.variance_every");
  EXPECT_EQ(problems.items()[0].message, "1001; allowed: [0, 1000]");
}

}  // namespace
}  // namespace helio
