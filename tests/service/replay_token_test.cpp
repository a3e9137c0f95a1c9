// Replay tokens: what is written is read, and nothing else is.
#include "server/sessions/replay_token.h"

#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "server/stream/convert.h"

namespace helio::test {
namespace {

// With a scene's names; a LoadedScene stays where it is made.
struct Scene : LoadedScene {
  Scene() {
    id = std::string(64, 'a');
    manifest.main_file = "set/room.glb";
    manifest.environment = "0.5,0.5,0.5";
    manifest.time_s = 2.5;
  }
};

FrameBegin frame() {
  FrameBegin begin;
  begin.settings.width = 640;
  begin.settings.height = 360;
  begin.settings.seed = 0xfedcba9876543210ull;
  begin.settings.max_segments = 77;
  begin.settings.roulette_from = 5;
  begin.settings.roulette = RouletteRule::throughput;
  begin.settings.filter = {PixelFilterKind::gaussian, 1.0 / 3};
  begin.settings.region = PixelRect{10, 10, 20, 20};
  begin.camera = *look_at({0.1, 1.0 / 3, 1e7}, {0.2, 0.3, 0}, {0, 1, 0}, 0.7);
  begin.camera.lens_radius = 0.01;
  begin.camera.focus_distance = 3.3;
  return begin;
}

constexpr InvalidSample kSample{639, 359, 1, 4294967295u};

Error refusal(const std::string& token, const RenderLimits& limits = {}) {
  const auto replay = read_replay_token(token, limits, "token");
  EXPECT_FALSE(replay.ok()) << token;
  return replay ? Error{} : replay.error();
}

// Every bit of the camera: the traced sample depends on it.
TEST(ReplayToken, HoldsFilmCameraSettingsAndSample) {
  for (const bool orthographic : {false, true}) {
    FrameBegin begin = frame();
    if (orthographic) {
      begin.camera.projection = Projection::orthographic;
      begin.camera.vertical_fov = CameraPose().vertical_fov;
      begin.camera.half_height = 0.1;
    }
    const std::string token = make_replay_token(Scene(), begin, kSample);
    EXPECT_LT(token.size(), 700u);
    const auto replay = read_replay_token(token, {}, "token");
    ASSERT_TRUE(replay.ok()) << replay.error().to_string();
    EXPECT_EQ(replay->camera, begin.camera);
    EXPECT_EQ(replay->sample, kSample);
    RenderSettings settings = begin.settings;
    settings.region.reset();  // a sample is the same in any region
    EXPECT_EQ(replay->settings, settings);
    EXPECT_EQ(replay->message.scene_id(), std::string(64, 'a'));
    EXPECT_EQ(replay->message.main_file(), "set/room.glb");
    EXPECT_EQ(replay->message.environment(), "0.5,0.5,0.5");
    EXPECT_EQ(replay->message.time_s(), 2.5);
    EXPECT_EQ(replay_note(replay->message), "");
    pb::SampleReplay other = replay->message;
    other.set_build("another");
    EXPECT_NE(replay_note(other).find("another"), std::string::npos);
  }
}

// A device rounds in other places: the CPU, which traces a sample again, may find another value.
TEST(ReplayToken, TellsTheDeviceThatRendered) {
  FrameBegin begin = frame();
  begin.settings.device = {RenderDevice::Kind::vulkan, 2};
  const auto replay = read_replay_token(make_replay_token(Scene(), begin, kSample), {}, "token");
  ASSERT_TRUE(replay.ok()) << replay.error().to_string();
  EXPECT_EQ(replay->settings.device, RenderDevice{});
  EXPECT_EQ(replay_note(replay->message),
            "rendered on vulkan:2, traced again on the CPU, which rounds in other places: bits may differ, and what is "
            "invalid there may be valid here");
  pb::SampleReplay other = replay->message;
  other.set_build("another");
  EXPECT_NE(replay_note(other).find("bits may differ; rendered on vulkan:2"), std::string::npos);
}

TEST(ReplayToken, TellsTheMode) {
  FrameBegin begin = frame();
  for (const RenderMode mode : kEveryRenderMode) {
    begin.settings.mode = mode;
    const auto replay = read_replay_token(make_replay_token(Scene(), begin, kSample), {}, "token");
    ASSERT_TRUE(replay.ok()) << replay.error().to_string();
    EXPECT_EQ(replay->message.mode(), to_message(mode));
  }
  begin.settings.mode = RenderMode(99);
  EXPECT_NE(refusal(make_replay_token(Scene(), begin, kSample)).message.find("MODE_COMBINED (4)"), std::string::npos);
}

// A sample is another one with another integrator; a token of none is of a daemon that knew only one.
TEST(ReplayToken, TellsWhichPathsMadeTheSample) {
  FrameBegin begin = frame();
  const auto replay = read_replay_token(make_replay_token(Scene(), begin, kSample), {}, "token");
  ASSERT_TRUE(replay.ok()) << replay.error().to_string();
  EXPECT_EQ(replay->message.integrator(), pb::INTEGRATOR_UNSPECIFIED);
  InvalidSample sample = kSample;
  sample.light_paths = 1000;
  // Of tiles of either kind each sample has its own.
  for (const auto& [rendered, light_paths, made] : {std::tuple(Integrator::light, 1000, Integrator::light),
                                                    {Integrator::bdpt, 1000, Integrator::bdpt},
                                                    {Integrator::pt_bdpt, 1000, Integrator::bdpt},
                                                    {Integrator::pt_bdpt, 0, Integrator::path},
                                                    {Integrator::vcm, 1000, Integrator::vcm}}) {
    begin.settings.integrator = rendered;
    sample.light_paths = std::uint64_t(light_paths);
    const auto again = read_replay_token(make_replay_token(Scene(), begin, sample), {}, "token");
    ASSERT_TRUE(again.ok()) << again.error().to_string();
    EXPECT_EQ(again->settings.integrator, made) << to_string(rendered);
    EXPECT_EQ(again->sample, sample);
  }
  begin.settings.integrator = Integrator::bdpt;
  begin.settings.technique = Technique{3, 2};
  sample.light_paths = 1000;
  const auto shown = read_replay_token(make_replay_token(Scene(), begin, sample), {}, "token");
  ASSERT_TRUE(shown.ok()) << shown.error().to_string();
  EXPECT_EQ(shown->settings.technique, begin.settings.technique);
}

TEST(ReplayToken, PathsThatDoNotFitAreRefused) {
  FrameBegin begin = frame();
  InvalidSample sample = kSample;
  sample.light_paths = 7;
  EXPECT_NE(refusal(make_replay_token(Scene(), begin, sample)).message.find("token.light_paths: 7 of integrator path"),
            std::string::npos);
  begin.settings.integrator = Integrator::bdpt;
  EXPECT_NE(refusal(make_replay_token(Scene(), begin, kSample)).message.find("token.light_paths: 0 of integrator bdpt"),
            std::string::npos);
  sample.light_paths = (std::uint64_t(1) << 32) + 1;
  EXPECT_NE(refusal(make_replay_token(Scene(), begin, sample)).message.find("allowed: [1, 4294967296]"),
            std::string::npos);
  sample.light_paths = 7;
  begin.settings.technique = Technique{1, 1};
  EXPECT_NE(refusal(make_replay_token(Scene(), begin, sample)).message.find("token.technique: light_vertices 1"),
            std::string::npos);
}

TEST(ReplayToken, LongNamesKeepTheirEnd) {
  Scene long_named;
  long_named.manifest.main_file = std::string(5000, 'x') + "\xc3\xa9/end.glb";
  long_named.manifest.environment = "e\xc3\xa9" + std::string(63, 'z');
  const auto replay = read_replay_token(make_replay_token(long_named, frame(), kSample), {}, "token");
  ASSERT_TRUE(replay.ok()) << replay.error().to_string();
  EXPECT_EQ(replay->message.main_file().size(), 64u);
  EXPECT_TRUE(replay->message.main_file().ends_with("\xc3\xa9/end.glb"));
  EXPECT_EQ(replay->message.environment(), std::string(63, 'z')) << "cut between characters";
}

// Any character that is lost, doubled or taken for another is found out.
TEST(ReplayToken, DamageIsFoundOut) {
  const std::string token = make_replay_token(Scene(), frame(), kSample);
  for (std::size_t i = 0; i < token.size(); ++i) {
    std::string other = token;
    other[i] = token[i] == 'A' ? 'B' : 'A';
    EXPECT_EQ(refusal(other).code, ErrorCode::invalid_argument) << i;
    EXPECT_EQ(refusal(token.substr(0, i)).code, ErrorCode::invalid_argument) << i;
    other.insert(i, 1, 'Q');
    refusal(other);
  }
  EXPECT_NE(refusal(token + "A").message.find("checksum"), std::string::npos);
  EXPECT_NE(refusal("").message.find("hg1-"), std::string::npos);
  EXPECT_NE(refusal("hg2-AAAA").message.find("'hg2-AAAA'"), std::string::npos);
  EXPECT_NE(refusal("hg1-ab+c").message.find("character 7"), std::string::npos);
  EXPECT_NE(refusal(std::string(5000, 'a')).message.find("5000 characters"), std::string::npos);
}

// With a right checksum, as only a program would make it.
TEST(ReplayToken, FieldsOutOfRangeAreNamedTogether) {
  FrameBegin begin = frame();
  begin.settings.max_segments = 0;
  begin.camera.position.y = std::numeric_limits<double>::quiet_NaN();
  begin.camera.focus_distance = -1;
  const Error error = refusal(make_replay_token(Scene(), begin, {640, 0, 2, 0}));
  for (const char* part : {"token.max_segments", "token.position", "token.focus_distance", "pixel 640,0",
                           "film of 640x360", "token.sample.half: 2"}) {
    EXPECT_NE(error.message.find(part), std::string::npos) << part << " in " << error.message;
  }
  RenderLimits small;
  small.max_film_side = 512;
  EXPECT_NE(refusal(make_replay_token(Scene(), frame(), kSample), small).message.find("512"), std::string::npos);
}

}  // namespace
}  // namespace helio::test
