// heliograph serve: the daemon, exactly as heliographd runs it.
#include <CLI/CLI.hpp>

#include "client/cli/command.h"
#include "server/app/daemon.h"

namespace helio::cli {

Command add_serve(CLI::App& root) {
  CLI::App* app = root.add_subcommand("serve", "Run the daemon (heliographd); serve --help shows its own flags");
  app->prefix_command();      // everything after "serve" belongs to the daemon,
  app->set_help_flag();       // --help
  app->set_version_flag("");  // and --version included
  return {app, [app] { return run_daemon("heliograph serve", app->remaining()); }};
}

}  // namespace helio::cli
