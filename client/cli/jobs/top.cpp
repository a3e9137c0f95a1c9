// heliograph top: the jobs of a daemon, live.
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <type_traits>
#include <utility>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/jobs/job_report.h"
#include "client/cli/jobs/live_screen.h"
#include "client/jobs/job_board.h"
#include "client/jobs/job_client.h"
#include "renderer/base/unix_time.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr double kDefaultInterval = 1;
constexpr int kPage = 1000;            // the protocol's largest
constexpr std::size_t kMostOver = 10;  // jobs that are over, in the table
constexpr double kReconnectSeconds = 1;

struct TopOptions {
  TextOption interval;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Running jobs come first, with the share that is done, pixel samples a second, and the time left with the\n"
    "interval that holds it in 4 of 5 jobs (unknown before 16 samples a pixel); then those that wait, in the order of\n"
    "their turns, those that are paused, and the last ones that have ended. q or Ctrl-C ends the display, and no job.\n"
    "Where stdout is no terminal, one table is printed. With --json, stdout holds one object: jobs, as of heliograph\n"
    "jobs.\n\n";

// The jobs as a watch tells them. Thread safe.
class Board {
 public:
  template <class T>
  void take(const T& news) {
    const std::lock_guard lock(mutex_);
    if constexpr (std::is_same_v<T, pb::JobEvent>) {
      if (!board_.take(news)) unknown_.insert(news.job_id());
      if (is_over(news.to())) board_.forget_over(kMostOver);
    } else {
      board_.take(news);
    }
  }
  void replace(JobBoard board) {
    const std::lock_guard lock(mutex_);
    board_ = std::move(board);
  }
  std::set<std::string> take_unknown() {
    const std::lock_guard lock(mutex_);
    return std::exchange(unknown_, {});
  }
  std::vector<pb::Job> rows() const {
    const std::lock_guard lock(mutex_);
    return board_.rows(kMostOver);
  }
  std::string counts() const {
    const std::lock_guard lock(mutex_);
    return fmt::format("{} running, {} queued, {} paused", board_.count(pb::JOB_STATE_RUNNING),
                       board_.count(pb::JOB_STATE_QUEUED), board_.count(pb::JOB_STATE_PAUSED));
  }
  void set_problem(const std::string& text) {
    const std::lock_guard lock(mutex_);
    problem_ = text;
  }
  std::string problem() const {
    const std::lock_guard lock(mutex_);
    return problem_;
  }

 private:
  mutable std::mutex mutex_;
  JobBoard board_;
  std::set<std::string> unknown_;
  std::string problem_;
};

// All that are not over, and the newest of the others.
Result<JobBoard> list_all(JobClient& jobs) {
  JobBoard board;
  pb::ListJobsRequest request;
  request.set_page_size(kPage);
  for (const pb::JobState state : {pb::JOB_STATE_QUEUED, pb::JOB_STATE_RUNNING, pb::JOB_STATE_PAUSED})
    request.add_states(state);
  do {
    const auto page = jobs.list(request);
    if (!page) return page.error();
    for (const pb::Job& job : page->jobs()) board.take(job);
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  request.clear_states();
  for (const pb::JobState state : {pb::JOB_STATE_SUCCEEDED, pb::JOB_STATE_FAILED, pb::JOB_STATE_CANCELED})
    request.add_states(state);
  request.set_page_size(int(kMostOver));
  const auto page = jobs.list(request);
  if (!page) return page.error();
  for (const pb::Job& job : page->jobs()) board.take(job);
  return board;
}

// Until `control` ends it. The list is asked for once the watch stands, so that no change falls between the two; a
// daemon that goes away is waited for.
void follow(JobClient& jobs, Board& board, CallControl& control) {
  JobWatchCallbacks callbacks;
  callbacks.watching = [&](const auto&) {
    auto listed = list_all(jobs);
    board.set_problem(listed ? "" : listed.error().to_string());
    if (listed) board.replace(std::move(*listed));
  };
  callbacks.event = [&](const pb::JobEvent& event) { board.take(event); };
  callbacks.progress = [&](const pb::Job& job) { board.take(job); };
  pb::WatchJobRequest request;
  request.set_progress(true);
  while (!control.cancelled()) {
    const Status ended = jobs.watch(request, callbacks, &control);
    if (control.cancelled()) return;
    board.set_problem(ended ? "the server ended the watch" : ended.error().to_string());
    std::this_thread::sleep_for(std::chrono::duration<double>(kReconnectSeconds));
  }
}

std::vector<std::string> page_of(const Board& board, const std::string& server) {
  const TerminalSize size = terminal_size();
  const std::string problem = board.problem();
  std::vector<std::string> lines;
  lines.push_back(fit(server + ": " + (problem.empty() ? board.counts() : problem), std::size_t(size.columns)));
  lines.push_back("");
  for (std::string& line : live_table(board.rows(), unix_time_s(), size.columns)) lines.push_back(std::move(line));
  const auto room = std::size_t(std::max(4, size.rows));
  if (lines.size() > room) {
    const std::size_t hidden = lines.size() - room + 1;
    lines.resize(room - 1);
    lines.push_back(fit(fmt::format("{} more", hidden), std::size_t(size.columns)));
  }
  return lines;
}

int show_once(CommandContext& context, JobClient& jobs) {
  Board board;
  auto listed = list_all(jobs);
  if (!listed) return context.fail(listed.error());
  board.replace(std::move(*listed));
  const std::vector<pb::Job> rows = board.rows();
  context.terminal.say(context.connection.address + ": " + board.counts());
  for (const std::string& line : live_table(rows, unix_time_s(), 0)) context.terminal.say(line);
  Json json;
  json["jobs"] = Json::array();
  for (const pb::Job& job : rows) json["jobs"].push_back(to_json(job));
  context.terminal.result(json);
  return kOk;
}

int show_live(CommandContext& context, JobClient& jobs, double interval) {
  Board board;
  auto listed = list_all(jobs);
  if (!listed) return context.fail(listed.error());
  board.replace(std::move(*listed));
  CallControl control;
  LiveScreen screen;
  const Interrupt interrupt([&] {
    control.cancel();
    screen.wake();
  });
  std::thread watcher([&] { follow(jobs, board, control); });
  do {
    for (const std::string& id : board.take_unknown()) {
      if (const auto job = jobs.get(id)) board.take(*job);
    }
    screen.draw(page_of(board, context.connection.address));
  } while (!screen.quits_within(interval) && !interrupt.raised());
  control.cancel();
  watcher.join();
  return kOk;
}

int run(const CLI::App& app, const TopOptions& options) {
  CommandContext context(app, options.common);
  const double interval = context.reader.number(options.interval, {0.1, 3600}).value_or(kDefaultInterval);
  if (!context.problems.empty()) return context.refuse();
  auto renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  JobClient jobs(renderer->client());
  const bool live = isatty(STDOUT_FILENO) == 1 && !options.common.json;
  return live ? show_live(context, jobs, interval) : show_once(context, jobs);
}

}  // namespace

Command add_top(CLI::App& root) {
  CLI::App* app = add_command(root, "top", "Show a daemon's jobs live: progress, pace and time left",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<TopOptions>();
  add_text(*app, options->interval, "--interval", "SECONDS", "Time between two displays, [0.1, 3600]. Default: 1");
  add_common_daemon_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
