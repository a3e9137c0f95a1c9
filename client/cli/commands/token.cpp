// heliograph token: makes a token and the line by which a daemon knows it.
#include <sys/stat.h>

#include <cstdio>
#include <memory>
#include <span>

#include "client/cli/command.h"
#include "client/cli/exit_code.h"
#include "client/cli/options.h"
#include "client/cli/terminal.h"
#include "renderer/codec/atomic_file.h"
#include "server/base/access_tokens.h"
#include "server/base/byte_size.h"

namespace helio::cli {

namespace {

constexpr const char* kHelp =
    "stdout has the line for the daemon's --token-file, which holds a hash of the token alone; stderr has the token,\n"
    "unless --output names a file for it. Nobody can find it again: give it to whoever is to have it, and add the "
    "line:\n"
    "\n"
    "  heliograph token alice --role render --sessions 4 --output alice.token >>tokens\n"
    "  kill -HUP $(pidof heliographd)\n"
    "\n"
    "The JSON has name, role, line and, without --output, token.\n\n";

struct TokenOptions {
  std::vector<std::string> names;
  TextOption role, sessions, jobs, memory, output;
  bool json = false;
};

Caller read_caller(const TokenOptions& options, OptionReader& reader) {
  Caller caller;
  if (options.names.size() != 1 || !is_token_name(options.names.front()) ||
      options.names.front().starts_with(AccessTokens::kUnnamed)) {
    reader.problems().add("NAME",
                          (options.names.size() == 1 ? "'" + options.names.front() + "'"
                                                     : std::to_string(options.names.size()) + " names") +
                              "; allowed: one of 1 to 64 letters, digits, '.', '_' and '-', not begun with unnamed-");
  } else {
    caller.name = options.names.front();
  }
  caller.role = read_role(reader.choice(options.role, {"view", "render", "admin"}).value_or("render")).value();
  caller.quotas.sessions = reader.integer(options.sessions, 0, 1000000);
  caller.quotas.jobs = reader.integer(options.jobs, 0, 1000000);
  if (const auto text = reader.text(options.memory)) {
    std::uint64_t bytes = 0;
    const std::string problem = read_bytes(*text, 0, bytes);
    if (!problem.empty()) reader.problem(options.memory, problem);
    caller.quotas.memory = bytes;
  }
  return caller;
}

// Readable by its owner alone, from the first byte on. A token that is there stays: nobody could find it again.
Status write_secret(const std::string& file, const std::string& token) {
  const mode_t before = umask(S_IRWXG | S_IRWXO);
  const std::string text = token + "\n";
  auto secret = AtomicFile::create(file);
  umask(before);
  if (!secret) return secret.error();
  const Status written = secret->write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  return written.ok() ? secret->commit(Flush::now, false) : written;
}

int run(const CLI::App& app, const TokenOptions& options) {
  Terminal terminal(options.json);
  Problems problems;
  OptionReader reader(problems);
  report_unknown(app, reader);
  Caller caller = read_caller(options, reader);
  const auto output = reader.output_file(options.output);
  if (!problems.empty()) return terminal.fail(kUsage, problems.to_error().message);
  const auto token = AccessTokens::make_random();
  if (!token) return terminal.fail(kFailed, token.error().to_string());
  caller.digest = AccessTokens::digest_of(*token);
  if (output) {
    const Status written = write_secret(*output, *token);
    if (!written) return terminal.fail(kFailed, written.error().to_string());
  }
  const std::string line = to_token_line(caller);
  terminal.say(line);
  Json json = {{"name", caller.name}, {"role", to_string(caller.role)}, {"line", line}};
  if (!output) json["token"] = *token;
  terminal.result(json);
  std::fflush(stdout);
  if (!output && !terminal.json()) std::fprintf(stderr, "%s\n", token->c_str());
  return kOk;
}

}  // namespace

Command add_token(CLI::App& root) {
  CLI::App* app = add_command(root, "token", "Make a token, and the line of it for a daemon's token file",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<TokenOptions>();
  add_words(*app, options->names, "NAME",
            "What the token is called, in logs and as the owner of sessions and jobs. Required");
  add_text(
      *app, options->role, "--role", "ROLE",
      "view (looks and watches), render (also loads and renders, and changes what is its own) or admin (also what is "
      "others'). Default: render");
  add_text(*app, options->sessions, "--sessions", "N", "Sessions at a time, [0, 1000000]. Default: the daemon's limit");
  add_text(*app, options->jobs, "--jobs", "N",
           "Jobs at a time that wait, are paused or run, [0, 1000000]. Default: the daemon's limits");
  add_text(*app, options->memory, "--memory", "SIZE",
           "Bytes of films, queues and uploads, suffixes K, M, G, T. Default: the daemon's limit");
  add_text(*app, options->output, "--output,-o", "FILE", "Write the token into FILE, which its owner alone may read");
  add_flag(*app, options->json, "--json", "One JSON object on stdout, described below");
  allow_unknown(*app);
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
