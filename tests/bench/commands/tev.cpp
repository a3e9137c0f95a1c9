// What --tev costs: the sender's thread at ten whole pictures a second, and at the four that the daemon publishes at
// most; rendering with a viewer that is absent, reads nothing, or reads.
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/tev/tev_bridge.h"
#include "renderer/base/clock.h"
#include "renderer/codec/tile_codec.h"
#include "tests/bench/peers/child_process.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace fs = std::filesystem;
namespace pb = heliograph::v1;

constexpr int kWidth = 1280, kHeight = 720;
constexpr int kTile = 128;  // side of the daemon's tiles
constexpr double kRunSeconds = 3;

// Listens, and reads what comes, or nothing, on a thread of its own.
class Viewer {
 public:
  explicit Viewer(bool reads) : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof name;
    usable_ = bind(listener_, reinterpret_cast<const sockaddr*>(&name), size) == 0 && listen(listener_, 4) == 0 &&
              getsockname(listener_, reinterpret_cast<sockaddr*>(&name), &size) == 0;
    address_ = "127.0.0.1:" + std::to_string(ntohs(name.sin_port));
    thread_ = std::thread([this, reads] { run(reads); });
  }
  ~Viewer() {
    stopping_ = true;
    thread_.join();
    close(listener_);
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  bool usable() const { return usable_; }
  const std::string& address() const { return address_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  void run(bool reads) {
    std::vector<int> connections;
    std::vector<char> buffer(1 << 20);
    while (usable_ && !stopping_) {
      std::vector<pollfd> wanted{{listener_, POLLIN, 0}};
      for (const int connection : connections) wanted.push_back({reads ? connection : -1, POLLIN, 0});
      if (poll(wanted.data(), wanted.size(), 50) <= 0) continue;
      for (std::size_t i = 1; i < wanted.size(); ++i) {
        if (wanted[i].revents == 0) continue;
        const ssize_t got = recv(wanted[i].fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
        if (got > 0) bytes_ += std::uint64_t(got);
        if (got != 0) continue;
        close(wanted[i].fd);
        std::erase(connections, wanted[i].fd);
      }
      if (wanted[0].revents != 0) connections.push_back(accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC));
    }
    for (const int connection : connections) close(connection);
  }

  int listener_;
  bool usable_ = false;
  std::string address_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> bytes_{0};
  std::thread thread_;
};

// The tiles of a picture as the daemon sends them in process: not compressed, floats, with variance and samples.
Result<std::vector<pb::Tile>> make_tiles(bool display) {
  std::vector<std::string> names{"R", "G", "B", "variance.R", "variance.G", "variance.B", "samples"};
  if (display) names.insert(names.end(), {"display.R", "display.G", "display.B", "display.error"});
  std::vector<pb::Tile> tiles;
  for (int y = 0; y < kHeight; y += kTile) {
    for (int x = 0; x < kWidth; x += kTile) {
      const PixelRect window{x, y, std::min(x + kTile, kWidth), std::min(y + kTile, kHeight)};
      std::vector<float> plane;
      for (std::int64_t i = 0; i < window.area(); ++i) plane.push_back(float(i % 977) * 0.01f);
      std::vector<TileChannel> channels;
      for (const std::string& name : names) channels.push_back({name, plane.data()});
      const auto exr =
          encode_tile({window, kWidth, kHeight}, channels, {TilePixelType::float32, TileCompression::none});
      if (!exr) return exr.error();
      pb::Tile& tile = tiles.emplace_back();
      tile.mutable_exr()->assign(exr->begin(), exr->end());
      tile.mutable_window()->set_x0(window.x0);
      tile.mutable_window()->set_y0(window.y0);
      tile.mutable_window()->set_x1(window.x1);
      tile.mutable_window()->set_y1(window.y1);
    }
  }
  return tiles;
}

double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

struct Shares {
  double sender = 0, feeding = 0;  // of a core
  double updates_per_s = 0;
};

Result<Shares> send_pictures(bool display, int per_second) {
  const auto tiles = make_tiles(display);
  if (!tiles) return tiles.error();
  Viewer viewer(true);
  if (!viewer.usable()) return Error{ErrorCode::internal, "no socket can be opened", "tev"};
  const auto address = resolve_tev_address(viewer.address());
  if (!address) return address.error();
  pb::TileFormat format;
  format.set_display(display);
  std::string warning;
  TevBridge bridge(*address, format, [&](const std::string& text) { warning = text; });
  bridge.set_name("bench", "1");
  pb::RenderSettings settings;
  settings.set_width(kWidth);
  settings.set_height(kHeight);
  if (const Status begun = bridge.begin(settings); !begun) return begun.error();
  double feeding = 0, begun_s = 0;
  TevReport before;
  for (int i = -3; i < int(kRunSeconds * per_second); ++i) {  // the first three warm up
    if (i == 0) {
      before = bridge.report();
      begun_s = now_s();
      feeding = 0;
    }
    const double start_s = now_s(), cpu_s = thread_seconds();
    for (const pb::Tile& tile : *tiles) bridge.add(tile);
    feeding += thread_seconds() - cpu_s;
    const double left_s = 1.0 / per_second - (now_s() - start_s);
    if (left_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(left_s));
  }
  const double spent_s = now_s() - begun_s;
  const TevReport after = bridge.report();
  if (!after.warning.empty()) return Error{ErrorCode::internal, after.warning, "tev"};
  return Shares{(after.thread_seconds - before.thread_seconds) / spent_s, feeding / spent_s,
                double(after.updates - before.updates) / spent_s};
}

// Paths a second of a render of three seconds; `address`: of --tev; empty: without.
Result<double> paths_per_second(BenchContext& context, const std::string& address) {
  const BenchOptions& options = context.options();
  std::vector<std::string> line{(fs::path(options.daemon).parent_path() / "heliograph").string(),
                                "render",
                                context.cornell().string(),
                                "--size",
                                std::to_string(kWidth) + "x" + std::to_string(kHeight),
                                "--time",
                                "3",
                                "--threads",
                                std::to_string(options.threads),
                                "--progress",
                                "never",
                                "--json",
                                "--output",
                                (context.folder() / "tev.exr").string()};
  if (!address.empty()) line.insert(line.end(), {"--tev", address});
  auto render = ChildProcess::start(line);
  if (!render) return render.error();
  std::string text;
  for (auto told = (*render)->read_line(); told; told = (*render)->read_line()) text += *told + "\n";
  if (const int code = (*render)->wait(); code != 0)
    return Error{ErrorCode::internal, "heliograph render ended with " + std::to_string(code), "tev"};
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json["paths"].is_number() || !json["render_seconds"].is_number())
    return Error{ErrorCode::internal, "heliograph render did not tell its paths", "tev"};
  if (!address.empty() && !json["tev"].is_object())
    return Error{ErrorCode::internal, "heliograph render did not tell of tev", "tev"};
  return json["paths"].get<double>() / json["render_seconds"].get<double>();
}

}  // namespace

Status run_tev(BenchContext& context, Figures& figures) {
  struct Load {
    const char* name;
    bool display;
    int per_second;
    std::optional<double> goal;
  };
  const Load loads[] = {{"tev.at_10", false, 10, 0.03},
                        {"tev.at_4", false, 4, std::nullopt},
                        {"tev.display_at_10", true, 10, std::nullopt}};
  for (const Load& load : loads) {
    std::vector<double> sender, feeding, updates;
    for (int i = 0; i < context.options().repeat; ++i) {
      const auto shares = send_pictures(load.display, load.per_second);
      if (!shares) return shares.error();
      sender.push_back(shares->sender);
      feeding.push_back(shares->feeding);
      updates.push_back(shares->updates_per_s);
    }
    const std::string name = load.name;
    figures.add({name + ".sender_share", median(sender), "", load.goal});
    figures.add({name + ".feeding_share", median(feeding), "", std::nullopt});
    figures.add({name + ".updates_per_s", median(updates), "1/s", std::nullopt, Better::higher});
  }
  std::string nobody;
  {
    const Viewer gone(false);
    nobody = gone.address();
  }
  const Viewer blocked(false), reading(true);
  if (!blocked.usable() || !reading.usable()) return Error{ErrorCode::internal, "no socket can be opened", "tev"};
  const std::pair<const char*, std::string> kinds[] = {
      {"absent", nobody}, {"blocked", blocked.address()}, {"connected", reading.address()}};
  std::vector<double> ratios[3];
  for (int i = 0; i < context.options().repeat; ++i) {
    for (std::size_t kind = 0; kind < 3; ++kind) {
      // Before and after, in turns: machines get slower and faster.
      const auto before = paths_per_second(context, ""), with = paths_per_second(context, kinds[kind].second),
                 after = paths_per_second(context, "");
      if (!before || !with || !after) return (!before ? before : !with ? with : after).error();
      ratios[kind].push_back(2 * *with / (*before + *after));
    }
  }
  for (std::size_t kind = 0; kind < 3; ++kind) {
    figures.add(
        {std::string("tev.rate_over_none.") + kinds[kind].first, median(ratios[kind]), "x", 0.97, Better::higher});
  }
  if (reading.bytes() == 0) return Error{ErrorCode::internal, "nothing was sent to the viewer", "tev"};
  return ok_status();
}

}  // namespace helio::bench
