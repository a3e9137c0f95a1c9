// StreamFrames: frames, budgets, order, the newest view, and the session's life behind the stream.
#include <zlib.h>

#include <cmath>
#include <map>
#include <set>

#include "renderer/base/clock.h"
#include "renderer/codec/tile_codec.h"
#include "service_fixture.h"
#include "tcp_relay.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class StreamTest : public ServiceTest {
 protected:
  void SetUp() override {
    start();
    scene_ = load_quad(0.25);
  }
  std::string scene_;
};

DecodedTile decode(const pb::Tile& tile) {
  auto decoded = decode_tile({reinterpret_cast<const std::uint8_t*>(tile.exr().data()), tile.exr().size()}, 1 << 20);
  EXPECT_TRUE(decoded.ok()) << decoded.error().to_string();
  return decoded.ok() ? std::move(*decoded) : DecodedTile();
}

TEST_F(StreamTest, FrameComesAsCompleteExrTiles) {
  const std::string session = create_session(scene_, 200, 152, 4);
  StreamClient client(stub(), session);
  client.send(view(7));
  ASSERT_TRUE(client.reader().wait_for_frame_end(7));
  const auto messages = client.reader().messages();

  ASSERT_TRUE(messages[0].has_opened());
  EXPECT_EQ(messages[0].opened().session_id(), session);
  EXPECT_FALSE(messages[0].opened().resumed());
  EXPECT_EQ(messages[0].opened().settings().width(), 200);
  ASSERT_TRUE(messages[1].has_frame_begin());
  EXPECT_EQ(messages[1].frame_begin().tag().view_id(), 7u);
  EXPECT_EQ(messages[1].frame_begin().settings().max_segments(), 10);

  std::uint64_t bytes = 0;
  std::set<std::pair<int, int>> finals;
  std::int64_t final_pixels = 0;
  for (const auto& message : messages) {
    if (!message.has_tile()) continue;
    const pb::Tile& tile = message.tile();
    bytes += tile.exr().size();
    EXPECT_EQ(tile.crc32(), crc32_z(0, reinterpret_cast<const Bytef*>(tile.exr().data()), tile.exr().size()));
    EXPECT_EQ(tile.tag().session_id(), session);
    EXPECT_EQ(tile.invalid_samples(), 0u);
    if (!tile.final()) continue;
    EXPECT_TRUE(finals.emplace(tile.window().x0(), tile.window().y0()).second) << "a second final tile";
    const DecodedTile pixels = decode(tile);
    EXPECT_EQ(pixels.header.frame_width, 200);
    EXPECT_EQ(pixels.header.frame_height, 152);
    EXPECT_EQ(pixels.header.data_window,
              (PixelRect{tile.window().x0(), tile.window().y0(), tile.window().x1(), tile.window().y1()}));
    final_pixels += pixels.header.data_window.area();
    ASSERT_NE(pixels.find("variance.G"), nullptr);
    ASSERT_NE(pixels.find("samples"), nullptr);
    EXPECT_EQ((*pixels.find("samples"))[0], 4);
    if (pixels.header.data_window.contains(100, 75)) {
      const std::size_t middle = std::size_t(75 - pixels.header.data_window.y0) * pixels.header.data_window.width() +
                                 (100 - pixels.header.data_window.x0);
      EXPECT_EQ((*pixels.find("R"))[middle], 0.25f) << "the square emits 0.25 and reflects nothing";
    }
  }
  EXPECT_EQ(final_pixels, 200 * 152);
  const pb::FrameEnd& end = messages.back().frame_end();
  EXPECT_EQ(end.reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(end.totals().samples_per_pixel(), 4u);
  EXPECT_EQ(end.totals().paths(), 200u * 152 * 4);
  EXPECT_GE(end.totals().rays(), end.totals().paths());
  EXPECT_EQ(end.bytes_sent(), bytes);
  EXPECT_GT(end.first_tile_seconds(), 0);
}

TEST_F(StreamTest, FormatChoosesChannelsAndPixelType) {
  const std::string session = create_session(scene_, 16, 16, 2);
  StreamClient client(stub());
  pb::StreamRequest open;
  open.mutable_open()->set_session_id(session);
  pb::TileFormat& format = *open.mutable_open()->mutable_format();
  format.set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  format.set_compression(pb::COMPRESSION_ZIP);
  format.set_without_variance(true);
  format.set_without_samples(true);
  format.set_alpha(true);
  format.set_depth(true);
  format.set_normal(true);
  format.set_albedo(true);
  client.send(open);
  client.start_reading();
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  for (const auto& message : client.reader().messages()) {
    if (!message.has_tile()) continue;
    const DecodedTile tile = decode(message.tile());
    EXPECT_EQ(
        std::set<std::string>(tile.names.begin(), tile.names.end()),
        (std::set<std::string>{"A", "B", "G", "N.x", "N.y", "N.z", "R", "Z", "albedo.b", "albedo.g", "albedo.r"}));
    const std::size_t middle = 8 * 16 + 8;
    EXPECT_EQ((*tile.find("A"))[middle], 1);
    EXPECT_NEAR((*tile.find("Z"))[middle], 3, 0.01);
    EXPECT_NEAR((*tile.find("N.z"))[middle], 1, 1e-6);
    EXPECT_TRUE(std::isinf((*tile.find("Z"))[0])) << "the corner sees nothing";
  }
}

TEST_F(StreamTest, VarianceOfEachNthTileIsSent) {
  constexpr int kEvery = 3;
  StreamClient client(stub());
  pb::StreamRequest open;
  open.mutable_open()->set_session_id(create_session(scene_, 48, 40, 512));
  open.mutable_open()->mutable_format()->set_variance_every(kEvery);
  client.send(open);
  client.start_reading();
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  std::map<std::pair<unsigned, unsigned>, int> since;  // by place; tiles after the last one with variance
  int left_out = 0;
  for (const auto& message : client.reader().messages()) {
    if (!message.has_tile()) continue;
    const pb::Tile& tile = message.tile();
    const bool sent = decode(tile).find("variance.G") != nullptr;
    const auto [place, first] = since.try_emplace({tile.window().x0(), tile.window().y0()}, 0);
    place->second = sent ? 0 : place->second + 1;
    left_out += !sent;
    EXPECT_LT(place->second, kEvery);
    EXPECT_TRUE(sent || (!first && !tile.final())) << "the first and the final have it";
  }
  EXPECT_GT(left_out, 0);
}

TEST_F(StreamTest, EachBudgetIsNamedWhenItEndsTheFrame) {
  StreamClient client(stub(), create_session(scene_, 64, 64));
  pb::Budget samples, time, error;
  samples.set_samples(3);
  time.set_time_s(0.05);
  error.set_error(1e-3);
  client.send(samples);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  client.send(time);
  client.send(view(2, 0.1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(2));
  client.send(error);
  client.send(view(3, 0.2));
  ASSERT_TRUE(client.reader().wait_for_frame_end(3));
  std::map<std::uint64_t, pb::FrameEnd> ends;
  for (const auto& message : client.reader().messages()) {
    // The first end of each view: a new budget starts the view's next frame.
    if (message.has_frame_end()) ends.emplace(message.frame_end().tag().view_id(), message.frame_end());
  }
  EXPECT_EQ(ends[1].reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(ends[1].totals().samples_per_pixel(), 3u);
  EXPECT_EQ(ends[2].reason(), pb::END_REASON_TIME);
  // A frame keeps time back, at most half of its own, to measure and show what it made.
  EXPECT_GE(ends[2].totals().seconds(), 0.05 / 2);
  EXPECT_EQ(ends[3].reason(), pb::END_REASON_ERROR);
  EXPECT_TRUE(ends[3].totals().error().known());
  EXPECT_LE(ends[3].totals().error().rmse(), 1e-3);
}

// What the protocol promises: revisions never go back, tiles belong to the frame begun last.
void expect_no_stale_tiles(const std::vector<pb::StreamResponse>& messages) {
  std::uint64_t revision = 0, frame = 0;
  for (const auto& message : messages) {
    if (message.has_frame_begin()) {
      EXPECT_GE(message.frame_begin().tag().revision(), revision);
      EXPECT_GT(message.frame_begin().tag().frame(), frame);
      revision = message.frame_begin().tag().revision();
      frame = message.frame_begin().tag().frame();
    } else if (message.has_tile()) {
      ASSERT_EQ(message.tile().tag().revision(), revision) << "a stale tile";
      ASSERT_EQ(message.tile().tag().frame(), frame);
    }
  }
}

TEST_F(StreamTest, NewestViewWinsAndNoTileOfAnOlderOneFollows) {
  StreamClient client(stub(), create_session(scene_, 512, 512));
  for (int i = 1; i <= 40; ++i) {
    client.send(view(i, 0.01 * i));
    if (i % 4 == 0) client.reader().wait_for_tiles(i / 4);
  }
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) { return m.has_tile() && m.tile().tag().view_id() == 40; }));
  expect_no_stale_tiles(client.reader().messages());
}

TEST_F(StreamTest, UpdateOfAnotherCallSupersedesAsWell) {
  const std::string session = create_session(scene_, 256, 256);
  StreamClient client(stub(), session);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  pb::UpdateSessionRequest update;
  update.set_session_id(session);
  *update.mutable_view() = view(2, 0.3);
  pb::UpdateSessionResponse updated;
  ASSERT_TRUE(call(&pb::RenderService::Stub::UpdateSession, update, &updated).ok());
  ASSERT_TRUE(client.reader().wait_for(
      [&](const auto& m) { return m.has_tile() && m.tile().tag().revision() == updated.revision(); }));
  bool superseded = false;
  for (const auto& message : client.reader().messages()) {
    superseded |= message.has_frame_end() && message.frame_end().reason() == pb::END_REASON_SUPERSEDED;
  }
  EXPECT_TRUE(superseded);
  expect_no_stale_tiles(client.reader().messages());
}

TEST_F(StreamTest, SettingsReplaceAllSettings) {
  StreamClient client(stub(), create_session(scene_, 64, 64, 2));
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  pb::StreamRequest request;
  pb::RenderSettings& settings = *request.mutable_settings();
  settings.set_width(300);
  settings.set_height(20);
  settings.mutable_region()->set_x0(130);
  settings.mutable_region()->set_x1(140);
  settings.mutable_region()->set_y1(20);
  client.send(request);
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) { return m.has_frame_end(); }, 2));
  std::int64_t pixels = 0;
  for (const auto& message : client.reader().messages()) {
    if (!message.has_tile() || !message.tile().final() || message.tile().tag().frame() < 2) continue;
    pixels += decode(message.tile()).header.data_window.area();
    EXPECT_EQ(decode(message.tile()).header.frame_width, 300);
  }
  EXPECT_EQ(pixels, 10 * 20);
}

// ---- order and content ---------------------------------------------------------------------------------------------

TEST_F(StreamTest, OutOfOrderMessagesAreRefused) {
  const std::string session = create_session(scene_, 16, 16);
  {
    StreamClient client(stub());
    client.send(view(1));
    expect_status(client.status(), StatusCode::FAILED_PRECONDITION, {"first message is not open"});
  }
  {
    StreamClient client(stub(), session);
    pb::StreamRequest open;
    open.mutable_open()->set_session_id(session);
    client.send(open);
    expect_status(client.status(), StatusCode::FAILED_PRECONDITION, {"open was sent before"});
  }
  {
    StreamClient client(stub());
    client.half_close();
    expect_status(client.status(), StatusCode::FAILED_PRECONDITION, {"before open"});
  }
  {
    StreamClient client(stub(), session);
    client.send(pb::StreamRequest());
    expect_status(client.status(), StatusCode::INVALID_ARGUMENT, {"request: is empty", "one of open, view"});
  }
  EXPECT_EQ(session_info(session).session_id(), session) << "the session outlives what its streams did";
}

TEST_F(StreamTest, UnknownSessionsAreNotFound) {
  StreamClient unknown(stub(), "s-123");
  expect_status(unknown.status(), StatusCode::NOT_FOUND, {"open.session_id", "'s-123'"});
  StreamClient empty(stub(), "");
  expect_status(empty.status(), StatusCode::INVALID_ARGUMENT, {"open.session_id: 0 bytes; allowed: an id of 1 to 64"});
  StreamClient large(stub(), std::string(65, 'x'));
  expect_status(large.status(), StatusCode::INVALID_ARGUMENT, {"open.session_id: 65 bytes"});
}

// Protobuf's rule for fields that are given again, which parsers have to follow: the last value counts.
TEST_F(StreamTest, TheLastOfTwoRequestsInOneMessageCounts) {
  const std::string session = create_session(scene_, 16, 16);
  pb::StreamRequest open, first, second, budget;
  open.mutable_open()->set_session_id(session);
  *first.mutable_view() = view(1);
  *second.mutable_view() = view(2);
  budget.mutable_budget()->set_samples(1);
  const auto answer =
      send_raw(new_channel(), kRenderService + "StreamFrames",
               {open.SerializeAsString(), first.SerializeAsString() + budget.SerializeAsString(),
                first.SerializeAsString() + second.SerializeAsString()});
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_EQ(session_info(session).revision(), 2u);
  pb::StreamResponse last;
  ASSERT_TRUE(last.ParseFromString(answer.messages.back()));
  EXPECT_EQ(last.frame_end().tag().view_id(), 2u);
  EXPECT_EQ(last.frame_end().reason(), pb::END_REASON_SAMPLES);
}

TEST_F(StreamTest, GarbageIsRefused) {
  const std::string method = kRenderService + "StreamFrames";
  expect_status(send_raw(new_channel(), method, {std::string("\x0A\xFF\xFF\xFF\x7F", 5)}).status,
                StatusCode::INVALID_ARGUMENT, {"not a well-formed heliograph.v1.StreamRequest"});
  // A string that is not UTF-8.
  expect_status(send_raw(new_channel(), method, {std::string("\x0A\x03\x0A\x01\xFF", 5)}).status,
                StatusCode::INVALID_ARGUMENT, {"UTF-8"});
  EXPECT_TRUE(server_->in_process_channel() != nullptr);
  EXPECT_FALSE(create_session(scene_, 8, 8).empty()) << "the daemon goes on";
}

struct BadView {
  const char* name;
  std::function<void(pb::View&)> spoil;
  std::vector<std::string> parts;
};

class BadViewTest : public StreamTest, public testing::WithParamInterface<BadView> {};

TEST_P(BadViewTest, IsRefusedByNameAndTheSessionLives) {
  const std::string session = create_session(scene_, 16, 16, 1);
  {
    StreamClient client(stub(), session);
    client.send(view(5));
    ASSERT_TRUE(client.reader().wait_for_frame_end(5));
    pb::View bad = view(6);
    GetParam().spoil(bad);
    client.send(bad);
    expect_status(client.status(), StatusCode::INVALID_ARGUMENT, GetParam().parts);
  }
  EXPECT_EQ(session_info(session).revision(), 1u);
  StreamClient again(stub(), session);
  ASSERT_TRUE(again.reader().wait_for([](const auto& m) { return m.has_opened() && m.opened().resumed(); }));
  again.send(view(7));
  EXPECT_TRUE(again.reader().wait_for_frame_end(7));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    Views, BadViewTest,
    testing::Values(BadView{"NanPosition",
                            [](pb::View& v) { v.mutable_camera()->mutable_position()->set_x(kNan); },
                            {"view.camera.position", "nan", "finite"}},
                    BadView{"InfiniteTarget",
                            [](pb::View& v) { v.mutable_camera()->mutable_look_at()->mutable_target()->set_y(kInf); },
                            {"view.camera.look_at.target", "inf", "finite"}},
                    BadView{"TargetIsPosition",
                            [](pb::View& v) { v.mutable_camera()->mutable_look_at()->mutable_target()->set_z(3); },
                            {"view.camera.look_at", "target"}},
                    BadView{"UpAlongView",
                            [](pb::View& v) { v.mutable_camera()->mutable_look_at()->mutable_up()->set_z(1); },
                            {"view.camera.look_at", "up", "parallel"}},
                    BadView{"NoTarget",
                            [](pb::View& v) { v.mutable_camera()->mutable_look_at()->clear_target(); },
                            {"view.camera.look_at.target", "required"}},
                    BadView{"NoPosition",
                            [](pb::View& v) { v.mutable_camera()->clear_position(); },
                            {"view.camera.position", "required"}},
                    BadView{"NoOrientation",
                            [](pb::View& v) { v.mutable_camera()->clear_look_at(); },
                            {"view.camera", "look_at, rotation, scene_camera"}},
                    BadView{"LongQuaternion",
                            [](pb::View& v) { v.mutable_camera()->mutable_rotation()->set_w(1.5); },
                            {"view.camera.rotation", "length 1.5", "0.001"}},
                    BadView{"NanQuaternion",
                            [](pb::View& v) { v.mutable_camera()->mutable_rotation()->set_w(kNan); },
                            {"view.camera.rotation", "nan"}},
                    BadView{"WideFov",
                            [](pb::View& v) { v.mutable_camera()->set_vertical_fov(3.2); },
                            {"view.camera.vertical_fov", "3.2", "[0.0017, 3.1242]"}},
                    BadView{"NegativeHeight",
                            [](pb::View& v) { v.mutable_camera()->set_orthographic_half_height(-1); },
                            {"view.camera.orthographic_half_height", "-1", "[1e-12, 1e12]"}},
                    BadView{"FovAndHeight",
                            [](pb::View& v) {
                              v.mutable_camera()->set_orthographic_half_height(1);
                              v.mutable_camera()->set_vertical_fov(1);
                            },
                            {"view.camera.vertical_fov", "orthographic_half_height"}},
                    BadView{"NegativeLens",
                            [](pb::View& v) { v.mutable_camera()->set_lens_radius(-0.1); },
                            {"view.camera.lens_radius", "-0.1", "[0, 1e12]"}},
                    BadView{"FarPosition",
                            [](pb::View& v) { v.mutable_camera()->mutable_position()->set_x(1e30); },
                            {"view.camera.position", "1e+30", "[-1e12, 1e12]"}},
                    BadView{"FarTarget",
                            [](pb::View& v) { v.mutable_camera()->mutable_look_at()->mutable_target()->set_x(1e150); },
                            {"view.camera.look_at.target", "1e+150", "[-1e12, 1e12]"}},
                    BadView{"HugeEverything",
                            [](pb::View& v) {
                              v.mutable_camera()->set_orthographic_half_height(1e300);
                              v.mutable_camera()->set_lens_radius(1e30);
                              v.mutable_camera()->set_focus_distance(1e300);
                            },
                            {"view.camera.orthographic_half_height: 1e+300", "view.camera.lens_radius: 1e+30",
                             "view.camera.focus_distance: 1e+300", "[1e-12, 1e12]", "[0, 1e12]"}},
                    BadView{"NanFocus",
                            [](pb::View& v) { v.mutable_camera()->set_focus_distance(kNan); },
                            {"view.camera.focus_distance", "nan"}},
                    BadView{"NoCamera", [](pb::View& v) { v.clear_camera(); }, {"view.camera", "required"}},
                    BadView{"UnknownSceneCamera",
                            [](pb::View& v) {
                              v.clear_camera();
                              v.mutable_camera()->set_scene_camera("back");
                            },
                            {"view.camera.scene_camera", "'back'", "0 to 0"}},
                    BadView{"SceneCameraAndMore",
                            [](pb::View& v) { v.mutable_camera()->set_scene_camera("front"); },
                            {"view.camera", "scene_camera alone"}},
                    BadView{"OldId", [](pb::View& v) { v.set_id(5); }, {"view.id", "5", "[6, 2^63)"}},
                    BadView{"ZeroId", [](pb::View& v) { v.set_id(0); }, {"view.id", "0", "[6, 2^63)"}},
                    BadView{"HugeId", [](pb::View& v) { v.set_id(1ull << 63); }, {"view.id", "9223372036854775808"}},
                    BadView{"Exposure", [](pb::View& v) { v.set_exposure(65); }, {"view.exposure", "65", "[-64, 64]"}},
                    BadView{"OtherTime", [](pb::View& v) { v.set_time_s(2); }, {"view.time_s", "2", "loaded at"}},
                    BadView{"AllAtOnce",
                            [](pb::View& v) {
                              v.set_id(1);
                              v.set_exposure(kNan);
                              v.mutable_camera()->set_vertical_fov(-1);
                              v.mutable_camera()->set_lens_radius(kInf);
                            },
                            {"view.id", "view.exposure", "view.camera.vertical_fov", "view.camera.lens_radius"}}),
    [](const auto& info) { return info.param.name; });

TEST_F(StreamTest, BadSettingsAndBudgetsAreRefusedByName) {
  struct Case {
    std::function<void(pb::StreamRequest&)> spoil;
    StatusCode code;
    std::vector<std::string> parts;
  };
  const auto settings = [](pb::StreamRequest& r) -> pb::RenderSettings& { return *r.mutable_settings(); };
  const auto budget = [](pb::StreamRequest& r) -> pb::Budget& { return *r.mutable_budget(); };
  const StatusCode invalid = StatusCode::INVALID_ARGUMENT;
  const std::vector<Case> cases = {
      {[&](auto& r) { settings(r).set_width(-1); }, invalid, {"settings.width", "-1", "[1, 65536]"}},
      {[&](auto& r) { settings(r).set_height(70000); }, invalid, {"settings.height", "70000", "[1, 65536]"}},
      {[&](auto& r) {
         settings(r).set_width(60000);
         settings(r).set_height(60000);
       },
       StatusCode::RESOURCE_EXHAUSTED,
       {"settings.width x height", "60000 x 60000", "max_film_pixels"}},
      {[&](auto& r) { settings(r).set_mode(pb::Mode(99)); }, invalid, {"settings.mode: unknown value 99", "MODE_PT"}},
      {[&](auto& r) { settings(r).set_max_segments(-2); }, invalid, {"settings.max_segments", "-2", "[1, 65535]"}},
      {[&](auto& r) { settings(r).set_roulette_from(70000); }, invalid, {"settings.roulette_from", "70000"}},
      {[&](auto& r) { settings(r).set_filter(pb::PixelFilter(9)); }, invalid, {"settings.filter: unknown value 9"}},
      {[&](auto& r) { settings(r).set_filter_scale(1); }, invalid, {"settings.filter_scale: 1", "0 with the box"}},
      {[&](auto& r) {
         settings(r).set_filter(pb::PIXEL_FILTER_TENT);
         settings(r).set_filter_scale(-3);
       },
       invalid,
       {"settings.filter_scale: -3", "(0, 16]"}},
      {[&](auto& r) {
         settings(r).set_filter(pb::PIXEL_FILTER_GAUSSIAN);
         settings(r).set_filter_scale(kNan);
       },
       invalid,
       {"settings.filter_scale: nan", "(0, 16]"}},
      {[&](auto& r) { settings(r).mutable_region()->set_x1(5); }, invalid, {"settings.region", "empty"}},
      {[&](auto& r) {
         settings(r).mutable_region()->set_x1(5000);
         settings(r).mutable_region()->set_y1(5);
       },
       invalid,
       {"settings.region", "5000", "not inside the film"}},
      {[&](auto& r) { budget(r).set_time_s(-1); }, invalid, {"budget.time_s", "-1"}},
      {[&](auto& r) { budget(r).set_time_s(kNan); }, invalid, {"budget.time_s", "nan"}},
      {[&](auto& r) { budget(r).set_samples(~0u); }, invalid, {"budget.samples", "4294967295", "1073741824"}},
      {[&](auto& r) { budget(r).set_error(kInf); }, invalid, {"budget.error", "inf"}},
      {[&](auto& r) { budget(r).set_bytes_per_second(-5); }, invalid, {"budget.bytes_per_second", "-5"}},
      {[&](auto& r) { budget(r).set_error_measure(pb::ErrorMeasure(7)); }, invalid, {"budget.error_measure: 7"}},
      {[&](auto& r) { budget(r).set_error_measure(pb::ERROR_MEASURE_RELMSE); },
       invalid,
       {"budget.error_measure: ERROR_MEASURE_RELMSE (2); allowed: ERROR_MEASURE_RMSE (1), or 0"}},
      {[&](auto& r) { settings(r).set_roulette(pb::RouletteRule(3)); },
       invalid,
       {"settings.roulette: unknown value 3; allowed: ROULETTE_RULE_ROOT (1), ROULETTE_RULE_THROUGHPUT (2), or 0"}},
      {[&](auto& r) { settings(r).mutable_light_cache()->set_shrinking(0.5); },
       invalid,
       {"settings.light_cache.shrinking: 0.5; allowed: 0.75, or 0"}},
      {[&](auto& r) { settings(r).mutable_technique()->set_unweighted(true); },
       invalid,
       {"settings.technique.unweighted: true; allowed: false"}},
      {[&](auto& r) { r.mutable_credit()->set_tiles(1); }, invalid, {"credit", "opened without credit"}},
      {[&](auto& r) { r.mutable_credit()->set_tiles(0); }, invalid, {"credit.tiles: 0", "[1, 65536]"}},
  };
  const std::string session = create_session(scene_, 16, 16, 1);
  for (const Case& bad : cases) {
    pb::StreamRequest request;
    bad.spoil(request);
    SCOPED_TRACE(request.ShortDebugString());
    StreamClient client(stub(), session);
    client.send(request);
    expect_status(client.status(), bad.code, bad.parts);
  }
  StreamClient client(stub());
  pb::StreamRequest open;
  open.mutable_open()->set_session_id(session);
  open.mutable_open()->set_credit(70000);
  open.mutable_open()->mutable_format()->set_pixel_type(pb::PixelType(9));
  open.mutable_open()->mutable_format()->set_compression(pb::Compression(99));
  client.send(open);
  expect_status(client.status(), invalid,
                {"open.credit: 70000", "open.format.pixel_type: unknown value 9", "open.format.compression"});
  EXPECT_EQ(session_info(session).settings().width(), 16) << "nothing was applied";
  EXPECT_EQ(session_info(session).revision(), 0u);
}

// ---- the session behind the stream
// -----------------------------------------------------------------------------------

TEST_F(StreamTest, NewestStreamTakesTheSessionOver) {
  const std::string session = create_session(scene_, 64, 64);
  StreamClient first(stub(), session);
  first.send(view(1));
  ASSERT_TRUE(first.reader().wait_for_tiles(1));
  StreamClient second(stub(), session);
  expect_status(first.status(), StatusCode::ABORTED, {session, "took", "over"});
  ASSERT_TRUE(second.reader().wait_for([](const auto& m) { return m.has_opened() && m.opened().resumed(); }));
  ASSERT_TRUE(second.reader().wait_for_tiles(1));
  second.send(view(2, 0.2));
  ASSERT_TRUE(second.reader().wait_for([](const auto& m) { return m.has_tile() && m.tile().tag().view_id() == 2; }));
  expect_no_stale_tiles(second.reader().messages());
}

TEST_F(StreamTest, SessionOutlivesAKilledClient) {
  const std::string session = create_session(scene_, 96, 96, 500);
  std::uint32_t samples = 0;
  {
    TcpRelay relay(server_->address());
    auto relayed = pb::RenderService::NewStub(grpc::CreateChannel(relay.address(), grpc::InsecureChannelCredentials()));
    StreamClient client(*relayed, session);
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_tiles(3));
    relay.cut();
    EXPECT_TRUE(eventually([&] { return !session_info(session).attached(); }));
    samples = session_info(session).progress().samples_per_pixel();
    EXPECT_GT(samples, 0u);
    client.status();
  }
  // Nobody listens: the frame waits.
  EXPECT_TRUE(comes_to_rest(session));
  EXPECT_GT(session_info(session).idle_s(), 0.05);

  StreamClient again(stub(), session);
  ASSERT_TRUE(again.reader().wait_for([](const auto& m) { return m.has_opened() && m.opened().resumed(); }));
  ASSERT_TRUE(again.reader().wait_for_frame_end(1)) << "the same view goes on to its budget";
  const auto messages = again.reader().messages();
  for (const auto& message : messages) {
    if (!message.has_tile()) continue;
    EXPECT_GE(message.tile().samples_per_pixel(), samples) << "no sample was lost";
  }
  EXPECT_EQ(messages.back().frame_end().totals().samples_per_pixel(), 500u);
}

TEST_F(StreamTest, ReattachedSessionShowsAFinishedPictureAgain) {
  const std::string session = create_session(scene_, 200, 100, 4);
  std::string first_pixels, second_pixels;
  const auto collect = [](const StreamClient& client, StreamReader& reader) {
    std::map<std::pair<int, int>, std::string> tiles;
    for (const auto& m : reader.messages()) {
      if (m.has_tile() && m.tile().final()) tiles[{m.tile().window().x0(), m.tile().window().y0()}] = m.tile().exr();
    }
    (void)client;
    std::string all;
    for (const auto& [corner, exr] : tiles) all += exr;
    return all;
  };
  {
    StreamClient client(stub(), session);
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(1));
    first_pixels = collect(client, client.reader());
  }
  StreamClient again(stub(), session);
  ASSERT_TRUE(again.reader().wait_for_frame_end(1));
  second_pixels = collect(again, again.reader());
  EXPECT_FALSE(first_pixels.empty());
  EXPECT_EQ(first_pixels, second_pixels) << "the same film gives the same bytes";
}

TEST_F(StreamTest, SessionEndsAfterItsGrace) {
  const std::string session = create_session(scene_, 16, 16, 1, 0.3);
  {
    StreamClient client(stub(), session);
    client.send(view(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    EXPECT_FALSE(session_info(session).session_id().empty()) << "grace does not run while a stream is open";
  }
  EXPECT_TRUE(eventually([&] { return session_info(session).session_id().empty(); }));
  StreamClient late(stub(), session);
  expect_status(late.status(), StatusCode::NOT_FOUND, {session});
}

TEST_F(StreamTest, HalfCloseEndsWithTheFrame) {
  StreamClient client(stub(), create_session(scene_, 200, 100, 8));
  client.send(view(1));
  client.half_close();
  EXPECT_TRUE(client.status().ok());
  ASSERT_FALSE(client.reader().messages().empty());
  EXPECT_TRUE(client.reader().messages().back().has_frame_end());
  EXPECT_EQ(client.reader().messages().back().frame_end().reason(), pb::END_REASON_SAMPLES);

  StreamClient endless(stub(), create_session(scene_, 64, 64));
  endless.send(view(1));
  ASSERT_TRUE(endless.reader().wait_for_tiles(1));
  endless.half_close();
  EXPECT_TRUE(endless.status().ok()) << "a frame without an end is not waited for";
}

TEST_F(StreamTest, CloseEndsTheStreamAndOnRequestTheSession) {
  const std::string session = create_session(scene_, 64, 64);
  pb::StreamRequest close;
  close.mutable_close();
  {
    StreamClient client(stub(), session);
    client.send(view(1));
    client.send(close);
    EXPECT_TRUE(client.status().ok());
  }
  EXPECT_EQ(session_info(session).session_id(), session);
  close.mutable_close()->set_close_session(true);
  {
    StreamClient client(stub(), session);
    client.send(close);
    EXPECT_TRUE(client.status().ok());
  }
  EXPECT_TRUE(session_info(session).session_id().empty());
}

TEST_F(StreamTest, CreditHoldsTilesBack) {
  StreamClient client(stub());
  pb::StreamRequest open;
  open.mutable_open()->set_session_id(create_session(scene_, 512, 256, 1));  // 8 tiles of 128 x 128
  open.mutable_open()->set_credit(2);
  client.send(open);
  client.start_reading();
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(2));
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  int tiles = 0;
  for (const auto& message : client.reader().messages()) {
    tiles += message.has_tile();
    EXPECT_FALSE(message.has_frame_end()) << "the end comes after the tiles";
  }
  EXPECT_EQ(tiles, 2);
  pb::StreamRequest credit;
  credit.mutable_credit()->set_tiles(100);
  client.send(credit);
  EXPECT_TRUE(client.reader().wait_for_frame_end(1));
}

TEST_F(StreamTest, BytesPerSecondPacesTheTiles) {
  StreamClient client(stub(), create_session(scene_, 256, 256));
  pb::Budget budget;
  budget.set_bytes_per_second(2e6);
  budget.set_time_s(1.5);
  client.send(budget);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  const auto messages = client.reader().messages();
  const auto times = client.reader().times();
  double bytes = 0, first = 0, last = 0;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    if (!messages[i].has_tile()) continue;
    if (first == 0) first = times[i];
    last = times[i];
    bytes += double(messages[i].tile().exr().size());
  }
  // A tile is about 0.26 MB and a burst may be a tenth of a second.
  EXPECT_LE(bytes, 2e6 * (last - first + 0.1) + 0.6e6);
  EXPECT_GE(bytes, 4 * 0.25e6) << "each tile came at least once";
}

TEST_F(StreamTest, AnotherRateTakesEffectWithinTheFrame) {
  StreamClient client(stub(), create_session(scene_, 256, 256));
  pb::Budget budget;
  budget.set_bytes_per_second(1);
  budget.set_samples(64);
  client.send(budget);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_LE(std::ranges::count_if(client.reader().messages(), [](const auto& m) { return m.has_tile(); }), 2);
  budget.set_bytes_per_second(0);
  client.send(budget);
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  int begins = 0, ends = 0;
  for (const auto& message : client.reader().messages()) {
    begins += message.has_frame_begin();
    ends += message.has_frame_end();
  }
  EXPECT_EQ(begins, 1);
  EXPECT_EQ(ends, 1);
}

TEST_F(StreamTest, ProgressComesWhileRendering) {
  StreamClient client(stub(), create_session(scene_, 256, 256));
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) { return m.has_progress(); }, 2));
  for (const auto& message : client.reader().messages()) {
    if (!message.has_progress()) continue;
    EXPECT_EQ(message.progress().tag().view_id(), 1u);
    EXPECT_GT(message.progress().samples_per_second(), 0);
  }
}

// ---- cancel, slow readers ------------------------------------------------------------------------------------------

// How soon: helio_bench cancel.
TEST_F(StreamTest, CancelAndDeadlineStopTheWork) {
  const std::string session = create_session(scene_, 256, 256);
  for (int i = 0; i < 5; ++i) {
    StreamClient client(stub(), session);
    client.send(view(i + 1, 0.01 * i));
    ASSERT_TRUE(client.reader().wait_for_tiles(1));
    client.cancel();
    EXPECT_TRUE(eventually([&] { return !session_info(session).attached(); }));
    EXPECT_TRUE(comes_to_rest(session)) << "workers go on after a cancel";
    EXPECT_EQ(client.status().error_code(), StatusCode::CANCELLED);
  }

  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(200));
  pb::WatchFramesRequest watch;
  watch.set_session_id(session);
  auto reader = stub().WatchFrames(&context, watch);
  pb::StreamResponse response;
  while (reader->Read(&response)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(eventually([&] { return !session_info(session).attached(); }));
  EXPECT_TRUE(comes_to_rest(session)) << "workers go on after a deadline";
}

TEST_F(StreamTest, SilentReaderCostsTwoFramesAndSlowsNobody) {
  const int side = 512;
  const std::string silent = create_session(scene_, side, side), lively = create_session(scene_, side, side);
  const std::uint64_t frame_bytes = std::uint64_t(side) * side * 16;  // six half channels and the counts as float
  const std::uint64_t film_bytes = session_info(silent).memory_bytes();
  auto other_channel_stub = new_stub();
  StreamClient client(*other_channel_stub, silent, /*read=*/false);
  StreamClient other(stub(), lively);
  other.send(view(1));
  client.send(view(1));
  // A tile is in flight and does not get through, of the fourth frame at the latest; the rest waits behind it.
  const auto tiles_wait = [&] { return session_info(silent).memory_bytes() > film_bytes + frame_bytes / 2; };
  ASSERT_TRUE(eventually(tiles_wait));
  for (int i = 2; i <= 30; ++i) {
    client.send(view(i, 0.01 * i));
    if (i <= 4) {
      ASSERT_TRUE(eventually(tiles_wait));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_LE(session_info(silent).memory_bytes(), film_bytes + 2 * frame_bytes + (1 << 20));
  }
  // Frames of the other one keep coming at the pace of its share.
  const auto before = session_info(lively);
  const auto silent_before = session_info(silent);
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const double lively_used = session_info(lively).used_seconds() - before.used_seconds();
  const double silent_used = session_info(silent).used_seconds() - silent_before.used_seconds();
  EXPECT_GE(lively_used, 0.8 * silent_used);
  const std::size_t seen = other.reader().messages().size();
  EXPECT_TRUE(other.reader().wait_for([](const auto& m) { return m.has_tile(); }, int(seen / 2)));

  client.start_reading();
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) { return m.has_tile() && m.tile().tag().view_id() == 30; }));
  expect_no_stale_tiles(client.reader().messages());
  std::set<std::uint64_t> views;
  for (const auto& message : client.reader().messages()) {
    if (message.has_frame_begin()) views.insert(message.frame_begin().tag().view_id());
  }
  EXPECT_LE(views.size(), 5u) << "frames that were never sent leave no trace";
}

}  // namespace
}  // namespace helio::test
