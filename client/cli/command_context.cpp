#include "client/cli/command_context.h"

#include "client/cli/command.h"
#include "client/cli/exit_code.h"
#include "client/cli/progress_option.h"

namespace helio::cli {

namespace {

void add_other_options(CLI::App& app, CommonOptions& options, const std::string& json_help) {
  add_progress_option(app, options.progress);
  add_flag(app, options.json, "--json", json_help);
  allow_unknown(app);
}

}  // namespace

void add_common_options(CLI::App& app, CommonOptions& options, const std::string& json_help) {
  add_connection_options(app, options.connection);
  add_other_options(app, options, json_help);
}

void add_common_daemon_options(CLI::App& app, CommonOptions& options, const std::string& json_help) {
  add_daemon_options(app, options.connection);
  add_other_options(app, options, json_help);
}

CommandContext::CommandContext(const CLI::App& app, const CommonOptions& options)
    : terminal(options.json), reader(problems) {
  report_unknown(app, reader);
  read_progress(options.progress, reader, terminal);
  connection = read_connection(options.connection, reader);
  connection.connect.notice = [this](const std::string& text) { terminal.warn(single_line(text)); };
}

int CommandContext::refuse() {
  return terminal.fail(kUsage, problems.to_error().message);
}

int CommandContext::fail(const Error& error) {
  return terminal.fail(exit_code_of(error), error.to_string());
}

}  // namespace helio::cli
