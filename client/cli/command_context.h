// How the commands that work on scenes begin: options that all of them have, and what is read of those.
#pragma once

#include "client/cli/connection.h"
#include "client/cli/terminal.h"

namespace helio::cli {

struct CommonOptions {
  ConnectionOptions connection;
  TextOption progress;
  bool json = false;
};
// The last options of a command. `json_help` describes --json.
void add_common_options(CLI::App& app, CommonOptions& options, const std::string& json_help);
// Adds the common options of a command that needs a daemon.
void add_common_daemon_options(CLI::App& app, CommonOptions& options, const std::string& json_help);

struct CommandContext {
  // Reads the common options; `problems` then holds theirs, and flags that the command does not know.
  CommandContext(const CLI::App& app, const CommonOptions& options);
  CommandContext(const CommandContext&) = delete;
  CommandContext& operator=(const CommandContext&) = delete;

  // Both say what is wrong and return the exit code.
  int refuse();  // precondition: there are problems
  int fail(const Error& error);

  Terminal terminal;
  Problems problems;
  OptionReader reader;
  Connection connection;
};

}  // namespace helio::cli
