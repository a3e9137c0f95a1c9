// From a view sent to the first tile of its picture on the client, without the time that tracing the tile takes.
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "renderer/base/clock.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/film/estimate/resolve.h"
#include "tests/bench/commands/tile_tracing.h"
#include "tests/bench/peers/daemon_process.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace pb = heliograph::v1;

constexpr int kWidth = 1280, kHeight = 720;
constexpr double kFov = 0.6;  // radians, vertical

struct FirstTile {
  double seconds = 0;  // view sent -> tile received and decoded
  std::uint32_t samples = 0;
  DecodedTile pixels;
};

// The newest view's first tile and its frame's end, as the stream's thread sees them.
class Receiver {
 public:
  FrameCallbacks callbacks() {
    FrameCallbacks callbacks;
    callbacks.tile = [this](const pb::Tile& tile) { on_tile(tile); };
    callbacks.frame_end = [this](const pb::FrameEnd& end) {
      const std::lock_guard lock(mutex_);
      ended_view_ = end.tag().view_id();
      changed_.notify_all();
    };
    callbacks.ended = [this](const Status&) {
      const std::lock_guard lock(mutex_);
      over_ = true;
      changed_.notify_all();
    };
    return callbacks;
  }

  // Call before sending the view.
  void expect(std::uint64_t view_id) {
    const std::lock_guard lock(mutex_);
    view_id_ = view_id;
    tile_.reset();
    sent_ = now_s();
  }

  Result<FirstTile> wait_for_tile() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(60), [&] { return tile_ || over_; });
    if (!tile_) return Error{ErrorCode::unavailable, "no tile came within 60 s", "latency"};
    return *tile_;
  }

  Status wait_for_end() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(60), [&] { return ended_view_ == view_id_ || over_; });
    if (ended_view_ != view_id_) return Error{ErrorCode::unavailable, "no frame end came within 60 s", "latency"};
    return ok_status();
  }

 private:
  void on_tile(const pb::Tile& tile) {
    {
      const std::lock_guard lock(mutex_);
      if (tile.tag().view_id() != view_id_ || tile_) return;
    }
    auto decoded =
        decode_tile({reinterpret_cast<const std::uint8_t*>(tile.exr().data()), tile.exr().size()}, kWidth * kHeight);
    const double received = now_s();
    const std::lock_guard lock(mutex_);
    FirstTile first;
    first.seconds = received - sent_;
    first.samples = tile.samples_per_pixel();
    if (decoded) first.pixels = std::move(decoded).value();
    tile_ = std::move(first);
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t view_id_ = 0, ended_view_ = 0;
  double sent_ = 0;
  bool over_ = false;
  std::optional<FirstTile> tile_;
};

V3d camera_position(std::uint64_t view) {
  return {278 + 100 * std::sin(0.7 * double(view)), 273 + 60 * std::cos(0.9 * double(view)), -500};
}
const V3d kTarget{278, 273, 300};

pb::View make_view(std::uint64_t id) {
  pb::View view;
  view.set_id(id);
  pb::CameraView& camera = *view.mutable_camera();
  const V3d position = camera_position(id);
  camera.mutable_position()->set_x(position.x);
  camera.mutable_position()->set_y(position.y);
  camera.mutable_position()->set_z(position.z);
  pb::Vec3& target = *camera.mutable_look_at()->mutable_target();
  target.set_x(kTarget.x);
  target.set_y(kTarget.y);
  target.set_z(kTarget.z);
  camera.set_vertical_fov(kFov);
  return view;
}

// Traces the tile's samples again, here, with all threads and nothing around trace_window: the seconds of the quickest
// of three. Error when the pixels differ from those received by more than half's rounding.
class TileTracer {
 public:
  TileTracer(std::shared_ptr<const RenderScene> scene, int threads)
      : scene_(std::move(scene)), threads_(threads), film_(kWidth, kHeight) {}

  Result<double> trace(std::uint64_t view, const FirstTile& tile) {
    const auto pose = look_at(camera_position(view), kTarget, {0, 1, 0}, kFov);
    if (!pose) return pose.error();
    const Camera camera(pose.value(), kWidth, kHeight, scene_->origin());
    double best = 1e9;
    const PixelRect window = tile.pixels.header.data_window;
    for (int i = 0; i < 3; ++i) {
      for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
          for (int h = 0; h < kHalves; ++h) film_.half(h, x, y) = {};
          film_.features(x, y) = {};
        }
      }
      const auto traced = trace_picture(*scene_, camera, {}, int(tile.samples), window, threads_, film_);
      best = std::min(best, traced.seconds);
    }
    const Status same = compare(tile.pixels);
    if (!same) return same.error();
    return best;
  }

 private:
  Status compare(const DecodedTile& tile) const {
    const PixelRect window = tile.header.data_window;
    const std::vector<float>* received[3] = {tile.find("R"), tile.find("G"), tile.find("B")};
    if (window.empty() || !received[0] || !received[1] || !received[2]) {
      return Error{ErrorCode::internal, "the first tile is no picture", "latency"};
    }
    std::size_t i = 0;
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x, ++i) {
        const Rgb expected = resolve_mean(film_, x, y);
        for (int c = 0; c < 3; ++c) {
          const float tolerance = std::fabs(expected[c]) * 0x1p-11f + 0x1p-24f;
          if (std::fabs((*received[c])[i] - expected[c]) <= tolerance) continue;
          return Error{ErrorCode::internal,
                       "pixel (" + std::to_string(x) + ", " + std::to_string(y) + ") of the first tile is " +
                           std::to_string((*received[c])[i]) + ", traced again " + std::to_string(expected[c]),
                       "latency"};
        }
      }
    }
    return ok_status();
  }

  std::shared_ptr<const RenderScene> scene_;
  int threads_;
  Film film_;
};

struct Latencies {
  std::vector<double> total_ms, without_tracing_ms;
};

// `in_flight`: the previous picture is still being rendered when the view is sent; else its one sample is done.
Result<Latencies> measure(RenderClient& client, const std::string& scene_id, TileTracer& tracer, bool in_flight,
                          int views) {
  pb::CreateSessionRequest create;
  create.set_scene_id(scene_id);
  create.mutable_settings()->set_width(kWidth);
  create.mutable_settings()->set_height(kHeight);
  create.mutable_settings()->set_roulette_from(PathSettings().roulette_from);
  create.mutable_settings()->set_max_segments(PathSettings().max_segments);
  if (!in_flight) create.mutable_budget()->set_samples(1);
  const auto session = client.create_session(create);
  if (!session) return session.error();
  pb::StreamRequest::Open open;
  open.set_session_id(session.value().session_id());
  Receiver receiver;
  const auto stream = client.stream_frames(open, receiver.callbacks());

  std::vector<FirstTile> tiles;
  for (int view = 1; view <= views + 1; ++view) {  // the first one is the warm-up
    receiver.expect(std::uint64_t(view));
    if (const Status sent = stream->send_view(make_view(std::uint64_t(view))); !sent) return sent.error();
    auto tile = receiver.wait_for_tile();
    if (!tile) return tile.error();
    tiles.push_back(std::move(tile).value());
    if (in_flight) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    } else {
      if (const Status ended = receiver.wait_for_end(); !ended) return ended.error();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  (void)stream->close(true);
  (void)stream->wait();

  Latencies latencies;
  for (int view = 2; view <= views + 1; ++view) {
    const FirstTile& tile = tiles[std::size_t(view - 1)];
    const auto traced = tracer.trace(std::uint64_t(view), tile);
    if (!traced) return traced.error();
    latencies.total_ms.push_back(1e3 * tile.seconds);
    latencies.without_tracing_ms.push_back(1e3 * (tile.seconds - traced.value()));
  }
  return latencies;
}

void add(const std::string& name, const Latencies& latencies, std::optional<double> goal, Figures& figures) {
  figures.add({name, percentile(latencies.without_tracing_ms, 0.5), "ms", goal, Better::lower});
  figures.add({name + ".p99", percentile(latencies.without_tracing_ms, 0.99), "ms", std::nullopt, Better::lower});
  figures.add({name + ".with_tracing", percentile(latencies.total_ms, 0.5), "ms", std::nullopt, Better::lower});
}

}  // namespace

Status run_latency(BenchContext& context, Figures& figures) {
  const auto room = context.room();
  if (!room) {
    note(room.error().to_string());
    return ok_status();
  }
  auto scene = load_bench_scene(*room, context.options().threads);
  if (!scene) return scene.error();
  TileTracer tracer(std::move(scene).value(), context.options().threads);

  auto daemon = DaemonProcess::start(context.options(), context.folder());
  if (!daemon) return daemon.error();
  auto client = (*daemon)->connect();
  if (!client) return client.error();
  const auto scene_id = upload(**client, *room);
  if (!scene_id) return scene_id.error();

  const auto idle = measure(**client, scene_id.value(), tracer, false, context.options().views);
  if (!idle) return idle.error();
  add("latency.first_tile_ms", idle.value(), 15.0, figures);
  const auto in_flight = measure(**client, scene_id.value(), tracer, true, context.options().views);
  if (!in_flight) return in_flight.error();
  add("latency.first_tile_ms.in_flight", in_flight.value(), std::nullopt, figures);
  return ok_status();
}

}  // namespace helio::bench
