#include "server/base/server_config.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "renderer/base/instruction_set.h"
#include "renderer/base/text.h"
#include "server/base/build_info.h"
#include "server/base/byte_size.h"
#include "server/base/listen_address.h"
#include "server/base/man_page.h"

namespace helio {
namespace {

template <class T>
std::string read_number(const std::string& text, T low, T high, T& value) {
  T number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !(number >= low && number <= high)) {
    return fmt::format("'{}'; allowed: [{}, {}]", text, low, high);
  }
  value = number;
  return "";
}

std::string read_name(const std::string& text, std::initializer_list<const char*> allowed, std::string& value) {
  std::string all;
  for (const char* name : allowed) {
    if (text == name) {
      value = text;
      return "";
    }
    all += all.empty() ? name : std::string(", ") + name;
  }
  return "'" + text + "'; allowed: " + all;
}

std::string read_devices(const std::string& text, bool& vulkan) {
  bool cpu = false;
  vulkan = false;
  for (const std::string_view name : comma_separated(text)) {
    bool& named = name == "vulkan" ? vulkan : cpu;
    if (named || (name != "cpu" && name != "vulkan")) return "'" + text + "'; allowed: cpu, cpu,vulkan";
    named = true;
  }
  return cpu ? "" : "'" + text + "'; allowed: cpu, cpu,vulkan";
}

using Config = ServerConfig;
using Text = const std::string&;

std::vector<ConfigOption> make_options() {
  return {
      {"listen", "HOST:PORT to serve on, port 0: any free one; an address other than loopback wants TLS, or --insecure",
       false,
       [](Config& c, Text t) {
         const auto address = parse_listen_address(t);
         return c.listen = t, address ? std::string() : address.error().message;
       },
       [](const Config& c) { return c.listen; }},
      {"http", "HOST:PORT to serve the viewer's page, health and metrics on, port 0: any free one; empty: none", false,
       [](Config& c, Text t) {
         const auto address = parse_listen_address(t);
         return c.http = t, t.empty() || address ? std::string() : address.error().message;
       },
       [](const Config& c) { return c.http; }},
      {"http-host", "name by which browsers may call the page, beside localhost, 127.0.0.1 and [::1]; repeatable", true,
       [](Config& c, Text t) {
         c.http_hosts.push_back(t);
         const bool fits = !t.empty() && t.size() <= 253 && t.find_first_of(" \t/@") == std::string::npos;
         return fits ? std::string() : "'" + t + "'; allowed: a host's name or address, without scheme, port and path";
       },
       [](const Config&) { return std::string(); }},
      {"max-http-connections", "connections of browsers at a time, [1, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 1, 65536, c.max_http_connections); },
       [](const Config& c) { return std::to_string(c.max_http_connections); }},
      {"token-file",
       "file of tokens, one of which callers must name, by gRPC (authorization: Bearer TOKEN) and in the page: a token "
       "of "
       "16 to 256 characters, which may do everything, or NAME ROLE sha256:HEX and quotas, as heliograph token prints "
       "it; read again on SIGHUP; empty: everyone may call",
       false, [](Config& c, Text t) { return c.token_file = t, std::string(); },
       [](const Config& c) { return c.token_file; }},
      {"tls-certificate",
       "PEM file with the certificate that the daemon shows, by gRPC and in the page, and those that lead to its root; "
       "read again when it is replaced; empty: no TLS",
       false, [](Config& c, Text t) { return c.tls_certificate = t, std::string(); },
       [](const Config& c) { return c.tls_certificate; }},
      {"tls-key", "PEM file with the certificate's key, without a passphrase", false,
       [](Config& c, Text t) { return c.tls_key = t, std::string(); }, [](const Config& c) { return c.tls_key; }},
      {"tls-client-ca",
       "PEM file with certificates of authorities: callers must show one that one of these has signed; empty: none is "
       "asked for",
       false, [](Config& c, Text t) { return c.tls_client_ca = t, std::string(); },
       [](const Config& c) { return c.tls_client_ca; }},
      {"insecure", "on or off: serve addresses that other machines reach without TLS: all that travels can be read",
       false,
       [](Config& c, Text t) {
         std::string value;
         std::string problem = read_name(t, {"on", "off"}, value);
         return c.insecure = value == "on", problem;
       },
       [](const Config& c) { return std::string(c.insecure ? "on" : "off"); }, true},
      {"port-file", "write the bound port number to this file once serving", false,
       [](Config& c, Text t) { return c.port_file = t, std::string(); }, [](const Config& c) { return c.port_file; }},
      {"scene-root",
       "directory that scene paths are served from; may be given several times (variable: separated by ':')", true,
       [](Config& c, Text t) {
         return c.scene_roots.push_back(t), t.empty() ? std::string("''; allowed: a directory") : "";
       },
       [](const Config&) { return std::string(); }},
      {"state",
       "folder of what survives the daemon, its durable jobs; auto: heliograph in $XDG_STATE_HOME, by default "
       "~/.local/state, if no other daemon uses it; none: no durable jobs are taken",
       false, [](Config& c, Text t) { return c.state = t == "none" ? "" : t, std::string(); },
       [](const Config& c) { return c.state.empty() ? "none" : c.state; }},
      {"output-root",
       "directory that durable jobs may write pictures to; may be given several times (variable: separated by ':')",
       true,
       [](Config& c, Text t) {
         return c.output_roots.push_back(t), t.empty() ? std::string("''; allowed: a directory") : "";
       },
       [](const Config&) { return std::string(); }},
      {"checkpoint-interval",
       "seconds between checkpoints of a durable job, [0.01, 86400]; longer where they would cost more than 2 %", false,
       [](Config& c, Text t) { return read_number(t, 0.01, 86400.0, c.checkpoint_interval_s); },
       [](const Config& c) { return fmt::format("{}", c.checkpoint_interval_s); }},
      {"keep-jobs", "days that durable jobs and the pictures kept of them stay after their end, [0, 36500]", false,
       [](Config& c, Text t) { return read_number(t, 0.0, 36500.0, c.keep_jobs_days); },
       [](const Config& c) { return fmt::format("{}", c.keep_jobs_days); }},
      {"render-threads", "workers that render, [0, 1024]; 0: one per core", false,
       [](Config& c, Text t) { return read_number(t, 0, 1024, c.render_threads); },
       [](const Config& c) { return std::to_string(c.render_threads); }},
      {"session-grace", "seconds that a session lives without a stream, [0.001, 86400]", false,
       [](Config& c, Text t) { return read_number(t, 1e-3, 86400.0, c.session_grace_s); },
       [](const Config& c) { return fmt::format("{}", c.session_grace_s); }},
      {"drain-grace", "seconds that running jobs get to finish after SIGTERM, [0, 3600]", false,
       [](Config& c, Text t) { return read_number(t, 0.0, 3600.0, c.drain_grace_s); },
       [](const Config& c) { return fmt::format("{}", c.drain_grace_s); }},
      {"max-scene-bytes", "bytes of a scene's files, suffixes K, M, G, T", false,
       [](Config& c, Text t) { return read_bytes(t, 1, c.max_scene_bytes); },
       [](const Config& c) { return std::to_string(c.max_scene_bytes); }},
      {"max-scene-memory", "bytes that one load may hold; 0: max-memory", false,
       [](Config& c, Text t) { return read_bytes(t, 0, c.max_scene_memory); },
       [](const Config& c) { return std::to_string(c.max_scene_memory); }},
      {"max-film-side", "pixels, [1, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 1, 65536, c.max_film_side); },
       [](const Config& c) { return std::to_string(c.max_film_side); }},
      {"max-film-pixels", "width times height, [1, 2^32]", false,
       [](Config& c, Text t) { return read_number<std::uint64_t>(t, 1, 1ull << 32, c.max_film_pixels); },
       [](const Config& c) { return std::to_string(c.max_film_pixels); }},
      {"max-sessions", "sessions at a time, [0, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 0, 65536, c.max_sessions); },
       [](const Config& c) { return std::to_string(c.max_sessions); }},
      {"max-jobs", "jobs that run at a time, [0, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 0, 65536, c.max_jobs); },
       [](const Config& c) { return std::to_string(c.max_jobs); }},
      {"max-queued-jobs", "durable jobs that wait or are paused, [1, 1000000]", false,
       [](Config& c, Text t) { return read_number(t, 1, 1000000, c.max_queued_jobs); },
       [](const Config& c) { return std::to_string(c.max_queued_jobs); }},
      {"max-state-scene-bytes", "bytes of uploads kept for durable jobs, suffixes K, M, G, T", false,
       [](Config& c, Text t) { return read_bytes(t, 1, c.max_state_scene_bytes); },
       [](const Config& c) { return std::to_string(c.max_state_scene_bytes); }},
      {"max-ended-jobs", "durable jobs at their end that are kept, [0, 1000000]; older ones are forgotten", false,
       [](Config& c, Text t) { return read_number(t, 0, 1000000, c.max_ended_jobs); },
       [](const Config& c) { return std::to_string(c.max_ended_jobs); }},
      {"max-state-result-bytes",
       "bytes of pictures of durable jobs without an output, suffixes K, M, G, T; the oldest jobs are forgotten", false,
       [](Config& c, Text t) { return read_bytes(t, 0, c.max_state_result_bytes); },
       [](const Config& c) { return std::to_string(c.max_state_result_bytes); }},
      {"max-state-session-bytes", "bytes of pictures that sessions take to the next daemon, suffixes K, M, G, T", false,
       [](Config& c, Text t) { return read_bytes(t, 0, c.max_state_session_bytes); },
       [](const Config& c) { return std::to_string(c.max_state_session_bytes); }},
      {"max-scenes", "scenes held at a time, [1, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 1, 65536, c.max_scenes); },
       [](const Config& c) { return std::to_string(c.max_scenes); }},
      {"max-queued-loads", "length of the queue of scene loads, and of edits and replays each, [1, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 1, 65536, c.max_queued_loads); },
       [](const Config& c) { return std::to_string(c.max_queued_loads); }},
      {"max-streams", "calls that one connection may have open at a time, [1, 65536]", false,
       [](Config& c, Text t) { return read_number(t, 1, 65536, c.max_streams); },
       [](const Config& c) { return std::to_string(c.max_streams); }},
      {"max-rpc-memory", "bytes that gRPC may hold for messages in transit, at least 16M, suffixes K, M, G, T", false,
       [](Config& c, Text t) { return read_bytes(t, 16 << 20, c.max_rpc_memory); },
       [](const Config& c) { return std::to_string(c.max_rpc_memory); }},
      {"request-timeout", "seconds to wait for a stream's open and for each message of an upload, [0.001, 86400]",
       false, [](Config& c, Text t) { return read_number(t, 1e-3, 86400.0, c.request_timeout_s); },
       [](const Config& c) { return fmt::format("{}", c.request_timeout_s); }},
      {"max-memory",
       "bytes of scenes, films and queues together, suffixes K, M, G, T; 0: three quarters of the machine's", false,
       [](Config& c, Text t) { return read_bytes(t, 0, c.max_memory); },
       [](const Config& c) { return std::to_string(c.max_memory); }},
      {"max-reference-memory", "bytes of the references that comparisons keep, suffixes K, M, G, T", false,
       [](Config& c, Text t) { return read_bytes(t, 1, c.max_reference_memory); },
       [](const Config& c) { return std::to_string(c.max_reference_memory); }},
      {"max-compare-units", "modes x seeds x budgets x views of one comparison, [1, 65536]", false,
       [](Config& c, Text t) { return read_number<std::uint64_t>(t, 1, 65536, c.max_compare_units); },
       [](const Config& c) { return std::to_string(c.max_compare_units); }},
      {"max-compare-pixels", "modes x seeds x views x pixels of one comparison, [1, 2^53]", false,
       [](Config& c, Text t) { return read_number<std::uint64_t>(t, 1, 1ull << 53, c.max_compare_pixels); },
       [](const Config& c) { return std::to_string(c.max_compare_pixels); }},
      {"allow-exclusive",
       "on or off: comparisons may let everyone else wait while they measure, 10 s at a time at most", false,
       [](Config& c, Text t) {
         std::string value;
         std::string problem = read_name(t, {"on", "off"}, value);
         return c.allow_exclusive = value == "on", problem;
       },
       [](const Config& c) { return std::string(c.allow_exclusive ? "on" : "off"); }, true},
      {"strict",
       "on or off: refuse scene files that break a rule of their format although their meaning is beyond doubt", false,
       [](Config& c, Text t) {
         std::string value;
         std::string problem = read_name(t, {"on", "off"}, value);
         return c.strict = value == "on", problem;
       },
       [](const Config& c) { return std::string(c.strict ? "on" : "off"); }, true},
      {"isa",
       "instruction set that Embree traces with: auto (the newest of this processor), sse2, sse4.2, avx, avx2 or "
       "avx512",
       false, [](Config& c, Text t) { return c.isa = t, isa_problem(t); }, [](const Config& c) { return c.isa; }},
      {"devices",
       "what may trace the pictures: cpu, or cpu,vulkan, which also allows Vulkan devices; a crash of a Vulkan driver "
       "ends "
       "the daemon",
       false, [](Config& c, Text t) { return read_devices(t, c.vulkan_devices); },
       [](const Config& c) { return std::string(c.vulkan_devices ? "cpu,vulkan" : "cpu"); }, false, nullptr, true},
      {"oidn-library",
       "Open Image Denoise 2.x for clients that ask for it: its libOpenImageDenoise.so, a path or a name that the "
       "dynamic linker finds; empty: none",
       false, [](Config& c, Text t) { return c.oidn_library = t, std::string(); },
       [](const Config& c) { return c.oidn_library; }, false, "HELIOGRAPH_OIDN"},
      {"log-level", "trace, debug, info, warn, error or off; the log goes to stderr", false,
       [](Config& c, Text t) {
         return read_name(t, {"trace", "debug", "info", "warn", "error", "off"}, c.log_level);
       },
       [](const Config& c) { return c.log_level; }},
      {"log-format", "text, or json: each line of the log is a JSON object", false,
       [](Config& c, Text t) {
         return read_name(t, {"text", "json"}, c.log_format);
       },
       [](const Config& c) { return c.log_format; }},
  };
}

std::string environment_name(const ConfigOption& option) {
  if (option.variable) return option.variable;
  std::string name = "HELIOGRAPH_";
  for (const char c : option.name) name += c == '-' ? '_' : char(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

// "--strict" as "--strict=on", where no value follows.
std::vector<std::string> with_values(std::vector<std::string> arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const bool bare = std::any_of(config_options().begin(), config_options().end(), [&](const ConfigOption& option) {
      return option.flag && arguments[i] == "--" + option.name;
    });
    const bool valued = i + 1 < arguments.size() && (arguments[i + 1] == "on" || arguments[i + 1] == "off");
    if (bare && !valued) arguments[i] += "=on";
  }
  return arguments;
}

// Variables as flags, in front of the real ones. (CLI11's own reading of them would let the file win.)
std::vector<std::string> with_environment(const std::vector<std::string>& arguments) {
  std::vector<std::string> all;
  for (const ConfigOption& option : config_options()) {
    const std::string flag = "--" + option.name;
    const char* variable = std::getenv(environment_name(option).c_str());
    const bool given = std::any_of(arguments.begin(), arguments.end(), [&](const std::string& argument) {
      return argument == flag || argument.rfind(flag + "=", 0) == 0;
    });
    if (!variable || given) continue;
    std::istringstream parts(variable);
    for (std::string part; std::getline(parts, part, option.repeatable ? ':' : '\0');) all.push_back(flag + "=" + part);
  }
  all.insert(all.end(), arguments.begin(), arguments.end());
  return all;
}

std::string daemon_man_page(const CLI::App& app) {
  ManPage page;
  page.name = "heliographd";
  page.section = 8;
  page.summary = "path-tracing render daemon";
  page.version = build_version();
  page.sections = {
      {"CONFIGURATION",
       "An option that names a variable of the environment can also be set by it, and config files hold lines "
       "`name = value`, with the names of these options. Flags win over the environment, which wins over the file. "
       "heliographd --example-config prints such a file.\n\n"
       "SIGTERM and SIGINT drain the daemon: its health turns NOT_SERVING, new work is refused, frames in flight end, "
       "jobs may finish until --drain-grace is over. A second signal ends it at once. SIGHUP makes it read the token "
       "file and the files of TLS again; where it comes from the end of the terminal that the daemon was started from, "
       "the daemon drains."},
      {"DEVICES",
       "Pictures are traced by the processor. --devices cpu,vulkan also allows Vulkan devices, which clients choose by "
       "name (heliograph render --device). Drivers run within the daemon: one that crashes ends it, with all sessions "
       "and "
       "jobs. So they are not used by default. At start a program of its own, heliograph-vulkan-probe, lists and tests "
       "the "
       "devices, in two seconds at most; heliograph info --server tells what it found. The daemon serves meanwhile. "
       "Results are kept in $XDG_CACHE_HOME/heliograph or ~/.cache/heliograph until a driver changes."},
      {"FILES",
       "/etc/heliograph/heliographd.conf\n\nis read by the systemd unit heliographd.service, which does not start "
       "without it."},
      {"SEE ALSO", "heliograph(1)"}};
  return man_page(app, page);
}

std::uint64_t machine_memory() {
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  return pages > 0 && page > 0 ? std::uint64_t(pages) * std::uint64_t(page) : 4ull << 30;
}

}  // namespace

const std::vector<ConfigOption>& config_options() {
  static const std::vector<ConfigOption> options = make_options();
  return options;
}

ServerConfig daemon_defaults() {
  ServerConfig config;
  config.state = kOwnState;
  return config;
}

std::string example_config() {
  std::string text = "# heliographd --config FILE. A line that starts with # is a comment; each shows a default.\n";
  const ServerConfig defaults = daemon_defaults();
  for (const ConfigOption& option : config_options()) {
    text += "\n# " + option.help + "\n";
    if (option.name == "listen") {
      text += "listen = 127.0.0.1:50051\n";
      continue;
    }
    const std::string value = option.get(defaults);
    text += fmt::format("#{} ={}{}\n", option.name, value.empty() ? "" : " ", value);
  }
  return text;
}

ServerConfig complete(ServerConfig config) {
  if (config.max_memory == 0) config.max_memory = machine_memory() / 4 * 3;
  if (config.max_scene_memory == 0) config.max_scene_memory = config.max_memory;
  return config;
}

Result<ConfigRequest> parse_server_config(const std::string& program, const std::vector<std::string>& arguments) {
  // CLI11 finds the texts (flags, then environment, then file); the table says what they mean, so that all problems are
  // reported together.
  CLI::App app("Path-tracing render daemon. Serves heliograph.v1 over gRPC until SIGTERM.", program);
  app.set_version_flag("--version", std::string("heliographd ") + build_version());
  app.set_config("--config", "", "file of lines `name = value`, names as below; flags and environment win over it")
      ->envname("HELIOGRAPH_CONFIG");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.footer("Exit codes: 0 drained after SIGTERM or SIGINT, 1 could not serve, 2 bad flags, file or environment.");

  app.allow_extras();
  ConfigRequest request;
  request.config = daemon_defaults();
  app.add_flag("--json", request.json, "say on stdout where it listens as {\"listening\": \"HOST:PORT\"}, one line");
  bool example = false, man = false;
  app.add_flag("--example-config", example, "print a file for --config that names every option, and exit")
      ->configurable(false);
  app.add_flag("--man", man, "print heliographd(8) as a man page, and exit")->configurable(false);

  const auto& options = config_options();
  const ServerConfig defaults = daemon_defaults();
  std::vector<std::vector<std::string>> texts(options.size());
  std::vector<const CLI::Option*> flags;
  for (std::size_t i = 0; i < options.size(); ++i) {
    std::string help = options[i].help;
    if (const std::string text = options[i].get(defaults); !text.empty()) help += " [" + text + "]";
    CLI::Option* option = app.add_option("--" + options[i].name, texts[i], help);
    option->envname(environment_name(options[i]))->type_name("");
    option->expected(1)->multi_option_policy(options[i].repeatable ? CLI::MultiOptionPolicy::TakeAll
                                                                   : CLI::MultiOptionPolicy::TakeLast);
    flags.push_back(option);
  }

  Problems problems;
  const std::vector<std::string> all = with_environment(with_values(arguments));
  std::vector<std::string> reversed(all.rbegin(), all.rend());
  try {
    app.parse(reversed);
  } catch (const CLI::CallForHelp&) {
    request.print = app.help();
    return request;
  } catch (const CLI::CallForVersion&) {
    request.print = std::string("heliographd ") + build_version() + "\n";
    return request;
  } catch (const CLI::ConfigError& error) {
    // CLI11 says "INI was not able to parse NAME" of a name that it does not know.
    const std::string what = error.what();
    problems.add("--config", "unknown name '" + what.substr(what.rfind(' ') + 1) + "'");
  } catch (const CLI::ParseError& error) {
    problems.add(program, error.what());
  }
  for (const std::string& word : app.remaining()) {
    const std::string name = word.substr(0, word.find('='));
    problems.add(name, "is not an option of " + program + "; --help lists them");
  }

  if (problems.empty() && example) {
    request.print = example_config();
    return request;
  }
  if (problems.empty() && man) {
    request.print = daemon_man_page(app);
    return request;
  }

  // Where CLI11 gave up, the options still have the texts that it had found by then.
  for (std::size_t i = 0; i < options.size(); ++i) {
    std::vector<std::string> found = flags[i]->results();
    const bool from_file = std::none_of(all.begin(), all.end(), [&](const std::string& argument) {
      return argument == "--" + options[i].name || argument.starts_with("--" + options[i].name + "=");
    });
    // CLI11 splits what it reads from a file at commas.
    if (options[i].list && from_file && !found.empty()) found = {fmt::format("{}", fmt::join(found, ","))};
    if (!options[i].repeatable && found.size() > 1) found.erase(found.begin(), found.end() - 1);
    for (const std::string& text : found) {
      const std::string problem = options[i].set(request.config, text);
      if (!problem.empty()) problems.add("--" + options[i].name, problem);
    }
  }
  if (!problems.empty()) return problems.to_error();
  return request;
}

}  // namespace helio
