// heliograph view: the scene in a browser, by the page that a daemon serves.
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cctype>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/commands/view_in_tev.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/scene_options.h"
#include "client/cli/tev_option.h"
#include "client/server_address.h"
#include "server/base/access_tokens.h"
#include "server/base/listen_address.h"

extern char** environ;

namespace helio::cli {

namespace {

constexpr const char* kDefaultPage = "127.0.0.1:7780";
constexpr int kTriedPorts = 20;
constexpr auto kReading = std::chrono::seconds(3);  // that a browser has for a file which is then gone

struct ViewOptions {
  SceneOptions scene;
  TextOption http;
  bool no_browser = false;
  TextOption tev;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Without --server a daemon runs in this process until Ctrl-C; its page is for whoever has the address that is\n"
    "printed, which names a token of this run. With --server the scene is loaded there, and the page is that daemon's\n"
    "(heliographd --http); the command ends once it has printed the address.\n"
    "--tev shows what the scene's first camera sees, not the page's: it is rendered beside the page, to 1024 samples\n"
    "a pixel, with a ninth of the machine while the page works. With --server the command then ends after that.\n";

// In process, at the first port from the one wanted that is free.
Result<Renderer> open_page(Connection connection, const ListenAddress& wanted, Terminal& terminal) {
  auto token = AccessTokens::make_random();
  if (!token) return token.error();
  connection.connect.token = std::move(*token);
  const int last = wanted.port == 0 ? 0 : std::min(wanted.port + kTriedPorts, 65535);
  for (int port = wanted.port;; ++port) {
    connection.http = fmt::format("{}:{}", bracketed(wanted.host), port);
    auto renderer = Renderer::open(connection);
    if (renderer) {
      if (port != wanted.port) terminal.say(fmt::format("port {} is in use: {} instead", wanted.port, port));
      return renderer;
    }
    if (renderer.error().code != ErrorCode::unavailable || renderer.error().where != "http" || port == last)
      return renderer;
  }
}

bool has_desktop() {
  return std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY");
}

// A page, in a file that only the user can read, that leads to another address: command lines are for everyone to read,
// and the address names a token. Gone with this object.
class RedirectFile {
 public:
  explicit RedirectFile(const std::string& url) {
    const char* runtime = std::getenv("XDG_RUNTIME_DIR");
    std::error_code error;
    const std::filesystem::path folder = runtime ? runtime : std::filesystem::temp_directory_path(error).string();
    std::string name = (folder / "heliograph-XXXXXX.html").string();
    const int file = mkstemps(name.data(), 5);  // readable by its owner alone
    if (file < 0) return;
    std::string escaped;
    for (const char c : url) escaped += c == '&' ? std::string("&amp;") : std::string(1, c);
    const std::string html = "<!doctype html><meta http-equiv=\"refresh\" content=\"0; url=" + escaped + "\">\n";
    if (write(file, html.data(), html.size()) == ssize_t(html.size())) path_ = name;
    close(file);
    if (path_.empty()) unlink(name.c_str());
  }
  ~RedirectFile() {
    if (!path_.empty()) unlink(path_.c_str());
  }
  RedirectFile(const RedirectFile&) = delete;
  RedirectFile& operator=(const RedirectFile&) = delete;

  const std::string& path() const { return path_; }  // empty: it could not be written

 private:
  std::string path_;
};

// False: none could be started.
bool open_browser(const std::string& file) {
  std::string program = "xdg-open", argument = file;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t process = 0;
  if (file.empty() || posix_spawnp(&process, "xdg-open", nullptr, nullptr, arguments, environ) != 0) return false;
  std::thread([process] { waitpid(process, nullptr, 0); }).detach();
  return true;
}

// Where a browser finds the page of a daemon: one that serves on all addresses is called as this client calls it.
std::string page_host(const std::string& http_address, const std::string& server) {
  const auto page = parse_listen_address(http_address);
  if (!page || (page->host != "0.0.0.0" && page->host != "::") || server.rfind("unix:", 0) == 0) return http_address;
  return server.substr(0, server.rfind(':')) + ":" + std::to_string(page->port);
}

// As a part of the address (RFC 3986, section 2.1).
std::string percent_encode(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) || std::string_view("-._~/").find(c) != std::string_view::npos;
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

// The path of the scene below the daemon's roots, by which the page can open it again; empty: there is none, or it
// would be opened otherwise than by these options.
std::string page_path(const SceneChoice& choice, bool here) {
  const bool plain = choice.environment.empty() && choice.time_s == 0 && choice.animation.empty() && !choice.strict;
  if (!plain || (!here && !choice.on_server)) return {};
  return here ? std::filesystem::path(choice.file).filename().string() : choice.file;
}

int run(const CLI::App& app, const ViewOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  OptionReader& reader = context.reader;
  const SceneChoice choice = read_scene(options.scene, options.common.connection, reader);
  const bool here = context.connection.address.empty();
  const std::string http = reader.text(options.http).value_or(kDefaultPage);
  const auto listen = parse_listen_address(http);
  if (!listen) reader.problem(options.http, listen.error().message);
  if (options.http.given() && !here) reader.problem(options.http, "does not go with --server: the daemon has its own");
  const auto tev_address = read_tev(options.tev, reader);
  if (!context.problems.empty()) return context.refuse();

  CallControl control;
  std::mutex mutex;
  std::condition_variable ended;
  bool over = false;
  ViewInTev* in_tev = nullptr;
  const Interrupt interrupt([&] {
    control.cancel();
    const std::lock_guard lock(mutex);
    over = true;
    if (in_tev) in_tev->cancel();
    ended.notify_all();
  });
  if (here) {
    context.connection.scene_roots = {std::filesystem::absolute(choice.file).parent_path().string()};
    std::error_code missing;
    if (!std::filesystem::is_directory(context.connection.scene_roots.front(), missing))
      context.connection.scene_roots.clear();
  }
  Result<Renderer> renderer =
      here ? open_page(context.connection, *listen, terminal) : Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  RenderClient& client = renderer->client();
  const auto info = client.server_info();
  if (!info) return context.fail(info.error());
  if (info->http_address().empty()) {
    return context.fail({ErrorCode::failed_precondition,
                         "the daemon at " + client.peer() + " serves no page; start it with --http HOST:PORT",
                         {}});
  }
  const LoadOutcome loaded = load_scene(client, choice, terminal, &control);
  if (interrupt.raised()) return terminal.fail(interrupt.exit_code(), "interrupted while loading");
  if (loaded.failure) return terminal.fail(loaded.failure->exit_code, loaded.failure->error.to_string());

  const std::string& scene_id = loaded.scene->response.scene().scene_id();
  // Behind the #: neither logs nor other pages see it.
  std::string url = fmt::format("{}://{}/#id={}", info->http_tls() ? "https" : "http",
                                page_host(info->http_address(), context.connection.address), scene_id);
  if (const std::string path = page_path(choice, here); !path.empty()) url += "&scene=" + percent_encode(path);
  if (!client.token().empty()) url += "&token=" + client.token();
  terminal.say(url);
  if (here) terminal.say("Ctrl-C ends");
  std::optional<ViewInTev> beside;
  if (tev_address) {
    beside.emplace(client, loaded.scene->response.scene(), scene_stem(choice), context.connection.address, *tev_address,
                   terminal);
    terminal.say(fmt::format("notice: tev at {} shows the scene's camera '{}', whatever the page shows",
                             tev_address->text, beside->camera()));
    const std::lock_guard lock(mutex);
    in_tev = &*beside;
    if (over) in_tev->cancel();
  }
  Json json;
  json["url"] = url;
  json["scene_id"] = scene_id;
  if (tev_address) json["tev"] = {{"address", tev_address->text}, {"camera", beside->camera()}};
  terminal.result(json);
  std::fflush(stdout);
  std::optional<RedirectFile> redirect;
  if (!options.no_browser && !terminal.json() && has_desktop()) {
    redirect.emplace(url);
    if (!open_browser(redirect->path()))
      terminal.warn("no browser was opened (xdg-open is missing, or no file can be written)");
    if (!here) std::this_thread::sleep_for(kReading);
  }
  if (here) {
    std::unique_lock lock(mutex);
    ended.wait(lock, [&] { return over; });
  } else if (beside) {
    beside->wait();
  }
  const std::lock_guard lock(mutex);
  in_tev = nullptr;
  return kOk;
}

}  // namespace

Command add_view(CLI::App& root) {
  CLI::App* app = add_command(root, "view", "Show a scene in a browser: move the camera, edit, compare",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<ViewOptions>();
  add_scene_options(*app, options->scene);
  add_text(*app, options->http, "--http", "HOST:PORT",
           fmt::format("Where the page is served; a port in use: the next one that is free; 0: any. Default: {}",
                       kDefaultPage));
  add_flag(*app, options->no_browser, "--no-browser", "Do not open a browser where there is a desktop");
  add_tev_option(*app, options->tev);
  add_common_options(*app, options->common, "One JSON object on stdout, once the page is there");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
