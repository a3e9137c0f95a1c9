// Libraries and their rooms depend downward only: holds every #include of the product to a list per folder (the table
// is in ARCHITECTURE.md). What is not listed is refused, so that a new dependency is a decision.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Rule {
  std::set<std::string> folders;  // of ours, besides itself; with '/' at its end: all that are in it
  // Headers of libraries and the system: one, or all that begin with a name that ends in '/' or '*'. C++'s own need no
  // entry.
  std::vector<std::string> headers;
};

// The parts of protobuf that are documented to stay; google/protobuf/wire_format.h for one is not.
const std::string kProtobuf = "google/protobuf/";

const std::map<std::string, Rule> kRules = {
    {"renderer/base",
     {{},
      {"ImathBox.h", "ImathMatrix.h", "ImathVec.h", "nlohmann/json.hpp", "arpa/inet.h", "cpuid.h", "emmintrin.h",
       "fcntl.h", "stdint.h", "string.h", "unistd.h"}}},
    {"renderer/metrics", {{"renderer/base"}, {}}},
    {"renderer/comparison", {{"renderer/base", "renderer/metrics"}, {}}},
    {"renderer/codec",
     {{"renderer/base"},
      {"Iex.h", "Imf*", "half.h", "openexr.h", "OpenImageIO/", "libdeflate.h", "openssl/bio.h", "openssl/err.h",
       "openssl/evp.h", "openssl/pem.h", "openssl/x509.h", "turbojpeg.h", "immintrin.h", "fcntl.h", "sys/stat.h",
       "unistd.h"}}},

    {"renderer/film/core", {{"renderer/base"}, {}}},
    {"renderer/film/splats", {{"renderer/base", "renderer/film/core"}, {}}},
    {"renderer/film/copy", {{"renderer/base", "renderer/film/core", "renderer/film/splats"}, {}}},
    {"renderer/film/history", {{"renderer/base", "renderer/film/core", "renderer/film/splats"}, {}}},
    {"renderer/film/estimate",
     {{"renderer/base", "renderer/film/core", "renderer/film/splats", "renderer/film/history"}, {}}},
    {"renderer/film/allocation",
     {{"renderer/base", "renderer/film/core", "renderer/film/splats", "renderer/film/history",
       "renderer/film/estimate"},
      {}}},
    {"renderer/film/display",
     {{"renderer/base", "renderer/film/core", "renderer/film/splats", "renderer/film/history",
       "renderer/film/estimate"},
      {"dlfcn.h"}}},
    {"renderer/film", {{"renderer/base", "renderer/film/"}, {}}},

    {"renderer/scene/description", {{"renderer/base"}, {"fcntl.h", "sys/stat.h", "unistd.h"}}},
    {"renderer/scene/images",
     {{"renderer/base", "renderer/scene/description"},
      {"OpenImageIO/", "Iex.h", "Imf*", "half.h", "spdlog/fmt/fmt.h", "spng.h"}}},
    {"renderer/scene/gltf/document",
     {{"renderer/base", "renderer/scene/description"},
      {"absl/strings/", "nlohmann/json.hpp", "nlohmann/json_fwd.hpp", "spdlog/fmt/fmt.h"}}},
    {"renderer/scene/gltf",
     {{"renderer/base", "renderer/scene/description", "renderer/scene/images", "renderer/scene/gltf/document"},
      {"draco/", "meshoptimizer.h"}}},
    {"renderer/scene/mitsuba",
     {{"renderer/base", "renderer/scene/description", "renderer/scene/images"},
      {"pugixml.hpp", "spdlog/fmt/fmt.h", "zlib.h"}}},
    {"renderer/scene/load", {{"renderer/base", "renderer/scene/"}, {"spdlog/fmt/fmt.h"}}},

    {"renderer/trace/sampling", {{"renderer/base"}, {}}},
    {"renderer/trace/bsdf", {{"renderer/base", "renderer/scene/description", "renderer/trace/sampling"}, {}}},
    {"renderer/trace/camera",
     {{"renderer/base", "renderer/scene/description", "renderer/trace/sampling"}, {"spdlog/fmt/fmt.h"}}},
    {"renderer/trace/lights", {{"renderer/base", "renderer/scene/", "renderer/trace/sampling"}, {}}},
    {"renderer/trace/accel",
     {{"renderer/base", "renderer/scene/description"}, {"embree3/", "embree4/", "tbb/", "sys/resource.h"}}},
    {"renderer/trace/scene",
     {{"renderer/base", "renderer/scene/", "renderer/trace/sampling", "renderer/trace/bsdf", "renderer/trace/camera",
       "renderer/trace/lights", "renderer/trace/accel"},
      {"tbb/", "spdlog/fmt/fmt.h"}}},
    {"renderer/trace/paths",
     {{"renderer/base", "renderer/film/", "renderer/trace/sampling", "renderer/trace/bsdf", "renderer/trace/camera",
       "renderer/trace/lights", "renderer/trace/accel", "renderer/trace/scene"},
      {}}},
    {"renderer/trace/gbuffer",
     {{"renderer/base", "renderer/film/", "renderer/trace/sampling", "renderer/trace/bsdf", "renderer/trace/camera",
       "renderer/trace/lights", "renderer/trace/accel", "renderer/trace/scene", "renderer/trace/paths"},
      {}}},
    {"renderer/trace/integrators",
     {{"renderer/base", "renderer/film/", "renderer/trace/sampling", "renderer/trace/bsdf", "renderer/trace/camera",
       "renderer/trace/lights", "renderer/trace/accel", "renderer/trace/scene", "renderer/trace/paths",
       "renderer/trace/gbuffer"},
      {}}},
    {"renderer/trace/selection",
     {{"renderer/base", "renderer/scene/", "renderer/film/", "renderer/trace/camera", "renderer/trace/scene",
       "renderer/trace/paths"},
      {}}},
    {"renderer/trace/reuse",
     {{"renderer/base", "renderer/film/", "renderer/trace/sampling", "renderer/trace/bsdf", "renderer/trace/camera",
       "renderer/trace/accel", "renderer/trace/scene", "renderer/trace/paths", "renderer/trace/gbuffer"},
      {}}},

    // helio_shaders: GLSL, compiled to arrays of words.
    {"renderer/vulkan/device", {{"renderer/base"}, {"volk.h"}}},
    {"renderer/vulkan/device/self_test", {{"renderer/base", "renderer/vulkan/device"}, {"helio_shaders/"}}},
    {"renderer/vulkan/probe",
     {{"renderer/base", "renderer/codec", "renderer/vulkan/device", "renderer/vulkan/device/self_test"},
      {"nlohmann/json.hpp", "errno.h", "fcntl.h", "poll.h", "signal.h", "spawn.h", "string.h", "sys/prctl.h",
       "sys/resource.h", "sys/socket.h", "sys/stat.h", "sys/types.h", "sys/wait.h", "unistd.h"}}},
    {"renderer/vulkan/shaders/tables", {{"renderer/base"}, {}}},  // what C++ and GLSL share
    {"renderer/vulkan/scene",
     {{"renderer/base", "renderer/scene/", "renderer/trace/", "renderer/vulkan/device",
       "renderer/vulkan/shaders/tables"},
      {"spdlog/fmt/", "volk.h"}}},
    {"renderer/vulkan",
     {{"renderer/base", "renderer/film/", "renderer/scene/description", "renderer/trace/", "renderer/vulkan/device",
       "renderer/vulkan/scene", "renderer/vulkan/shaders/tables"},
      {"helio_shaders/", "spdlog/fmt/", "volk.h"}}},

    {"renderer/preview", {{"renderer/base", "renderer/film/", "renderer/trace/"}, {}}},

    {"renderer/frame",
     {{"renderer/base", "renderer/scene/", "renderer/film/", "renderer/trace/", "renderer/preview", "renderer/metrics"},
      {"oneapi/tbb/", "time.h", "unistd.h"}}},
    {"renderer/frame/paper", {{"renderer/base", "renderer/film/", "renderer/trace/", "renderer/frame"}, {}}},

    {"server/base",
     {{"renderer/base", "renderer/codec", "renderer/trace/accel"},
      {"grpcpp/", "openssl/crypto.h", "openssl/rand.h", kProtobuf + "arena.h", kProtobuf + "message.h",
       kProtobuf + "descriptor.h", kProtobuf + "unknown_field_set.h", kProtobuf + "any.pb.h",
        kProtobuf + "duration.pb.h", "CLI/CLI.hpp", "spdlog/", "elf.h", "link.h", "malloc.h", "sys/stat.h",
        "unistd.h"}}},
     {"server/metrics", {{"renderer/base", "server/base"}, {"prometheus/", "sys/resource.h", "unistd.h"}}},
    {"server/scenes",
     {{"renderer/base", "renderer/codec", "renderer/scene/", "renderer/trace/", "proto", "server/base"},
      {"spdlog/fmt/fmt.h"}}},
    {"server/state",
     {{"renderer/base", "renderer/codec", "renderer/scene/load", "server/base", "server/scenes"},
      {kProtobuf + "message_lite.h", "spdlog/fmt/", "sqlite3.h", "fcntl.h", "sys/file.h", "sys/stat.h", "unistd.h"}}},
    {"server/stream",
     {{"renderer/base", "renderer/codec", "renderer/frame", "proto", "server/base", "server/metrics",
       "server/scenes"},
      {"grpcpp/", kProtobuf + "message_lite.h", kProtobuf + "io/coded_stream.h", "spdlog/"}}},
    {"server/sessions",
     {{"renderer/base", "renderer/codec", "renderer/film/display", "renderer/frame", "renderer/preview",
       "renderer/trace/", "renderer/vulkan", "renderer/vulkan/device", "renderer/vulkan/probe", "proto", "server/base",
       "server/metrics", "server/scenes", "server/stream"},
      {"absl/strings/", "openssl/rand.h", "spdlog/", "zlib.h"}}},
    {"server/compare",
     {{"renderer/base", "renderer/codec", "renderer/film/core", "renderer/metrics", "renderer/comparison",
       "renderer/frame", "renderer/trace/", "proto", "server/base", "server/scenes", "server/stream",
       "server/sessions"},
      {"spdlog/fmt/fmt.h"}}},
    {"server/jobs",
     {{"renderer/base", "renderer/codec", "renderer/frame", "renderer/trace/", "proto", "server/base", "server/scenes",
       "server/state", "server/stream", "server/sessions"},
      {kProtobuf + "descriptor.h", kProtobuf + "io/zero_copy_stream.h", kProtobuf + "io/zero_copy_stream_impl_lite.h",
       kProtobuf + "message.h", kProtobuf + "util/json_util.h", kProtobuf + "util/type_resolver.h",
       kProtobuf + "util/type_resolver_util.h", "spdlog/", "fcntl.h", "unistd.h"}}},
    {"server/rpc",
     {{"renderer/base", "renderer/codec", "renderer/frame", "renderer/scene/load", "renderer/trace/", "proto",
        "server/base", "server/metrics", "server/scenes", "server/stream", "server/sessions", "server/compare",
        "server/jobs"},
       {"grpcpp/", kProtobuf + "message_lite.h", "spdlog/", "unistd.h"}}},
    {"server/web",
     {{"renderer/base", "renderer/codec", "proto", "server/base"},
      {"boost/asio/", "boost/beast/", "grpcpp/", kProtobuf + "descriptor.h", kProtobuf + "io/coded_stream.h",
       "libdeflate.h", "nlohmann/json.hpp", "openssl/err.h", "openssl/ssl.h", "spdlog/", "netinet/tcp.h",
       "pthread.h", "sys/stat.h"}}},
    {"server/app",
      {{"renderer/base", "renderer/codec", "renderer/trace/accel", "server/base", "server/metrics", "server/sessions",
        "server/compare", "server/jobs", "server/rpc", "server/web"},
       {"grpcpp/", "grpc/grpc.h", "grpc/grpc_security.h", "grpc/support/log.h", "spdlog/", "fcntl.h", "malloc.h",
        "pthread.h", "signal.h", "unistd.h"}}},

    // Credentials of a connection, and why one did not come about.
    {"client/tls",
     {{"renderer/base", "renderer/codec"},
      {"grpcpp/", "openssl/err.h", "openssl/ssl.h", "openssl/x509v3.h", "arpa/inet.h", "fcntl.h", "netdb.h", "poll.h",
       "pthread.h", "signal.h", "sys/socket.h", "sys/time.h", "unistd.h"}}},
    {"client",
     {{"renderer/base", "renderer/codec", "client/tls", "proto"},
      {"grpcpp/", kProtobuf + "descriptor.h", kProtobuf + "util/json_util.h", kProtobuf + "util/message_differencer.h",
       "nlohmann/json.hpp", "pugixml.hpp", "spdlog/fmt/fmt.h", "sys/stat.h", "unistd.h"}}},
    // What is kept of a comparison: a folder with its table.
    {"client/comparison",
     {{"renderer/base", "renderer/codec", "client", "proto"},
      {kProtobuf + "util/json_util.h", kProtobuf + "util/message_differencer.h", "spdlog/fmt/fmt.h", "fcntl.h",
       "sys/file.h", "sys/stat.h", "unistd.h"}}},
    // Whether a daemon takes new work.
    {"client/health", {{"renderer/base", "client"}, {"grpcpp/", kProtobuf + "io/coded_stream.h"}}},
    // Jobs that the daemon keeps.
    {"client/jobs", {{"renderer/base", "renderer/codec", "client", "proto"}, {"grpcpp/", "spdlog/fmt/fmt.h"}}},
    // Parts of one picture, and what its file says about how it was made.
    {"client/shards",
     {{"renderer/base", "renderer/codec", "proto"},
      {kProtobuf + "util/json_util.h", kProtobuf + "util/message_differencer.h", "spdlog/fmt/fmt.h"}}},
    // The viewers tev and HDRView: sockets, packets, what they show of a tile.
    {"client/tev",
     {{"renderer/base", "renderer/codec", "client", "proto"},
      {"half.h", "netdb.h", "netinet/in.h", "netinet/tcp.h", "poll.h", "pthread.h", "signal.h", "sys/eventfd.h",
       "sys/socket.h", "sys/un.h", "time.h", "unistd.h"}}},
    // The page that a comparison is reported by.
    {"client/report",
     {{"renderer/base", "renderer/codec", "renderer/metrics", "proto"},
      {kProtobuf + "descriptor.h", kProtobuf + "message.h", "libdeflate.h", "spdlog/fmt/fmt.h"}}},
    {"client/cli",
     {{"renderer/base", "renderer/comparison", "renderer/frame", "client", "client/comparison", "client/shards",
       "client/tev", "client/tls", "server/base", "server/app", "server/compare", "server/stream", "proto"},
      {"CLI/CLI.hpp", "grpc/support/log.h", "nlohmann/json.hpp", "spdlog/fmt/fmt.h", "spdlog/spdlog.h", "fcntl.h",
       "signal.h", "unistd.h"}}},
    // The tables of papers, as comparisons.
    {"client/cli/presets",
     {{"renderer/base", "renderer/codec", "client", "client/comparison", "client/report", "client/cli", "proto"},
      {"spdlog/fmt/fmt.h"}}},
    {"client/cli/commands",
     {{"renderer/base", "renderer/codec", "client", "client/comparison", "client/health", "client/report",
       "client/shards", "client/tev", "client/cli", "client/cli/presets", "server/base", "server/app", "proto"},
      {kProtobuf + "util/json_util.h", kProtobuf + "util/message_differencer.h", "CLI/CLI.hpp", "spdlog/fmt/fmt.h",
       "spawn.h", "sys/stat.h", "sys/wait.h", "unistd.h"}}},
    {"client/cli/jobs",
     {{"renderer/base", "client", "client/jobs", "client/shards", "client/cli", "client/cli/commands", "proto"},
      {kProtobuf + "util/json_util.h", "spdlog/fmt/fmt.h", "fcntl.h", "poll.h", "sys/ioctl.h", "termios.h",
       "unistd.h"}}},
};

// The only ways into rooms that no rule names: a header, and the one file that may include it.
const std::map<std::string, std::string> kRegistered = {
    {"renderer/frame/paper/paper_parts.h", "renderer/frame/variant_parts.cpp"},
};

// Headers that only these files may include: ".cpp" is all that end so.
const std::map<std::string, std::vector<std::string>> kConfined = {
    {"embree3/", {"renderer/trace/accel/embree.h"}},
    {"embree4/", {"renderer/trace/accel/embree.h"}},
    {"OpenImageIO/", {".cpp"}},
    {"Imf*", {".cpp", "renderer/codec/exr_streams.h"}},
    {"Iex.h", {".cpp", "renderer/codec/exr_streams.h"}},
    {"openexr.h", {".cpp"}},
    {"sqlite3.h", {"server/state/sqlite_database.cpp"}},
    {"prometheus/", {"server/metrics/exposition.h", "server/metrics/exposition.cpp"}},
    {"turbojpeg.h", {"renderer/codec/jpeg_file.cpp"}},
    {"dlfcn.h", {"renderer/film/display/oidn_library.cpp"}},
};

bool matches(const std::string& header, const std::string& entry) {
  if (entry.back() == '*') return header.rfind(entry.substr(0, entry.size() - 1), 0) == 0;
  return entry.back() == '/' ? header.rfind(entry, 0) == 0 : header == entry;
}

// "" : none of ours.
std::string folder_of(const std::string& path) {
  if (path.rfind("heliograph/v1/", 0) == 0) return "proto";
  std::string best;
  for (const auto& [folder, unused] : kRules) {
    if (path.rfind(folder + "/", 0) == 0 && folder.size() > best.size()) best = folder;
  }
  return best;
}

bool is_standard(const std::string& header) {
  return std::all_of(header.begin(), header.end(), [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; });
}

// What is wrong with this line of the file; "" for nothing.
std::string complaint(const std::string& path, const std::string& line) {
  static const std::regex kDirective(R"(\s*#\s*include\b\s*(.*))"), kNamed(R"re((?:<([^>]+)>|"([^"]+)").*)re");
  std::smatch directive, named;
  if (!std::regex_match(line, directive, kDirective)) return "";
  const std::string operand = directive[1];
  if (!std::regex_match(operand, named, kNamed)) return path + " includes by macro: " + operand;
  const std::string folder = folder_of(path);
  if (folder.empty()) return path + " is in no known folder";
  const Rule& rule = kRules.at(folder);
  if (named[2].matched) {
    // What GLSL reads, too, names its neighbours as GLSL does.
    if (folder == "renderer/vulkan/shaders/tables" && named[2].str().find('/') == std::string::npos) return "";
    const std::string target = folder_of(named[2]);
    const bool allowed = std::any_of(rule.folders.begin(), rule.folders.end(), [&](const std::string& entry) {
      return entry.back() == '/' ? target.rfind(entry, 0) == 0 : target == entry;
    });
    const auto registered = kRegistered.find(named[2]);
    if (target == folder || allowed || (registered != kRegistered.end() && registered->second == path)) return "";
    return path + " includes " + named[2].str() + ", which is in no folder that " + folder + " may include";
  }
  const std::string header = named[1];
  if (is_standard(header)) return "";
  const bool listed = std::any_of(rule.headers.begin(), rule.headers.end(),
                                  [&](const std::string& entry) { return matches(header, entry); });
  if (!listed) return path + " includes <" + header + ">, which is not in the list of " + folder;
  for (const auto& [entry, places] : kConfined) {
    const bool allowed =
        std::any_of(places.begin(), places.end(), [&](const std::string& place) { return path.ends_with(place); });
    if (matches(header, entry) && !allowed) return path + " includes <" + header + ">, only for " + places.back();
  }
  return "";
}

TEST(IncludeRules, DependDownwardOnly) {
  const fs::path root = HELIO_SOURCE_DIR;
  int files = 0;
  for (const char* top : {"renderer", "server", "client"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      ++files;
      const std::string path = fs::relative(entry.path(), root).string();
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        if (line.find("include") == std::string::npos) continue;
        EXPECT_EQ(complaint(path, line), "");
      }
    }
  }
  EXPECT_GT(files, 100);
}

TEST(IncludeRules, RefuseWhatIsNotListed) {
  struct Line {
    const char *path, *line;
  };
  const Line refused[] = {
      {"renderer/film/core/film.h", "#include <openexr.h>"},
      {"renderer/film/core/film.h", "#include <half.h>"},
      {"renderer/film/core/film.h", "#  include <ImfHeader.h>"},
      {"renderer/codec/tile_codec.h", "#include <ImfHeader.h>"},  // in .cpp files only
      {"renderer/trace/paths/path_kernel.h", "#include <Iex.h>"},
      {"renderer/trace/accel/accel.cpp", "#include <embree4/rtcore.h>"},  // in embree.h only
      {"renderer/frame/render_loop.cpp", "#include <grpcpp/grpcpp.h>"},
      {"renderer/frame/render_loop.cpp", "#include \"server/sessions/session.h\""},
      {"renderer/frame/render_loop.cpp", "#include \"renderer/frame/paper/paper_parts.h\""},  // registered elsewhere
      {"renderer/frame/stages/make_stage.cpp", "#include \"renderer/frame/paper/forward_transfer.h\""},
      {"renderer/frame/variant_parts.cpp", "#include \"renderer/frame/paper/paper_film.h\""},  // by another header
      {"renderer/film/film.cpp", "#include \"renderer/frame/paper/first_hits.h\""},
      {"server/sessions/render_context.cpp", "#include \"renderer/frame/paper/paper_film.h\""},
      {"renderer/base/result.h", "#include \"renderer/film/core/film.h\""},
      {"server/app/server.cpp", "#include <tbb/parallel_for.h>"},
      {"server/app/server.cpp", "#include <boost/asio/io_context.hpp>"},
      {"server/app/metrics_page.cpp", "#include <prometheus/metric_family.h>"},
      {"server/web/web_socket.cpp", "#include \"server/sessions/session.h\""},  // by gRPC, as any other client
      {"server/stream/stream_messages.cpp", "#include <google/protobuf/wire_format_lite.h>"},
      {"client/render_client.cpp", "#include \"server/app/server.h\""},
      {"client/cli/commands/render.cpp", "#include \"renderer/trace/film_tracer.h\""},
      {"client/cli/commands/render.cpp", "#include <openssl/evp.h>"},
      {"client/frame_stream.cpp", "#include \"client/tev/tev_bridge.h\""},
      {"client/cli/commands/render.cpp", "#include \"render_options.h\""},  // paths are from the root
      {"client/cli/commands/render.cpp", "#include HEADER"},
      {"renderer/trace/sampling/mis.h", "#include \"renderer/trace/bsdf/bsdf.h\""},
      {"renderer/film/splats/splat_buffer.h", "#include \"renderer/film/history/film_history.h\""},
      {"server/base/retry.h", "#include \"server/rpc/unary_call.h\""},
      {"renderer/vulkan/device/arena.cpp", "#include \"renderer/vulkan/scene/bvh.h\""},
      {"renderer/vulkan/device/device.cpp", "#include <vulkan/vulkan.h>"},  // by volk alone
      {"renderer/vulkan/scene/bvh.cpp", "#include \"renderer/vulkan/tracer.h\""},
      {"renderer/frame/render_loop.cpp", "#include \"renderer/vulkan/path_device.h\""},
      {"server/rpc/render_service.cpp", "#include <volk.h>"},
      {"renderer/trace/mis.h", "#include <vector>"},  // in no room
      {"elsewhere/a.cpp", "#include <vector>"},
  };
  for (const Line& line : refused) {
    EXPECT_NE(complaint(line.path, line.line), "") << line.path << ": " << line.line;
  }
  const Line allowed[] = {
      {"renderer/trace/accel/embree.h", "#include <embree4/rtcore.h>  // the newer"},
      {"renderer/film/core/film.h", "#include <string_view>"},
      {"renderer/film/film.cpp", "#include \"renderer/film/history/film_history.h\""},
      {"renderer/frame/variant_parts.cpp", "#include \"renderer/frame/paper/paper_parts.h\""},
      {"renderer/frame/paper/paper_parts.cpp", "#include \"renderer/frame/stages/make_stage.h\""},
      {"renderer/scene/load/scene_loader.cpp", "#include \"renderer/scene/gltf/document/uri.h\""},
      {"renderer/scene/images/image_decoder.cpp", "#include <half.h>"},
      {"server/app/server.cpp", "#include <grpcpp/grpcpp.h>"},
      {"client/cli/commands/serve.cpp", "#include \"server/app/daemon.h\""},
      {"renderer/vulkan/shaders/tables/scene.h", "#include \"base.h\""},
      {"server/app/server.cpp", "// includes what #include would"},
  };
  for (const Line& line : allowed) EXPECT_EQ(complaint(line.path, line.line), "");
}

// What a reader takes in at a glance.
TEST(Folders, HoldAtMostFortySourceFiles) {
  const fs::path root = HELIO_SOURCE_DIR;
  std::map<std::string, int> files;
  for (const char* top : {"renderer", "server", "client", "tests"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp") ++files[fs::relative(entry.path().parent_path(), root).string()];
    }
  }
  EXPECT_GT(files.size(), 40u);
  for (const auto& [folder, count] : files) EXPECT_LE(count, 40) << folder;
}

}  // namespace
