// The jobs that the daemon keeps: submits, lists and changes them, and gives each its turn.
//
// Every change of a job's state is made in the table (server/state/job_table.h), which alone knows what may follow what;
// here is who begins, and what a running attempt is asked to do. Jobs begin while JobStore has places (max_jobs, RunJob's
// included), the highest priority first, then the oldest.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "heliograph/v1/durable_job.pb.h"
#include "server/base/task_thread.h"
#include "server/jobs/job_attempt.h"
#include "server/jobs/job_stores.h"
#include "server/jobs/job_tiles.h"
#include "server/jobs/session_keeper.h"
#include "server/state/state_folder.h"

namespace helio {

// Thread safe. Members that answer a Result may wait for the disk: not to be called on gRPC's threads, but for those
// that say so.
class DurableJobs {
 public:
  // Takes the folder; `notices`: what people should be told of it. No job begins before begin().
  static Result<std::unique_ptr<DurableJobs>> open(ServiceCore& core, const std::string& folder,
                                                   std::vector<std::string>& notices);
  ~DurableJobs();
  // Jobs get their turns from now on. Once.
  void begin();

  // Errors: those of plan_job(), with "job." before the fields; OutputRoots; SceneStore::hold(); JobTable::submit().
  // The caller's quota is resource_exhausted. by: who asks, for events.
  Result<pb::SubmitJobResponse> submit(const pb::SubmitJobRequest& request, const Caller& caller,
                                       const std::string& by);
  Result<pb::ListJobsResponse> list(const pb::ListJobsRequest& request) const;
  Result<pb::Job> get(const std::string& id) const;  // with results
  // not_found; failed_precondition: not from its present state.
  Result<pb::Job> pause(const std::string& id, const std::string& by);
  Result<pb::Job> resume(const std::string& id, const std::string& by);
  Result<pb::Job> set_priority(const std::string& id, int priority);
  Status cancel(const std::string& id, const std::string& by);
  Result<std::string> owner_of(const std::string& id) const;  // name of the token that submitted it; not_found
  struct ResultFile {
    pb::JobView view;
    std::string file;
  };
  Result<ResultFile> result(const std::string& id, std::uint32_t view) const;
  // Its file, which is no link; none and errno where it cannot be opened.
  FileDescriptor open(const ResultFile& result) const { return outputs_.open(result.file); }

  // The same as tiles, of a view that is done or of the newest checkpoint of the one in hand.
  struct ResultTiles {
    pb::JobView view;
    JobTiles tiles;
  };
  // They count as the caller's memory until they are let go. Errors besides: invalid_argument (format, window);
  // failed_precondition: there is nothing to be shown, or never will be before the view is done; unavailable, with a time
  // to try again: its first checkpoint is on its way.
  Result<ResultTiles> tiles(const pb::GetResultRequest& request, const Caller& caller);

  // For watches. `told` is called after every change of any job, until the listener is let go; on the thread that made
  // the change, so it returns at once.
  using Listener = std::shared_ptr<const std::function<void()>>;
  Listener listen(std::function<void()> told);
  const JobTable& table() const { return *table_; }
  // As GetJob, without results, and without waiting for the disk: `record` is what the table said.
  pb::Job describe(const JobRecord& record) const;

  // An upload's files are kept, for jobs that may use its scene. Returns what is to be told in the log; empty: nothing.
  std::string keep_upload(const SceneBundle& bundle);

  // `told` is called when the state folder takes no more changes (full, read-only, locked), with the reason, and when it
  // takes some again, which is tried each second; on the thread that has found out. To be set before begin(). Empty:
  // from the return on nobody is told.
  void on_state(std::function<void(const Status& state)> told);
  bool takes_changes() const { return takes_changes_; }

  // Nothing begins any more; what runs takes a checkpoint and goes back into the queue. False: something still runs at
  // that time (now_s() clock).
  bool drain(double deadline_s);
  // After drain(): watches end.
  void close();
  bool closed() const { return closed_; }

  // Sessions that the next daemon goes on with.
  SessionKeeper& sessions() { return sessions_; }

  // For the calls that may wait for the disk.
  TaskThread& calls() { return calls_; }
  Error too_many_calls() const;

 private:
  DurableJobs(ServiceCore& core, OutputRoots outputs, StateFolder folder, std::unique_ptr<JobTable> table);

  struct Running {
    std::string place;  // of the JobStore
    std::unique_ptr<JobAttempt> attempt;
    bool over = false;
  };

  std::optional<pb::SubmitJobResponse> find_again(const pb::SubmitJobRequest& asked, const std::string& owner) const;
  Status take_up(std::vector<std::string>& notices);  // what an earlier daemon has left
  void note_progress(const std::string& id);
  // Jobs that the table has as running, while none of them does, go back into the queue.
  Status take_up_running(const char* reason);
  void schedule();
  void forget_old();
  bool begin_next();
  void attempt_over(const std::string& id, const JobAttempt::Outcome& outcome);
  Result<JobRecord> stop_job(const std::string& id, JobState to, const std::string& by);
  void come_to_end(const std::string& id);
  void note_ended(const std::string& id);
  void wake();
  // For the log and the metrics. by: who asked for it; empty: the job came there by itself.
  void note_change(const JobRecord& job, const std::string& by) noexcept;
  // How a write to the table went; errors that are not the folder's do not count.
  void note_state(const Status& written) noexcept;
  void tell();
  void ask(const std::string& id, JobAttempt::Request request, const std::string& by);

  ServiceCore& core_;
  const OutputRoots outputs_;
  const StateFolder folder_;
  const std::unique_ptr<JobTable> table_;
  CheckpointFiles checkpoints_;
  SceneStore scenes_;
  JobStores stores_;
  SessionKeeper sessions_;

  static constexpr double kNever = std::numeric_limits<double>::infinity();
  static constexpr std::size_t kMaxWaitingCalls = 4096;
  static constexpr int kCallThreads = 16;  // those that come together share a commit

  std::atomic<bool> closed_ = false;
  mutable std::mutex listeners_mutex_;
  std::vector<std::weak_ptr<const std::function<void()>>> listeners_;

  std::mutex state_mutex_;  // of the two below; taken before mutex_
  std::function<void(const Status&)> told_;
  std::atomic<bool> takes_changes_ = true;

  mutable std::mutex mutex_;  // of the rest
  std::condition_variable changed_;
  std::map<std::string, Running> running_;     // by job
  std::map<std::string, KeptProgress> kept_progress_;  // by job, of those that are not at their end
  std::map<std::string, double> not_before_;   // now_s(), of jobs that wait for what they lacked
  std::map<std::string, int> tries_;           // of these, in a row
  double look_again_s_ = kNever;               // now_s(): the state folder could not be asked, or told
  bool due_ = true, draining_ = false, stopping_ = false;
  bool beginning_ = false;  // a job is on its way from the table to running_
  // Why the table may have jobs as running that nobody runs, because it took no row yet; null: it has none. Only of
  // open() and the scheduler.
  const char* left_running_ = nullptr;
  double forget_at_s_ = 0;
  std::atomic<int> ended_since_{0};             // jobs, since old ones were looked for
  std::atomic<std::uint64_t> bytes_since_{0};  // of pictures in the state folder
  std::thread thread_;
  TaskThread calls_{kMaxWaitingCalls, kCallThreads};  // last: a call in hand may use anything above
};

}  // namespace helio
