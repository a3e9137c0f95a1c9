// One attempt at a job that the daemon keeps: loads the scene, goes on from the newest checkpoint, renders view after
// view, writes their files, and says what becomes of the job.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "heliograph/v1/durable_job.pb.h"
#include "renderer/codec/sha256.h"
#include "renderer/frame/picture_checkpoint.h"
#include "server/jobs/checkpoint_header.h"
#include "server/jobs/job_picture.h"
#include "server/jobs/job_plan.h"
#include "server/jobs/job_stores.h"
#include "server/jobs/time_left.h"

namespace helio {

// What the bits of a picture depend on beside scene and settings: build, instruction path, and the device where it is
// not the processor (RenderSettings.device).
std::string rendering_build(const std::string& device);

// How far a view is, by its newest checkpoint.
struct KeptProgress {
  std::uint32_t view = 0;
  pb::Progress progress;
  double checkpoint_s = 0;  // Unix time
};
// Nothing: the checkpoint is of a finished view, or does not tell.
std::optional<KeptProgress> kept_progress(const CheckpointHeader& header);

class JobAttempt {
 public:
  // What is asked of it while it runs; the later one counts more.
  enum class Request {
    none,
    suspend,  // the daemon stops: back into the queue
    pause,
    cancel,
  };
  struct Outcome {
    JobChange change;          // of the job, which is running
    double retry_after_s = 0;  // of one that goes back into the queue: not before
  };

  // record: running. Begins at once, on a thread of its own; over(): the outcome is in the table, and the thread does
  // nothing more but call this.
  JobAttempt(JobStores& stores, JobRecord record, std::function<void(const Outcome&)> over);
  ~JobAttempt();  // as suspend(), and waits

  // Thread safe, and return at once. With pause and suspend a checkpoint is taken before the attempt ends. by: who asks.
  void ask(Request request, const std::string& by);
  struct Progress {
    FrameProgress frame;           // of the view in hand
    std::optional<TimeLeft> left;  // of all views
  };
  std::optional<Progress> progress() const;  // nothing: none is rendered yet
  // What its newest checkpoint says; nothing: it has written none.
  std::optional<KeptProgress> kept() const;
  // Asks for a checkpoint of the view in hand, unless its newest one is at most so old, or so young that another would
  // take more than 2 % of the time.
  void checkpoint_soon(double max_age_s);
  const std::string& job_id() const { return record_.id; }

 private:
  // What the newest checkpoint of a view has; without a header: there is none.
  struct Resumed {
    std::optional<CheckpointHeader> header;
    std::shared_ptr<const PictureCheckpoint> picture;  // of a view on its way
    std::vector<std::uint8_t> file;                    // of one that is rendered
    Reservation memory;                                // for the file
  };

  void run();
  Outcome work();
  std::uint32_t first_view();
  Status load();
  MemoryAccount& account();
  Status begin_rendering();
  Result<Resumed> find_checkpoint(std::uint32_t view);
  // These answer what becomes of the job, or nothing: it goes on.
  std::optional<Outcome> render_view(std::uint32_t view);
  std::variant<FrameEnd, Outcome> wait_for_end(std::uint32_t view);
  std::optional<Outcome> finish_view(std::uint32_t view, const FrameEnd& end);
  pb::PictureOrigin origin_of(std::uint32_t view) const;
  std::optional<Outcome> write_view(std::uint32_t view, std::span<const std::uint8_t> bytes,
                                    const std::string& frame_end);
  std::optional<Outcome> on_another_build(const std::string& build);
  Status keep_view(std::uint32_t view, std::span<const std::uint8_t> bytes, const std::string& frame_end);
  void note(const std::string& text);
  void write_checkpoint(std::uint32_t view, const PictureCheckpoint& checkpoint);
  void look_at_device();
  Result<std::string> place_of(std::uint32_t view) const;
  Status write_file(const std::string& file, std::span<const std::uint8_t> bytes, const Sha256Digest& digest) const;
  std::optional<Outcome> asked_to_stop() const;
  static Outcome stopped(Request request, const std::string& by);

  JobStores& stores_;
  JobRecord record_;
  const std::function<void(const Outcome&)> over_;
  pb::SubmitJobRequest request_;
  std::string build_;               // rendering_build() of this process
  std::vector<std::string> notes_;  // what people should be told with the outcome
  std::optional<PlannedJob> planned_;
  std::shared_ptr<JobPicture> picture_;
  std::shared_ptr<RenderContext> rendering_;
  std::uint64_t revision_ = 0;  // of the view in hand
  bool same_bits_;
  CancelToken loading_;

  // What its thread is told, by callers and by the renderer, whose last word may come after the attempt.
  struct Signals {
    std::mutex mutex;
    std::condition_variable changed;
    Request asked = Request::none;
    std::string asked_by;
    bool frame_ended = false;
    std::shared_ptr<const PictureCheckpoint> checkpoint;  // to be written; null: none
    std::weak_ptr<RenderContext> rendering;               // whose progress is told
    std::optional<KeptProgress> kept;
    std::atomic<double> next_asked_s = 0;                 // a checkpoint that somebody asks for; seconds since 1970
    ErrorCurve curve;                                     // of the view in hand
    std::uint32_t views_left = 0;                         // after it
  };
  const std::shared_ptr<Signals> signals_ = std::make_shared<Signals>();
  std::thread thread_;
};

}  // namespace helio
