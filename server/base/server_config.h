// What a daemon can be told, from flags, a configuration file and the environment: one table feeds all three and
// --help.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

// Defaults are those of a daemon on a person's own machine. Sizes in bytes, times in seconds.
struct ServerConfig {
  std::string listen = "127.0.0.1:0";    // HOST:PORT, port 0: any free one; empty: in-process only
  std::string http;                      // HOST:PORT of the viewer's page; empty: none
  std::vector<std::string> http_hosts;   // names that browsers may call it by, beside loopback's
  int max_http_connections = 64;
  std::string token_file;                // whoever names a line of it may use the daemon; empty: everyone
  std::string token;                     // the same, of programs that run a daemon in their own process; empty: none
  // PEM files of TLS, for gRPC and the page (server/web/tls_certificates.h). Empty: no TLS; of the last one: callers
  // need no certificate.
  std::string tls_certificate, tls_key, tls_client_ca;
  bool insecure = false;                 // addresses that other machines reach are served without TLS
  std::string port_file;                 // written with the bound port; empty: none
  std::vector<std::string> scene_roots;  // LoadScene paths are served from these directories only
  // Folder of what survives the daemon: its durable jobs. Empty: none, and none are taken; kOwnState: of the person who
  // runs it, if no other daemon uses that.
  std::string state;
  std::vector<std::string> output_roots;  // durable jobs write files into these directories only
  double checkpoint_interval_s = 60;      // between checkpoints of a durable job
  double keep_jobs_days = 30;             // that durable jobs are kept after their end
  int render_threads = 0;                 // 0: one per core
  double session_grace_s = 60;           // life of a session without a stream
  double drain_grace_s = 10;             // SIGTERM to exit
  std::uint64_t max_scene_bytes = 4ull << 30;
  std::uint64_t max_scene_memory = 0;  // 0: max_memory
  int max_film_side = 65536;
  std::uint64_t max_film_pixels = 64ull << 20;
  int max_sessions = 64;
  int max_jobs = 16;                    // that run
  int max_queued_jobs = 10000;          // durable ones that wait or are paused
  std::uint64_t max_state_scene_bytes = 10ull << 30;  // uploads that durable jobs may load again
  int max_ended_jobs = 10000;  // durable ones at their end that are kept
  std::uint64_t max_state_result_bytes = 64ull << 30;  // their pictures in the state folder
  std::uint64_t max_state_session_bytes = 4ull << 30;  // pictures of sessions that are kept for the next daemon
  int max_scenes = 64;
  int max_queued_loads = 16;             // and as many edits, and as many replays
  int max_streams = 256;                 // calls of one connection at a time
  std::uint64_t max_rpc_memory = 256ull << 20;  // what gRPC holds for messages on their way in and out
  double request_timeout_s = 60;         // for the open of a stream and for each message of an upload
  std::uint64_t max_memory = 0;    // scenes, films and tile queues together; 0: three quarters of the machine's
  bool strict = false;             // every load is
  // Limits of Compare: bytes of the references that are kept; units and pixels of one comparison; whether one may ask
  // that nothing else is rendered while it measures.
  std::uint64_t max_reference_memory = 1ull << 30;
  std::uint64_t max_compare_units = 8192;
  std::uint64_t max_compare_pixels = 1ull << 32;
  bool allow_exclusive = false;
  std::string isa = "auto";        // that Embree builds and traverses with (renderer/base/instruction_set.h)
  std::string oidn_library;        // Open Image Denoise's, a file or a name for the dynamic linker; empty: none
  bool vulkan_devices = false;     // --devices names vulkan: pictures may be rendered on Vulkan devices
  std::string log_level = "info";  // trace, debug, info, warn, error, off
  std::string log_format = "text";  // text, json
};

inline constexpr char kOwnState[] = "auto";
// What heliographd begins with: a daemon of its own keeps jobs in the person's state folder.
ServerConfig daemon_defaults();

// A row of the table.
struct ConfigOption {
  std::string name;  // "max-sessions": flag --max-sessions, variable HELIOGRAPH_MAX_SESSIONS, key max-sessions
  std::string help;  // one line, unit and range included
  bool repeatable = false;
  // Reads the text into the config; returns a clause with the allowed range when it does not fit, else "".
  std::string (*set)(ServerConfig&, const std::string& text) = nullptr;
  std::string (*get)(const ServerConfig&) = nullptr;
  bool flag = false;  // "on" or "off"; without a value "on"
  const char* variable = nullptr;  // of the environment; null: as above
  bool list = false;               // words separated by commas
};
const std::vector<ConfigOption>& config_options();

// Resolves the zeros that mean "from the machine" (max_memory, max_scene_memory).
ServerConfig complete(ServerConfig config);

struct ConfigRequest {
  ServerConfig config;
  bool json = false;  // say where it listens as one line of JSON
  std::string print;  // not empty: text of --help and the like; print it and exit 0
};

// A file for --config with every option: its help, and the line that sets its default, as a comment. Only listen is
// set, to a fixed loopback port.
std::string example_config();

// Flags win over environment variables, these over the file given with --config. Every problem found is reported.
Result<ConfigRequest> parse_server_config(const std::string& program, const std::vector<std::string>& arguments);

}  // namespace helio
