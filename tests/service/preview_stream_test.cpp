// Previews on the wire: whole pictures while the camera moves, and the film apart from them.
#include <map>
#include <set>
#include <thread>

#include "renderer/codec/checksum.h"
#include "renderer/codec/jpeg_file.h"
#include "renderer/codec/tile_codec.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

constexpr int kWidth = 200, kHeight = 152;

// The messages of one frame.
struct SeenFrame {
  pb::FrameBegin begin;
  std::vector<pb::Tile> tiles;
  std::optional<pb::FrameEnd> end;

  std::int64_t area() const {  // of different tiles
    std::int64_t pixels = 0;
    std::set<std::pair<int, int>> corners;
    for (const pb::Tile& tile : tiles) {
      const pb::Rect& w = tile.window();
      if (corners.emplace(w.x0(), w.y0()).second) pixels += std::int64_t(w.x1() - w.x0()) * (w.y1() - w.y0());
    }
    return pixels;
  }
};

// By number; each message must belong to the frame that begun last.
std::map<std::uint64_t, SeenFrame> frames_of(const std::vector<pb::StreamResponse>& messages) {
  std::map<std::uint64_t, SeenFrame> frames;
  std::uint64_t newest = 0;
  for (const pb::StreamResponse& message : messages) {
    if (message.has_frame_begin()) {
      EXPECT_GT(message.frame_begin().tag().frame(), newest);
      newest = message.frame_begin().tag().frame();
      frames[newest].begin = message.frame_begin();
    } else if (message.has_tile()) {
      EXPECT_EQ(message.tile().tag().frame(), newest);
      EXPECT_EQ(message.tile().preview(), frames[newest].begin.preview());
      frames[newest].tiles.push_back(message.tile());
    } else if (message.has_frame_end()) {
      EXPECT_EQ(message.frame_end().tag().frame(), newest);
      frames[newest].end = message.frame_end();
    }
  }
  return frames;
}

std::uint32_t crc32_of_string(const std::string& bytes) {
  return crc32_of(bytes.data(), bytes.size());
}

class PreviewStream : public ServiceTest {
 protected:
  void SetUp() override {
    start();
    scene_ = load_quad(0.25);
  }
  std::string create_previewing(double rate = 120, std::uint32_t samples = 4) {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene_);
    *request.mutable_settings() = settings(rate);
    request.mutable_budget()->set_samples(samples);
    pb::CreateSessionResponse response;
    const grpc::Status status = create(request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.session_id();
  }
  static pb::RenderSettings settings(double rate) {
    pb::RenderSettings settings;
    settings.set_width(kWidth);
    settings.set_height(kHeight);
    settings.set_preview_rate(rate);
    settings.set_preview_budget_ms(5);
    return settings;
  }
  static pb::StreamRequest open(const std::string& session) {
    pb::StreamRequest request;
    request.mutable_open()->set_session_id(session);
    return request;
  }
  static bool wait_for_film(StreamClient& client, std::uint64_t view) {
    return client.reader().wait_for([&](const pb::StreamResponse& message) {
      return message.has_frame_end() && message.frame_end().tag().view_id() >= view &&
             message.frame_end().reason() == pb::END_REASON_SAMPLES;
    });
  }
  std::string scene_;
};

TEST_F(PreviewStream, AWholePreviewComesBeforeTheFilm) {
  StreamClient client(stub(), create_previewing());
  client.send(view(7));
  ASSERT_TRUE(wait_for_film(client, 7));
  const auto frames = frames_of(client.reader().messages());
  ASSERT_EQ(frames.size(), 2u);
  const auto& [number, preview] = *frames.begin();
  EXPECT_TRUE(preview.begin.preview());
  EXPECT_EQ(preview.begin.tag().view_id(), 7u);
  EXPECT_EQ(preview.begin.settings().preview_rate(), 120);
  EXPECT_EQ(preview.area(), kWidth * kHeight);
  std::uint64_t bytes = 0;
  for (const pb::Tile& tile : preview.tiles) {
    bytes += tile.exr().size();
    EXPECT_TRUE(tile.final());
    EXPECT_EQ(tile.pass(), 0u);
    EXPECT_EQ(tile.samples_per_pixel(), 0u);
    EXPECT_TRUE(tile.jpeg().empty());
    EXPECT_EQ(tile.crc32(), crc32_of_string(tile.exr()));
    const auto pixels =
        decode_tile({reinterpret_cast<const std::uint8_t*>(tile.exr().data()), tile.exr().size()}, 1 << 20);
    ASSERT_TRUE(pixels.ok()) << pixels.error().to_string();
    EXPECT_EQ(pixels->names, (std::vector<std::string>{"display.B", "display.G", "display.R"}));
    const PixelRect& window = pixels->header.data_window;
    if (!window.contains(100, 75)) continue;
    const std::size_t middle = std::size_t(75 - window.y0) * std::size_t(window.width()) + std::size_t(100 - window.x0);
    EXPECT_EQ((*pixels->find("display.R"))[middle], 0.25f) << "the square emits 0.25 and reflects nothing";
  }
  ASSERT_TRUE(preview.end);
  EXPECT_EQ(preview.end->reason(), pb::END_REASON_PREVIEW);
  EXPECT_EQ(preview.end->bytes_sent(), bytes);
  EXPECT_EQ(preview.end->dropped_tiles(), 0u);
  EXPECT_EQ(preview.end->totals().samples_per_pixel(), 0u);
  EXPECT_GT(preview.end->first_tile_seconds(), 0);
  const SeenFrame& film = frames.rbegin()->second;
  EXPECT_FALSE(film.begin.preview());
  EXPECT_EQ(film.end->totals().samples_per_pixel(), 4u);
  EXPECT_EQ(film.area(), kWidth * kHeight);
}

TEST_F(PreviewStream, JpegHasTheViewsExposure) {
  pb::StreamRequest request = open(create_previewing());
  request.mutable_open()->mutable_format()->set_preview_jpeg(90);
  StreamClient client(stub());
  client.send(request);
  client.start_reading();
  pb::View bright = view(1), dark = view(2, 0.1);
  bright.set_exposure(40);
  dark.set_exposure(-40);  // black to the last bit
  client.send(bright);
  ASSERT_TRUE(wait_for_film(client, 1));
  client.send(dark);
  ASSERT_TRUE(wait_for_film(client, 2));
  int dark_tiles = 0, bright_tiles = 0;
  for (const auto& [number, frame] : frames_of(client.reader().messages())) {
    for (const pb::Tile& tile : frame.tiles) {
      EXPECT_EQ(tile.exr().empty(), frame.begin.preview());
      EXPECT_EQ(tile.jpeg().empty(), !frame.begin.preview());
      EXPECT_EQ(tile.crc32(), tile.exr().empty() ? 0 : crc32_of_string(tile.exr()));
      EXPECT_EQ(tile.jpeg_crc32(), tile.jpeg().empty() ? 0 : crc32_of_string(tile.jpeg()));
      if (!frame.begin.preview()) continue;
      const int width = tile.window().x1() - tile.window().x0(), height = tile.window().y1() - tile.window().y0();
      const auto black = encode_jpeg(width, height, std::vector<std::uint8_t>(std::size_t(3 * width * height)), 90);
      const bool is_black = tile.jpeg() == std::string(black->begin(), black->end());
      const bool is_dark = frame.begin.tag().view_id() == 2;
      EXPECT_TRUE(is_black || !is_dark);
      ++(is_dark ? dark_tiles : bright_tiles);
      EXPECT_TRUE(!is_black || is_dark || tile.window().x0() > 0 || tile.window().y0() > 0) << "the middle is white";
    }
  }
  EXPECT_EQ(dark_tiles, bright_tiles);
  EXPECT_GT(dark_tiles, 0);
}

TEST_F(PreviewStream, AReaderThatStopsGetsWholePreviewsAndTheNewestView) {
  StreamClient client(stub(), create_previewing(), /*read=*/false);
  for (std::uint64_t i = 1; i <= 25; ++i) {
    client.send(view(i, 0.01 * double(i)));
    std::this_thread::sleep_for(std::chrono::milliseconds(6));
  }
  client.start_reading();
  ASSERT_TRUE(wait_for_film(client, 25));
  std::uint64_t shown = 0, previews = 0;
  for (const auto& [number, frame] : frames_of(client.reader().messages())) {
    if (!frame.begin.preview()) continue;
    ++previews;
    EXPECT_GT(frame.begin.tag().view_id(), shown);
    shown = frame.begin.tag().view_id();
    EXPECT_EQ(frame.area(), kWidth * kHeight);
    ASSERT_TRUE(frame.end);
    EXPECT_EQ(frame.end->reason(), pb::END_REASON_PREVIEW);
  }
  EXPECT_EQ(shown, 25u);
  EXPECT_GE(previews, 2u);
}

TEST_F(PreviewStream, PreviewTilesCostCredit) {
  pb::StreamRequest request = open(create_previewing());
  request.mutable_open()->set_credit(1);
  StreamClient client(stub());
  client.send(request);
  client.start_reading();
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  EXPECT_FALSE(frames_of(client.reader().messages()).rbegin()->second.end);
  pb::StreamRequest credit;
  credit.mutable_credit()->set_tiles(1000);
  client.send(credit);
  ASSERT_TRUE(wait_for_film(client, 1));
  const auto frames = frames_of(client.reader().messages());
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames.begin()->second.area(), kWidth * kHeight);
}

TEST_F(PreviewStream, HalfClosingWaitsForTheFilmBehindThePreview) {
  StreamClient client(stub(), create_previewing());
  client.send(view(1));
  client.half_close();
  EXPECT_TRUE(client.status().ok());
  const auto frames = frames_of(client.reader().messages());
  ASSERT_EQ(frames.size(), 2u);
  ASSERT_TRUE(frames.rbegin()->second.end);
  EXPECT_EQ(frames.rbegin()->second.end->reason(), pb::END_REASON_SAMPLES);
}

TEST_F(PreviewStream, AStreamThatTakesOverGetsTheFilmWhateverWasInFlight) {
  for (int wait_ms = 0; wait_ms < 20; wait_ms += 4) {
    const std::string session = create_previewing();
    StreamClient first(stub(), session);
    first.send(view(1));
    ASSERT_TRUE(first.reader().wait_for([](const pb::StreamResponse& message) { return message.has_frame_begin(); }));
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    StreamClient second(stub(), session);
    ASSERT_TRUE(wait_for_film(second, 1)) << wait_ms;
    const auto frames = frames_of(second.reader().messages());
    EXPECT_EQ(frames.rbegin()->second.area(), kWidth * kHeight);
    for (const auto& [number, frame] : frames) {
      EXPECT_TRUE(!frame.begin.preview() || frame.area() == kWidth * kHeight);
    }
  }
}

TEST_F(PreviewStream, PreviewsAreSwitchedOnWithinAStream) {
  StreamClient client(stub(), create_previewing(0));
  client.send(view(1));
  ASSERT_TRUE(wait_for_film(client, 1));
  pb::StreamRequest on;
  *on.mutable_settings() = settings(120);
  client.send(on);
  client.send(view(2, 0.1));
  ASSERT_TRUE(wait_for_film(client, 2));
  for (const auto& [number, frame] : frames_of(client.reader().messages()))
    EXPECT_TRUE(!frame.begin.preview() || frame.begin.tag().view_id() == 2);
  EXPECT_TRUE(client.reader().wait_for([](const pb::StreamResponse& m) { return m.frame_begin().preview(); }));
}

TEST_F(PreviewStream, ValuesOutOfRangeAreRefused) {
  pb::CreateSessionRequest request;
  request.set_scene_id(scene_);
  *request.mutable_settings() = settings(-1);
  request.mutable_settings()->set_preview_budget_ms(1001);
  pb::CreateSessionResponse created;
  expect_status(create(request, &created), grpc::StatusCode::INVALID_ARGUMENT,
                {"settings.preview_rate: -1; allowed: [0, 120]", "settings.preview_budget_ms: 1001", "[5, 1000]"});
}

}  // namespace
}  // namespace helio::test
