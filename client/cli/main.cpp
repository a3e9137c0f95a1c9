// heliograph: the daemon's thin client, and a renderer in itself.
#include <grpc/support/log.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/command.h"
#include "client/cli/exit_code.h"
#include "client/cli/terminal.h"
#include "server/base/man_page.h"

namespace helio::cli {

namespace {

// CLI11 reports through exceptions; help and version are among them.
int answer(const CLI::App& root, const CLI::ParseError& outcome) {
  std::ostringstream out, err;
  const int code = root.exit(outcome, out, err);
  if (code == 0) {
    std::fputs(out.str().c_str(), stdout);
    return kOk;
  }
  std::string text = outcome.what();
  text.erase(text.find_last_not_of(" \n") + 1);
  std::string command = "heliograph";
  for (const CLI::App* app = &root; !app->get_subcommands().empty();) {
    app = app->get_subcommands().front();
    command += " " + app->get_name();
  }
  std::fprintf(stderr, "heliograph: %s (see %s --help)\n", single_line(text).c_str(), command.c_str());
  return kUsage;
}

// A word that is no command deserves to be named; CLI11 would only say that a command is missing. `words` are those
// behind the command `parent`.
std::string unknown_command(const CLI::App& parent, const std::vector<std::string>& words) {
  const auto commands = parent.get_subcommands([](const CLI::App*) { return true; });
  if (commands.empty() || words.empty() || words[0][0] == '-') return {};
  std::string names;
  for (const CLI::App* command : commands) {
    if (command->get_name() == words[0]) return unknown_command(*command, {words.begin() + 1, words.end()});
    names += (names.empty() ? "" : ", ") + command->get_name();
  }
  const std::string of_what = parent.get_parent() ? " of " + parent.get_name() : "";
  return "'" + words[0] + "' is not a command" + of_what + ": " + names;
}

std::string man_page_of(const CLI::App& root) {
  ManPage page;
  page.name = "heliograph";
  page.summary = "render glTF and Mitsuba scenes by path tracing";
  page.version = HELIO_VERSION;
  page.sections = {{"SEE ALSO", "heliographd(8)"}};
  return man_page(root, page);
}

int run(int argc, char** argv) {
  CLI::App root(
      "Heliograph renders glTF and Mitsuba scenes by path tracing: here, or on a daemon that keeps the scene and every "
      "session's\n"
      "pixels resident. Each command has its own --help.",
      "heliograph");
  root.set_version_flag("--version", HELIO_VERSION);
  const auto print_man_page = [&root] {
    std::fputs(man_page_of(root).c_str(), stdout);
    throw CLI::Success();
  };
  root.add_flag_callback("--man", print_man_page, "Print heliograph(1) as a man page, and exit");
  root.require_subcommand(1);
  root.footer(kExitCodesHelp);

  const Command commands[] = {add_render(root),     add_move(root),    add_view(root),   add_serve(root),
                              add_info(root),       add_scene(root),   add_edit(root),   add_replay(root),
                              add_techniques(root), add_compare(root), add_submit(root), add_jobs(root),
                              add_job(root),        add_top(root),     add_merge(root),  add_health(root),
                              add_token(root)};
  const std::string unknown = unknown_command(root, {argv + 1, argv + std::max(argc, 1)});
  if (!unknown.empty()) return Terminal(false).fail(kUsage, unknown);
  try {
    root.parse(argc, argv);
  } catch (const CLI::ParseError& outcome) {
    return answer(root, outcome);
  }
  for (const Command& command : commands) {
    if (command.app->parsed()) return command.run();
  }
  return kUsage;
}

}  // namespace

}  // namespace helio::cli

int main(int argc, char** argv) {
  // The commands explain a failed handshake better than gRPC does on stderr; its own variable asks for its lines.
  if (!std::getenv("GRPC_VERBOSITY")) gpr_set_log_function([](gpr_log_func_args*) {});
  return helio::cli::run(argc, argv);
}
