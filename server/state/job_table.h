// The durable jobs of a state folder: a row a job, a row for each change of its state, a row for each finished view.
//
// SQLite in WAL mode with synchronous = FULL: what a call has answered survives a crash of the machine. Calls that
// come together share one commit. Every member is thread safe and may block on the disk. Errors, unless stated
// otherwise, are those of SqliteDatabase (unavailable: the disk is full, another program holds the file locked, and
// the like).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "server/state/job_state.h"

namespace helio {

// Times are Unix times in seconds; 0: not yet.
struct JobRecord {
  std::string id;            // unique, not empty
  std::string owner;         // who submitted it; empty: nobody in particular
  std::string client_token;  // unique among its owner's jobs; empty: none
  std::string name;          // for people
  // Serialized request, complete: to be given to submit(). What the table answers has none: see request().
  std::string request;
  // What lists tell of the request, serialized. To be given where the request is long, as with a camera path; empty: all
  // of it.
  std::string summary;
  std::string scene_id;
  int priority = 0;  // higher first
  JobState state = JobState::queued;
  // Asked for, while a running job is not there yet: paused or canceled. succeeded: nothing is asked for.
  JobState target = JobState::succeeded;
  std::string target_by;          // who asked for the target
  std::string reason;             // of the newest change; empty: none
  std::uint32_t attempt = 0;      // times it began to run
  std::uint64_t updated_seq = 0;  // of its newest event
  std::string request_sha256;     // hexadecimal; empty: the summary is the request
  double submitted_s = 0, started_s = 0, ended_s = 0;  // started: of the first attempt
  std::uint32_t views = 1, views_done = 0;
  bool same_bits = true;  // every attempt so far ran on one build and instruction path
  std::string build;      // of the newest attempt
};

struct JobEvent {
  std::uint64_t seq = 0;  // counts the events of the folder from 1, never used twice; forgotten jobs leave gaps
  std::string job_id;
  std::optional<JobState> from;  // none: it was submitted
  JobState to = JobState::queued;
  std::string reason;
  std::string by;  // who asked for it; empty: the daemon itself
  std::uint32_t attempt = 0;
  double time_s = 0;
};

struct JobResult {
  std::uint32_t view = 0;   // below JobRecord::views
  std::string frame_end;    // serialized
  std::string file;         // absolute path
  std::uint64_t bytes = 0;
  std::string sha256;       // of the file, hexadecimal
};

// A change of state; absent fields stay as they are.
struct JobChange {
  JobState to = JobState::queued;
  std::vector<JobState> from = {};  // states in which it is made; empty: whatever may_follow() allows
  std::string reason = {}, by = {};  // by: empty and `to` is the job's target: who asked for the target
  std::optional<bool> same_bits = {};
  std::optional<std::string> build = {};
};

class JobTable {
 public:
  // Opens or makes `file`. What people should be told (a damaged one was set aside, a schema was migrated) goes into
  // `notices`. failed_precondition: the schema is a newer one; unavailable: busy, read-only, full; each a sentence.
  static Result<std::unique_ptr<JobTable>> open(const std::string& file, std::vector<std::string>& notices);
  ~JobTable();
  JobTable(const JobTable&) = delete;
  JobTable& operator=(const JobTable&) = delete;

  struct Submitted {
    JobRecord job;
    bool already_there = false;  // the owner's client_token was used before, with the same request
  };
  // Adds the job, queued, with its event; `by` is its owner. Of `job` count id, owner, client_token, name, request,
  // summary, scene_id, priority, views and submitted_s (0: now). invalid_argument: the id is empty or taken, or the
  // client_token was used for another request; resource_exhausted: max_queued_jobs are queued or paused, or their long
  // requests have kMostRequestBytes. by: who asks, for the event.
  static constexpr std::uint64_t kMostRequestBytes = 1 << 30;
  Result<Submitted> submit(const JobRecord& job, int max_queued, const std::string& by);
  // Makes the change and its event, and forgets the target; running counts an attempt. A running job that was asked to
  // be canceled comes to an end by any change, and one that was asked to pause pauses in place of going back into the
  // queue. not_found; failed_precondition names state and change, or says that people have paused and resumed it
  // kMostEvents / 2 times.
  static constexpr std::int64_t kMostEvents = 10000;
  Result<JobRecord> change(const std::string& id, const JobChange& change);
  // Pause or cancel of a running job is on its way; succeeded: no longer. No event. not_found; failed_precondition: the
  // job is not running; invalid_argument: another target.
  Result<JobRecord> set_target(const std::string& id, JobState target, const std::string& by);
  // No event. not_found; failed_precondition: the job is at its end.
  Result<JobRecord> set_priority(const std::string& id, int priority);
  // The view is done; views_done grows. Replaces a row of the same view. No event. not_found; failed_precondition: the
  // job is not running; invalid_argument: it has no such view.
  Status add_result(const std::string& id, const JobResult& result);

  Result<JobRecord> get(const std::string& id) const;                   // not_found
  Result<std::string> request(const std::string& id) const;  // not_found; failed_precondition: the job is at its end
  // Whether the job was submitted with this request.
  static bool has_request(const JobRecord& job, const std::string& request);
  Result<std::vector<JobResult>> results(const std::string& id) const;  // by view; not_found
  struct Page {
    std::vector<JobRecord> jobs;  // newest submission first
    std::string next;             // token of the next page; empty: this was the last
    std::uint64_t total = 0;      // jobs that the filter lets through, on all pages
  };
  // states: empty, all. after: Page::next of the page before, empty: the first page; invalid_argument: it is none of
  // ours, or of a list with another filter. limit: >= 1.
  Result<Page> list(const std::vector<JobState>& states, const std::string& after, int limit) const;
  // From this sequence number on, oldest first; job_id empty: of all jobs. An unknown job has none.
  Result<std::vector<JobEvent>> events(const std::string& job_id, std::uint64_t from_seq, int limit) const;
  Result<std::uint64_t> next_seq() const;  // of the event that comes next
  // The owner's job of this token; nothing: none.
  Result<std::optional<JobRecord>> find_token(const std::string& owner, const std::string& client_token) const;
  // Jobs of this owner that are not at their end.
  Result<std::uint64_t> unfinished_of(const std::string& owner) const;
  // The queued job that comes next: highest priority, then the oldest; not one of `except`. Nothing: none.
  Result<std::optional<JobRecord>> next_queued(const std::vector<std::string>& except) const;
  // Oldest submission first.
  Result<std::vector<JobRecord>> in_state(JobState state) const;
  // Number of jobs by state: of queued at [std::size_t(JobState::queued)], and so on.
  Result<std::vector<std::uint64_t>> counts() const;
  struct Kept {
    double since_s = 0;           // Unix time; ended before: forgotten
    std::uint64_t jobs = ~0ull;   // at most so many that came to their end
    std::uint64_t bytes = ~0ull;  // of their pictures in `folder`, the newest job's aside
    std::string folder = {};      // absolute path
  };
  // Forgets jobs at their end that are not to be kept, the oldest first, with events and results; answers their ids.
  Result<std::vector<std::string>> forget_ended(const Kept& kept);

  // Writes to the disk and changes nothing: whether the table takes changes.
  Status probe();

  // `told` is called after each commit that added events, on the committing thread, without any lock of the table. To
  // be set before the first change.
  void on_events(std::function<void()> told);

 private:
  struct State;
  explicit JobTable(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace helio
