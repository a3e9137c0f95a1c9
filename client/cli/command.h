// What a subcommand gives to main: its place on the command line and what it does.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace helio::cli {

struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;  // the exit code; called once, after parsing
};

Command add_serve(CLI::App& root);
Command add_render(CLI::App& root);
Command add_move(CLI::App& root);
Command add_view(CLI::App& root);
Command add_info(CLI::App& root);
Command add_health(CLI::App& root);
Command add_scene(CLI::App& root);
Command add_replay(CLI::App& root);
Command add_edit(CLI::App& root);
Command add_techniques(CLI::App& root);
Command add_compare(CLI::App& root);
Command add_submit(CLI::App& root);
Command add_jobs(CLI::App& root);
Command add_job(CLI::App& root);
Command add_top(CLI::App& root);
Command add_merge(CLI::App& root);
Command add_token(CLI::App& root);

// Runs a command as if `words` stood behind its name. Returns the exit code.
int run_words(const std::function<Command(CLI::App& root)>& add, const std::vector<std::string>& words);

// Flags that the command does not know become problems, so that they are reported with the others.
class OptionReader;
void report_unknown(const CLI::App& app, OptionReader& reader);

}  // namespace helio::cli
