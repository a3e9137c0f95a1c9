// What it costs the daemon to resolve, encode and send ten pictures a second, and to tell its metrics or encrypt them
// meanwhile.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>

#include "renderer/base/clock.h"
#include "tests/bench/peers/child_process.h"
#include "tests/bench/peers/daemon_process.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace pb = heliograph::v1;

constexpr int kWidth = 640, kHeight = 360;
// A frame of two samples is published twice: after the first one and at its end. So 5 views make 10 pictures a second.
constexpr double kViewInterval = 0.2;
constexpr int kViewsPerRun = 25;
// What is measured is told per picture received, so a few frames that end early do not matter.
constexpr int kMostSuperseded = kViewsPerRun / 5;
constexpr double kPicturesPerSecond = 10;
constexpr double kCores = 2;  // that the share is told of
constexpr auto kScrapeInterval = std::chrono::seconds(1);

// A card of 64 x 36 squares with random vertex colours, unlit: one ray a sample, and noise in every pixel.
Status write_card(const std::filesystem::path& file) {
  constexpr int kColumns = 64, kRows = 36, kVertices = (kColumns + 1) * (kRows + 1);
  std::vector<float> positions, colors;
  std::vector<std::uint32_t> indices;
  std::uint32_t random = 1;
  for (int y = 0; y <= kRows; ++y) {
    for (int x = 0; x <= kColumns; ++x) {
      positions.insert(positions.end(), {3.2f * (float(x) / kColumns - 0.5f), 1.8f * (float(y) / kRows - 0.5f), 0});
      for (int c = 0; c < 3; ++c) {
        random = random * 1664525u + 1013904223u;
        colors.push_back(float(random >> 8) * 0x1p-24f);
      }
    }
  }
  for (std::uint32_t y = 0; y < kRows; ++y) {
    for (std::uint32_t x = 0; x < kColumns; ++x) {
      const std::uint32_t a = y * (kColumns + 1) + x, b = a + 1, c = a + kColumns + 1, d = c + 1;
      indices.insert(indices.end(), {a, b, d, a, d, c});
    }
  }
  const std::size_t vertex_bytes = positions.size() * 4, index_bytes = indices.size() * 4;
  using nlohmann::json;
  const json gltf = {
      {"asset", {{"version", "2.0"}}},
      {"extensionsUsed", {"KHR_materials_unlit"}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}}}},
      {"materials", {{{"doubleSided", true}, {"extensions", {{"KHR_materials_unlit", json::object()}}}}}},
      {"meshes",
       {{{"primitives", {{{"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}}, {"indices", 2}, {"material", 0}}}}}}},
      {"accessors",
       {{{"bufferView", 0},
         {"componentType", 5126},
         {"count", kVertices},
         {"type", "VEC3"},
         {"min", {-1.6, -0.9, 0}},
         {"max", {1.6, 0.9, 0}}},
        {{"bufferView", 1}, {"componentType", 5126}, {"count", kVertices}, {"type", "VEC3"}},
        {{"bufferView", 2}, {"componentType", 5125}, {"count", indices.size()}, {"type", "SCALAR"}}}},
      {"bufferViews",
       {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", vertex_bytes}},
        {{"buffer", 0}, {"byteOffset", vertex_bytes}, {"byteLength", vertex_bytes}},
        {{"buffer", 0}, {"byteOffset", 2 * vertex_bytes}, {"byteLength", index_bytes}}}},
      {"buffers", {{{"uri", "card.bin"}, {"byteLength", 2 * vertex_bytes + index_bytes}}}}};
  std::ofstream(file) << gltf.dump();
  std::ofstream binary(file.parent_path() / "card.bin", std::ios::binary);
  binary.write(reinterpret_cast<const char*>(positions.data()), std::streamsize(vertex_bytes));
  binary.write(reinterpret_cast<const char*>(colors.data()), std::streamsize(vertex_bytes));
  binary.write(reinterpret_cast<const char*>(indices.data()), std::streamsize(index_bytes));
  if (!binary.flush()) return Error{ErrorCode::internal, "cannot be written", file.string()};
  return ok_status();
}

// Added up by the stream's callbacks.
struct Received {
  std::mutex mutex;
  std::condition_variable frame_ended;
  std::int64_t pixels = 0;
  std::uint64_t bytes = 0;
  double tracing = 0, estimating = 0, others = 0;  // seconds of the frames' passes
  int frames = 0, superseded = 0;

  void clear() {
    const std::lock_guard lock(mutex);
    pixels = 0;
    bytes = 0;
    tracing = estimating = others = 0;
    frames = superseded = 0;
  }
  bool wait_for_frames(int count) {
    std::unique_lock lock(mutex);
    return frame_ended.wait_for(lock, std::chrono::seconds(10), [&] { return frames >= count; });
  }
};

// One request of a program such as Prometheus; the bytes of its answer, 0: it was none.
std::size_t scrape(const std::string& http_address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(std::uint16_t(std::stoi(http_address.substr(http_address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int peer = socket(AF_INET, SOCK_STREAM, 0);
  std::string answer;
  constexpr std::string_view kRequest = "GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  if (connect(peer, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
      send(peer, kRequest.data(), kRequest.size(), MSG_NOSIGNAL) == ssize_t(kRequest.size())) {
    char piece[4096];
    for (ssize_t n; (n = recv(peer, piece, sizeof piece, 0)) > 0;) answer.append(piece, std::size_t(n));
  }
  close(peer);
  return answer.starts_with("HTTP/1.1 200 ") ? answer.size() : 0;
}

// Asks for the metrics once a second while it lives.
class Scraper {
 public:
  explicit Scraper(std::string http_address)
      : thread_([this, address = std::move(http_address)] {
          std::unique_lock lock(mutex_);
          do {
            lock.unlock();
            (scrape(address) > 0 ? answered_ : failed_)++;
            lock.lock();
          } while (!over_.wait_for(lock, kScrapeInterval, [this] { return stop_; }));
        }) {}
  ~Scraper() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
      over_.notify_all();
    }
    thread_.join();
  }
  bool works() const { return answered_ > 0 && failed_ == 0; }

 private:
  std::mutex mutex_;
  std::condition_variable over_;
  bool stop_ = false;
  std::atomic<int> answered_ = 0, failed_ = 0;
  std::thread thread_;
};

void set_view(pb::View& view, std::uint64_t id) {
  view.set_id(id);
  pb::CameraView& camera = *view.mutable_camera();
  camera.mutable_position()->set_x(0.001 * double(id % 100));
  camera.mutable_position()->set_z(1);
  camera.mutable_look_at()->mutable_target();
}

struct Run {
  double seconds_per_picture = 0;  // processor time
  double estimating_per_picture = 0;
  double bytes_per_picture = 0;
};

struct CertificateFiles {
  std::string certificate, key;
};

// Of a daemon on this machine, signed by itself.
Result<CertificateFiles> make_certificate(const std::filesystem::path& folder) {
  CertificateFiles files{(folder / "daemon.pem").string(), (folder / "daemon.key").string()};
  auto made = ChildProcess::start({"openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256",
                                   "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                                   "subjectAltName=IP:127.0.0.1", "-keyout", files.key, "-out", files.certificate});
  if (!made) return made.error();
  if ((*made)->wait() != 0) return Error{ErrorCode::internal, "openssl made no certificate", files.certificate};
  return files;
}

// A daemon, and a client that receives what it renders.
class Streaming {
 public:
  // tls: of the client, where the daemon's options ask for it.
  static Result<std::unique_ptr<Streaming>> start(BenchContext& context, const std::filesystem::path& card,
                                                  const std::vector<std::string>& options, const TlsOptions& tls);
  ~Streaming() {
    if (!stream_) return;
    (void)stream_->close(true);
    (void)stream_->wait();
  }

  // A number of views at a steady pace, and their frames to the end. The daemon's processor time, less what its workers
  // spent on samples and error estimates: their time for the session (ListSessions), in the proportion of the frames'
  // passes.
  Result<Run> measure();
  const std::string& http_address() const { return http_address_; }

 private:
  Streaming() = default;

  std::unique_ptr<DaemonProcess> daemon_;
  std::unique_ptr<RenderClient> client_;
  Received received_;
  std::unique_ptr<FrameStream> stream_;
  std::string http_address_;
  std::uint64_t view_id_ = 0;
};

Result<std::unique_ptr<Streaming>> Streaming::start(BenchContext& context, const std::filesystem::path& card,
                                                    const std::vector<std::string>& options, const TlsOptions& tls) {
  std::unique_ptr<Streaming> made(new Streaming());
  Streaming& own = *made;
  auto daemon = DaemonProcess::start(context.options(), context.folder(), options);
  if (!daemon) return daemon.error();
  own.daemon_ = std::move(*daemon);
  auto connected = own.daemon_->connect(tls);
  if (!connected) return connected.error();
  own.client_ = std::move(*connected);
  RenderClient& client = *own.client_;
  const auto info = client.server_info();
  if (!info) return info.error();
  own.http_address_ = info.value().http_address();
  const auto scene = upload(client, card);
  if (!scene) return scene.error();

  pb::CreateSessionRequest create;
  create.set_scene_id(scene.value());
  create.mutable_settings()->set_width(kWidth);
  create.mutable_settings()->set_height(kHeight);
  create.mutable_budget()->set_samples(2);
  const auto session = client.create_session(create);
  if (!session) return session.error();

  FrameCallbacks callbacks;
  callbacks.tile = [&received = own.received_](const pb::Tile& tile) {
    const std::lock_guard lock(received.mutex);
    received.pixels +=
        std::int64_t(tile.window().x1() - tile.window().x0()) * (tile.window().y1() - tile.window().y0());
    received.bytes += tile.exr().size();
  };
  callbacks.frame_end = [&received = own.received_](const pb::FrameEnd& end) {
    const std::lock_guard lock(received.mutex);
    ++received.frames;
    received.superseded += end.reason() != pb::END_REASON_SAMPLES;
    received.frame_ended.notify_all();
    for (const pb::PassTime& pass : end.passes()) {
      double& seconds = pass.pass() == "integrate" ? received.tracing
                        : pass.pass() == "measure" ? received.estimating
                                                   : received.others;
      seconds += pass.seconds();
    }
  };
  pb::StreamRequest::Open open;
  open.set_session_id(session.value().session_id());
  open.mutable_format()->set_pixel_type(pb::PIXEL_TYPE_HALF);
  open.mutable_format()->set_compression(pb::COMPRESSION_NONE);
  own.stream_ = client.stream_frames(open, callbacks);
  return made;
}

Result<Run> Streaming::measure() {
  const auto used_seconds = [&]() -> Result<double> {
    const auto sessions = client_->list_sessions();
    if (!sessions) return sessions.error();
    return sessions.value().sessions(0).used_seconds();
  };
  received_.clear();
  const auto used_before = used_seconds();
  if (!used_before) return used_before.error();
  const double cpu_before = daemon_->cpu_seconds(), started = now_s();
  for (int i = 0; i < kViewsPerRun; ++i) {
    pb::View view;
    set_view(view, ++view_id_);
    if (const Status sent = stream_->send_view(view); !sent) return sent.error();
    const double next = started + (i + 1) * kViewInterval;
    std::this_thread::sleep_for(std::chrono::duration<double>(std::max(0.0, next - now_s())));
  }
  const bool complete = received_.wait_for_frames(kViewsPerRun);
  const double cpu = daemon_->cpu_seconds() - cpu_before;
  const auto used_after = used_seconds();
  if (!used_after) return used_after.error();

  const std::lock_guard lock(received_.mutex);
  if (!complete || received_.superseded > kMostSuperseded) {
    return Error{ErrorCode::internal,
                 std::to_string(received_.superseded) + " of " + std::to_string(kViewsPerRun) +
                     " frames were not done in time: the machine is too slow or too busy for this figure",
                 "stream"};
  }
  const double per_pass_second =
      (used_after.value() - used_before.value()) / (received_.tracing + received_.estimating + received_.others);
  const double tracing = received_.tracing * per_pass_second, estimating = received_.estimating * per_pass_second;
  const double pictures = double(received_.pixels) / (kWidth * kHeight);
  return Run{(cpu - tracing - estimating) / pictures, estimating / pictures, double(received_.bytes) / pictures};
}

}  // namespace

Status run_stream(BenchContext& context, Figures& figures) {
  const std::filesystem::path card = context.folder() / "card.gltf";
  if (const Status written = write_card(card); !written) return written;
  TlsOptions tls;
  const auto certificate = make_certificate(context.folder());
  if (!certificate) return certificate.error();
  tls.on = true;
  tls.ca_file = certificate->certificate;
  auto plain = Streaming::start(context, card, {"--http", "127.0.0.1:0"}, {});
  if (!plain) return plain.error();
  auto encrypted = Streaming::start(
      context, card, {"--tls-certificate", certificate->certificate, "--tls-key", certificate->key}, tls);
  if (!encrypted) return encrypted.error();

  std::vector<double> share, scraped_share, encrypted_share, estimates, rate;
  for (int i = -1; i < context.options().repeat; ++i) {
    // In turns, so that what else the machine does disturbs all alike.
    const auto run = (*plain)->measure();
    if (!run) return run.error();
    const auto scraped = [&]() -> Result<Run> {
      const Scraper scraper((*plain)->http_address());
      auto run = (*plain)->measure();
      if (run && !scraper.works()) return Error{ErrorCode::internal, "/metrics gave no answer", "stream"};
      return run;
    }();
    if (!scraped) return scraped.error();
    const auto secret = (*encrypted)->measure();
    if (!secret) return secret.error();
    if (i < 0) continue;  // warm-up
    scraped_share.push_back(scraped.value().seconds_per_picture / run.value().seconds_per_picture);
    encrypted_share.push_back(secret.value().seconds_per_picture / run.value().seconds_per_picture);
    share.push_back(100 * run.value().seconds_per_picture * kPicturesPerSecond / kCores);
    estimates.push_back(100 * run.value().estimating_per_picture * kPicturesPerSecond / kCores);
    rate.push_back(1e-6 * run.value().bytes_per_picture * kPicturesPerSecond);
  }
  figures.add({"stream.cpu_share", median(share), "%", 4.0, Better::lower});
  figures.add({"stream.cpu_share.scraped", median(scraped_share), "x", 1.15, Better::lower});
  figures.add({"stream.cpu_share.tls", median(encrypted_share), "x", 1.15, Better::lower});
  figures.add({"stream.cpu_share.of_error_estimates", median(estimates), "%", std::nullopt, Better::lower});
  figures.add({"stream.megabytes_per_second", median(rate), "MB/s", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace helio::bench
