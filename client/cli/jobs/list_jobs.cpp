// heliograph jobs: what jobs a daemon keeps.
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <memory>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/exit_code.h"
#include "client/cli/jobs/job_report.h"
#include "client/cli/jobs/live_screen.h"
#include "client/enum_names.h"
#include "client/jobs/job_client.h"
#include "renderer/base/unix_time.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr std::uint64_t kDefaultLimit = 100, kMostLimit = 1000000;
constexpr int kPage = 1000;  // the protocol's largest

struct JobsOptions {
  TextOption states, limit;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Newest submission first. The id of a job may be cut to its beginning, as it is shown.\n"
    "With --json, stdout holds one object: total (jobs in these states), jobs: [{job_id, name, state (queued,\n"
    "running, paused, succeeded, failed, canceled), target_state, reason, scene_id, priority, attempt, views,\n"
    "views_done, done (share, 0 to 1), submitted_s, started_s, ended_s, checkpoint_s (Unix time, or null), same_bits,\n"
    "samples, samples_per_second, estimated_rmse, left_s {estimate, low, high} or null, width, height, settings,\n"
    "budget, ...}].\n"
    "Example: heliograph jobs --state running,queued --server 10.0.0.5:50051\n\n";

int run(const CLI::App& app, const JobsOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  pb::ListJobsRequest request;
  for (const std::string& name : context.reader.choices(options.states, state_names()))
    request.add_states(*from_short_name<pb::JobState>(name));
  std::uint64_t left = context.reader.integer(options.limit, 1, kMostLimit).value_or(kDefaultLimit);
  if (!context.problems.empty()) return context.refuse();

  auto renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  JobClient jobs(renderer->client());
  std::vector<pb::Job> listed;
  std::uint64_t total = 0;
  do {
    request.set_page_size(int(std::min<std::uint64_t>(left, kPage)));
    auto page = jobs.list(request);
    if (!page) return context.fail(page.error());
    total = page->total();
    for (pb::Job& job : *page->mutable_jobs()) listed.push_back(std::move(job));
    left -= std::min<std::uint64_t>(left, std::uint64_t(page->jobs_size()));
    request.set_page_token(page->next_page_token());
  } while (left > 0 && !request.page_token().empty());

  const int columns = isatty(STDOUT_FILENO) == 1 ? terminal_size().columns : 0;
  if (listed.empty()) {
    terminal.say("no jobs");
  } else {
    for (const std::string& line : job_table(listed, unix_time_s(), columns)) terminal.say(line);
  }
  if (total > listed.size()) terminal.say(fmt::format("{} of {} jobs; --limit shows more", listed.size(), total));
  Json json;
  json["total"] = total;
  json["jobs"] = Json::array();
  for (const pb::Job& job : listed) json["jobs"].push_back(to_json(job));
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_jobs(CLI::App& root) {
  CLI::App* app = add_command(root, "jobs", "List the jobs that a daemon keeps", std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<JobsOptions>();
  add_text(*app, options->states, "--state", "STATE,...",
           "Only jobs in these states, comma-separated: " + join(state_names(), ", ") + ". Default: all");
  add_text(*app, options->limit, "--limit", "N", "At most N jobs, [1, 1000000]. Default: 100");
  add_common_daemon_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
