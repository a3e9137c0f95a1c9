// heliograph job: one job of a daemon.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/commands/picture_files.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/jobs/follow_job.h"
#include "client/cli/jobs/job_report.h"
#include "client/jobs/job_client.h"
#include "renderer/base/unix_time.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

struct JobOptions {
  TextOption id, priority, fetch, view;
  bool watch = false, cancel = false, pause = false, resume = false;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Without an option, prints all that is known of the job. ID may be the beginning of one.\n"
    "--cancel, --pause and --resume come first, then --priority, --watch and --fetch. A running job stops at its next\n"
    "checkpoint, which is taken at once. --watch prints each change of state until the job has ended; Ctrl-C ends the\n"
    "command alone, and the job goes on. With --wait a daemon that restarts is waited for. --fetch waits for nothing:\n"
    "with --watch before it, it fetches what has succeeded.\n"
    "With --watch, a job that failed or was canceled is exit code 1.\n"
    "With --json, stdout holds one object: the job, as of heliograph jobs, with results: [{view, file (on the\n"
    "daemon's machine; null: kept for --fetch), bytes, sha256, ended_by, ... (as of heliograph render)}], and with\n"
    "--fetch fetched: [{view, output, bytes, sha256}].\n"
    "Example: heliograph job j-5b0c --watch --fetch room.exr --server 10.0.0.5:50051\n\n";

struct Asked {
  std::optional<int> priority;
  std::string fetch;  // empty: nothing
  std::optional<std::uint32_t> view;
};

Asked read_asked(const JobOptions& options, OptionReader& reader) {
  Asked asked;
  if (!options.id.given() || options.id.text.empty())
    reader.problems().add("ID", "is missing: the job's id, or its beginning");
  asked.priority = reader.signed_integer(options.priority, -100, 100);
  asked.fetch = reader.output_file(options.fetch).value_or("");
  check_exr_name("--fetch", asked.fetch, {}, reader.problems());
  if (const auto view = reader.integer(options.view, 0, 9999)) asked.view = std::uint32_t(*view);
  if (options.view.given() && !options.fetch.given()) reader.problem(options.view, "is only valid with --fetch");
  const int changes = options.cancel + options.pause + options.resume;
  if (changes > 1) reader.problems().add("--cancel, --pause, --resume", "exclude each other; allowed: one of them");
  if (options.cancel && options.fetch.given()) reader.problem(options.fetch, "does not go with --cancel");
  return asked;
}

Status change(JobClient& jobs, const std::string& id, const JobOptions& options, const Asked& asked) {
  if (options.cancel) {
    if (const Status done = jobs.cancel(id); !done) return done;
  }
  if (options.pause || options.resume) {
    const auto done = options.pause ? jobs.pause(id) : jobs.resume(id);
    if (!done) return done.error();
  }
  if (asked.priority) {
    const auto done = jobs.set_priority(id, *asked.priority);
    if (!done) return done.error();
  }
  return ok_status();
}

std::string not_done(const pb::Job& job, std::uint32_t view) {
  std::string text = fmt::format("nothing to fetch: the job is {}", state_name(job.state()));
  if (!job.reason().empty()) text += " (" + single_line(job.reason()) + ")";
  if (job.views() > 1)
    text += fmt::format(", with {} of {} views done; asked for view {}", job.views_done(), job.views(), view);
  if (is_over(job.state())) return text;
  return text + (job.state() == pb::JOB_STATE_PAUSED ? "; --resume lets it go on" : "; --watch waits for its end");
}

Status fetch(JobClient& jobs, const pb::Job& job, const Asked& asked, Terminal& terminal, CallControl& control,
             Json& fetched) {
  const std::uint32_t first = asked.view.value_or(0), end = asked.view ? first + 1 : job.views();
  if (asked.view && *asked.view >= job.views()) {
    return Error{ErrorCode::invalid_argument, fmt::format("{}; the job has views [0, {}]", first, job.views() - 1),
                 "--view"};
  }
  if (job.views_done() < end) return Error{ErrorCode::failed_precondition, not_done(job, end - 1), "--fetch"};
  for (std::uint32_t view = first; view < end; ++view) {
    const bool several = !asked.view && job.views() > 1;
    const std::string file = several ? numbered_name(asked.fetch, int(view)) : asked.fetch;
    const auto show = [&](std::uint64_t have, std::uint64_t total) {
      terminal.progress(fmt::format("{}: {:.0f} % of {}B", file,
                                    total > 0 ? 100.0 * double(have) / double(total) : 100.0,
                                    human_count(double(total))));
    };
    const auto got = jobs.fetch(job.job_id(), view, file, show, &control);
    terminal.end_progress();
    if (!got) return got.error();
    terminal.say(file);
    fetched.push_back({{"view", view}, {"output", file}, {"bytes", got->bytes()}, {"sha256", got->sha256()}});
  }
  return ok_status();
}

int run(const CLI::App& app, const JobOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  const Asked asked = read_asked(options, context.reader);
  if (!context.problems.empty()) return context.refuse();
  auto renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  JobClient jobs(renderer->client());
  const auto id = jobs.find(options.id.text);
  if (!id) return context.fail(id.error());
  if (const Status changed = change(jobs, *id, options, asked); !changed) return context.fail(changed.error());

  CallControl control;
  const Interrupt interrupt([&] { control.cancel(); });
  Result<pb::Job> job = Error{};
  if (options.watch) {
    auto ended = follow_to_end(jobs, *id, context, interrupt, control, Json::object());
    if (const int* exit_code = std::get_if<int>(&ended)) return *exit_code;
    job = std::move(std::get<pb::Job>(ended));
  } else {
    job = jobs.get(*id);
    if (!job) return context.fail(job.error());
  }
  Json json = to_json(*job);
  if (!asked.fetch.empty()) {
    json["fetched"] = Json::array();
    const Status fetched = fetch(jobs, *job, asked, terminal, control, json["fetched"]);
    if (interrupt.raised() && !fetched)
      return terminal.fail(interrupt.exit_code(), "interrupted; the file that was being fetched is not written", json);
    if (!fetched) return terminal.fail(exit_code_of(fetched.error()), fetched.error().to_string(), json);
  } else {
    for (const std::string& line : describe(*job, unix_time_s())) terminal.say(line);
  }
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_job(CLI::App& root) {
  CLI::App* app = add_command(root, "job", "Show, watch, change or fetch a job that a daemon keeps",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<JobOptions>();
  add_text(*app, options->id, "ID", "", "The job's id, or the beginning of it. Required");
  add_flag(*app, options->watch, "--watch", "Follow the job until it has ended");
  add_flag(*app, options->cancel, "--cancel", "End the job; what it rendered of an unfinished view is lost");
  add_flag(*app, options->pause, "--pause", "Stop the job until --resume");
  add_flag(*app, options->resume, "--resume", "Put a paused job back into the queue");
  add_text(*app, options->priority, "--priority", "N", "Higher goes first, [-100, 100]");
  add_text(*app, options->fetch, "--fetch", "FILE.exr",
           "Get the picture, checked by its SHA-256; a file that is there is replaced. Of several views each, #### "
           "becomes the view's number, put before the extension when the name holds no #");
  add_text(*app, options->view, "--view", "N", "Only this view, from 0, under the name of --fetch as it is");
  add_common_daemon_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
