#include "server/jobs/durable_jobs.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <new>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/base/unix_time.h"
#include "renderer/codec/atomic_file.h"
#include "renderer/codec/sha256.h"
#include "server/base/guarded.h"
#include "server/base/log_format.h"
#include "server/base/retry.h"
#include "server/jobs/job_messages.h"
#include "server/jobs/kept_checkpoint.h"
#include "server/jobs/leftovers.h"
#include "server/sessions/session_registry.h"
#include "server/stream/settings_messages.h"

namespace helio {
namespace {

constexpr std::size_t kMaxName = 256, kMaxClientToken = 128;
constexpr int kMostPriority = 100, kMostPageSize = 1000, kDefaultPageSize = 100;
// Between looks for jobs that are not to be kept, unless so many have come to their end, or a part of the pictures that
// the state folder may hold was written.
constexpr double kForgetSeconds = 3600;
constexpr int kForgetJobs = 100;
constexpr std::uint64_t kForgetShare = 50;
constexpr int kMostSummedViews = 16;  // of more, the views of a request are kept apart
constexpr double kTryAgainSeconds = 1;   // where the state folder takes no row
constexpr int kMostDoublings = 7;        // of the wait of a job that lacked something
constexpr char kDaemonEnded[] = "the daemon ended while it ran";
constexpr char kNoThread[] = "the machine had no thread or memory for it";
constexpr double kFreshSeconds = 2;      // age of a running job's checkpoint that is shown as it is

// not_found: there is no checkpoint that is whole; internal: its header cannot be read.
Result<CheckpointHeader> header_of(const CheckpointFiles::Newest& newest) {
  if (!newest.file) return Error{ErrorCode::not_found, "there is no checkpoint that is whole", {}};
  return CheckpointHeader::read(newest.file->header);
}

bool has_control(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; });
}

void check_text(const std::string& text, std::size_t most, const char* where, Problems& problems) {
  if (text.size() <= most && !has_control(text)) return;
  problems.add(where, fmt::format("{} bytes{}; allowed: at most {}, without control characters", text.size(),
                                  has_control(text) ? ", control characters among them" : "", most));
}

void check_priority(int priority, Problems& problems) {
  if (priority >= -kMostPriority && priority <= kMostPriority) return;
  problems.add("priority", fmt::format("{}; allowed: [-{}, {}]", priority, kMostPriority, kMostPriority));
}

void check_request(const pb::SubmitJobRequest& request, Problems& problems) {
  check_text(request.client_token(), kMaxClientToken, "client_token", problems);
  check_text(request.name(), kMaxName, "name", problems);
  check_priority(request.priority(), problems);
  if (!request.has_job()) problems.add("job", "is required");
  if (request.job().preview_tiles())
    problems.add("job.preview_tiles", "true; allowed: false, for nobody takes the tiles of a job that is kept");
  if (request.job().detach()) problems.add("job.detach", "true; allowed: false, for every such job is kept");
  const auto views = std::uint32_t(std::max(1, request.job().views_size()));
  if (request.has_output()) OutputRoots::check(request.output().path(), views, "output.path", problems);
}

// A picture in a file of its own costs nobody bandwidth, so it is compressed unless its format says otherwise.
void complete(pb::SubmitJobRequest& request, const RenderSettings& settings, const Budget& budget) {
  pb::RunJobRequest& job = *request.mutable_job();
  *job.mutable_settings() = to_message(settings);
  *job.mutable_budget() = to_message(budget);
  if (job.format().compression() == pb::COMPRESSION_UNSPECIFIED)
    job.mutable_format()->set_compression(pb::COMPRESSION_ZIP);
}

}  // namespace

DurableJobs::DurableJobs(ServiceCore& core, OutputRoots outputs, StateFolder folder, std::unique_ptr<JobTable> table)
    : core_(core),
      outputs_(std::move(outputs)),
      folder_(std::move(folder)),
      table_(std::move(table)),
      checkpoints_(folder_.checkpoints()),
      scenes_(folder_.scenes(), core.config.max_state_scene_bytes),
      stores_{core,     *table_,           checkpoints_,
              scenes_,  outputs_,          folder_.results(),
              core.config.checkpoint_interval_s, {}},
      sessions_(core, folder_.sessions(), scenes_) {}

Result<std::unique_ptr<DurableJobs>> DurableJobs::open(ServiceCore& core, const std::string& folder,
                                                       std::vector<std::string>& notices) {
  auto outputs = OutputRoots::open(core.config.output_roots);
  if (!outputs) return outputs.error();
  auto held = StateFolder::open(folder);
  if (!held) return held.error();
  auto table = JobTable::open(held->jobs_file(), notices);
  if (!table) return table.error();
  std::unique_ptr<DurableJobs> jobs(
      new DurableJobs(core, std::move(*outputs), std::move(*held), std::move(*table)));
  if (const Status taken = jobs->take_up(notices); !taken.ok()) return taken.error();
  return jobs;
}

void DurableJobs::begin() {
  core_.jobs.on_removed([this] { wake(); });
  thread_ = std::thread([this] { schedule(); });
  sessions_.begin();
}

DurableJobs::~DurableJobs() {
  core_.jobs.on_removed({});
  {
    const std::lock_guard lock(mutex_);
    draining_ = stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  std::vector<std::unique_ptr<JobAttempt>> attempts;  // each ends as with a drain, and says so below
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, running] : running_) attempts.push_back(std::move(running.attempt));
  }
}

Status DurableJobs::take_up(std::vector<std::string>& notices) {
  table_->on_events([this] { tell(); });
  if (const Status opened = checkpoints_.open(); !opened.ok()) return opened;
  if (const Status opened = sessions_.open(notices); !opened.ok()) return opened;
  std::vector<SceneStore::Held> held = sessions_.held();
  std::vector<JobRecord> unfinished;
  for (const JobState state : {JobState::queued, JobState::running, JobState::paused}) {
    const auto jobs = table_->in_state(state);
    if (!jobs) return jobs.error();
    for (const JobRecord& job : *jobs) {
      held.push_back({job.id, job.scene_id});
      unfinished.push_back(job);
      note_progress(job.id);
    }
  }
  clear_outputs(outputs_, unfinished);
  clear_results(folder_.results(), *table_, core_.config.keep_jobs_days, notices);
  if (const Status opened = scenes_.open(held); !opened.ok()) return opened;
  const Status taken = take_up_running(kDaemonEnded);
  if (taken.ok() || taken.error().code != ErrorCode::unavailable) return taken;
  // As where another program has it locked. Reading goes on, and no job begins before a row can be written.
  left_running_ = kDaemonEnded;
  notices.push_back(taken.error().to_string() + "; jobs wait until it can be written");
  return ok_status();
}

Status DurableJobs::take_up_running(const char* reason) {
  const auto jobs = table_->in_state(JobState::running);
  if (!jobs) return jobs.error();
  for (const JobRecord& job : *jobs) {
    {
      const std::lock_guard lock(mutex_);
      if (running_.contains(job.id)) continue;
    }
    JobChange change;
    change.from = {JobState::running};
    change.reason = reason;
    const auto changed = table_->change(job.id, change);
    if (!changed) return changed.error();
    note_change(*changed, {});
    if (is_final(changed->state)) come_to_end(job.id);
  }
  return ok_status();
}

// As the job's newest checkpoint tells, without a look at the picture.
void DurableJobs::note_progress(const std::string& id) {
  const auto newest = checkpoints_.read_head(id);
  const auto header = header_of(newest);
  if (auto kept = header ? kept_progress(*header) : std::nullopt) kept_progress_[id] = std::move(*kept);
}

Result<pb::SubmitJobResponse> DurableJobs::submit(const pb::SubmitJobRequest& asked, const Caller& caller,
                                                  const std::string& by) {
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting.error();
  Problems problems;
  check_request(asked, problems);
  if (problems.empty() && !asked.client_token().empty()) {
    // Sent again, it is there, whatever has become of its scene and its output meanwhile.
    if (auto again = find_again(asked, caller.name)) return std::move(*again);
  }
  auto planned = plan_job(core_, asked.job(), "job");
  if (!planned && planned.error().code == ErrorCode::invalid_argument)
    problems.add(planned.error().where, planned.error().message);
  if (!problems.empty()) return problems.to_error();
  if (!planned) return planned.error();
  const JobPlan& plan = planned->plan;
  pb::SubmitJobRequest request = asked;
  complete(request, plan.settings, plan.budget);
  for (std::uint32_t view = 0; request.has_output() && view < plan.views.size(); ++view) {
    const auto file = outputs_.file_of(request.output().path(), view, "output.path");
    if (!file) return file.error();
    std::error_code error;
    if (!request.output().overwrite() && std::filesystem::exists(std::filesystem::symlink_status(*file, error)))
      return Error{ErrorCode::failed_precondition, "'" + *file + "' is there already, and overwrite is not set",
                   "output.path"};
  }

  JobRecord record;
  record.id = make_id("j-");
  record.owner = caller.name;
  record.client_token = request.client_token();
  record.name = request.name();
  record.request = request.SerializeAsString();
  if (request.job().views_size() > kMostSummedViews) {
    request.mutable_job()->clear_views();
    record.summary = request.SerializeAsString();
  }
  record.scene_id = request.job().scene_id();
  record.priority = request.priority();
  record.views = std::uint32_t(plan.views.size());
  if (const Status held = scenes_.hold(*planned->scene, record.id); !held.ok()) return held.error();
  auto submitted = guarded([&] {
    return core_.job_quota.add(caller, [&] { return table_->submit(record, core_.config.max_queued_jobs, by); });
  });
  note_state(submitted ? ok_status() : Status(submitted.error()));
  if (!submitted || submitted->already_there) scenes_.release(record.id);
  if (!submitted) return submitted.error();
  wake();

  pb::SubmitJobResponse response;
  *response.mutable_job() = describe(submitted->job);
  response.set_already_there(submitted->already_there);
  const JobNotices notices = notices_of(plan, planned->scene->snapshot->features());
  response.mutable_unsampled()->Add(notices.unsampled.begin(), notices.unsampled.end());
  response.mutable_notices()->Add(notices.notices.begin(), notices.notices.end());
  if (!submitted->already_there) {
    spdlog::info("job submitted job={} name={} scene={} size={}x{} views={} priority={} by={}", record.id,
                 logged(record.name), record.scene_id.substr(0, 12), plan.settings.width, plan.settings.height,
                 record.views, record.priority, logged(by));
  }
  return response;
}

// The job of this token, if what is asked for is the same as far as it was given.
std::optional<pb::SubmitJobResponse> DurableJobs::find_again(const pb::SubmitJobRequest& asked,
                                                             const std::string& owner) const {
  const auto known = table_->find_token(owner, asked.client_token());
  if (!known || !*known) return std::nullopt;
  pb::SubmitJobRequest again = asked;
  Problems problems;
  const RenderSettings settings = read_settings(asked.job().settings(), core_.render_limits(), "", problems);
  const Budget budget = read_budget(asked.job().budget(), "", problems);
  complete(again, settings, budget);
  if (!problems.empty() || !JobTable::has_request(**known, again.SerializeAsString())) return std::nullopt;
  pb::SubmitJobResponse response;
  *response.mutable_job() = describe(**known);
  response.set_already_there(true);
  return response;
}

Result<pb::ListJobsResponse> DurableJobs::list(const pb::ListJobsRequest& request) const {
  Problems problems;
  if (request.page_size() < 0 || request.page_size() > kMostPageSize) {
    problems.add("page_size", fmt::format("{}; allowed: [1, {}], or 0 for {}", request.page_size(), kMostPageSize,
                                          kDefaultPageSize));
  }
  std::vector<JobState> states;
  for (int i = 0; i < request.states_size(); ++i) {
    const auto state = read_job_state(pb::JobState(request.states(i)), fmt::format("states[{}]", i), problems);
    if (state) states.push_back(*state);
  }
  if (!problems.empty()) return problems.to_error();
  const int limit = request.page_size() > 0 ? request.page_size() : kDefaultPageSize;
  const auto page = table_->list(states, request.page_token(), limit);
  if (!page) return page.error();
  pb::ListJobsResponse response;
  for (const JobRecord& job : page->jobs) *response.add_jobs() = describe(job);
  response.set_next_page_token(page->next);
  response.set_total(page->total);
  return response;
}

Result<pb::Job> DurableJobs::get(const std::string& id) const {
  const auto record = table_->get(id);
  if (!record) return record.error();
  const auto results = table_->results(id);
  if (!results) return results.error();
  pb::Job job = describe(*record);
  for (const JobResult& result : *results) *job.add_results() = to_message(result, job.has_output());
  return job;
}

pb::Job DurableJobs::describe(const JobRecord& record) const {
  pb::Job job = to_message(record);
  const std::lock_guard lock(mutex_);
  const auto kept = kept_progress_.find(record.id);
  if (kept != kept_progress_.end() && !is_final(record.state) && kept->second.view == record.views_done) {
    *job.mutable_progress() = kept->second.progress;
    job.mutable_progress()->set_samples_per_second(0);  // nothing is rendered
    job.set_checkpoint_s(kept->second.checkpoint_s);
  }
  const auto found = running_.find(record.id);
  if (found == running_.end() || found->second.over || !found->second.attempt) return job;
  const JobAttempt& attempt = *found->second.attempt;
  if (const auto newest = attempt.kept(); newest && newest->view == record.views_done)
    job.set_checkpoint_s(newest->checkpoint_s);
  if (const auto progress = attempt.progress()) {
    *job.mutable_progress() = to_message(progress->frame, record.id);
    if (progress->left) {
      job.mutable_left()->set_seconds(progress->left->seconds);
      job.mutable_left()->set_low_s(progress->left->low_s);
      job.mutable_left()->set_high_s(progress->left->high_s);
    }
  }
  return job;
}

void DurableJobs::on_state(std::function<void(const Status&)> told) {
  const std::lock_guard lock(state_mutex_);
  told_ = std::move(told);
}

void DurableJobs::note_state(const Status& written) noexcept {
  const bool ok = written.ok();
  if (!ok && written.error().code != ErrorCode::unavailable && written.error().code != ErrorCode::internal) return;
  if (ok && takes_changes_) return;
  const std::lock_guard lock(state_mutex_);
  if (takes_changes_.exchange(ok) == ok) return;
  if (!ok) {
    const std::lock_guard scheduler(mutex_);
    look_again_s_ = std::min(look_again_s_, now_s() + kTryAgainSeconds);
    changed_.notify_all();
  }
  try {
    if (ok) {
      spdlog::info("the state folder takes changes again folder={}", logged(folder_.path()));
    } else {
      spdlog::error("the state folder takes no changes folder={} error={}", logged(folder_.path()),
                    logged(written.error().to_string()));
    }
    if (told_) told_(written);
  } catch (const std::bad_alloc&) {  // the next change is told
  }
}

void DurableJobs::note_change(const JobRecord& job, const std::string& by) noexcept {
  if (job.state == JobState::succeeded) core_.counters.jobs_succeeded.add();
  if (job.state == JobState::failed) core_.counters.jobs_failed.add();
  if (job.state == JobState::canceled) core_.counters.jobs_canceled.add();
  try {
    std::string line = fmt::format("job {} job={} attempt={}", to_word(job.state), job.id, job.attempt);
    if (is_final(job.state) && job.started_s > 0) line += fmt::format(" seconds={:.3f}", job.ended_s - job.started_s);
    if (!by.empty()) line += " by=" + logged(by);
    if (!job.reason.empty()) line += " reason=" + logged(job.reason);
    spdlog::info("{}", line);
  } catch (const std::bad_alloc&) {  // the line is lost, and the job goes its way
  }
}

void DurableJobs::ask(const std::string& id, JobAttempt::Request request, const std::string& by) {
  const std::lock_guard lock(mutex_);
  const auto found = running_.find(id);
  if (found != running_.end() && found->second.attempt) found->second.attempt->ask(request, by);
}

// A running job is asked; another changes at once. Which it is may change between the two.
Result<JobRecord> DurableJobs::stop_job(const std::string& id, JobState to, const std::string& by) {
  for (;;) {
    JobChange change;
    change.to = to;
    change.by = by;
    const auto record = table_->get(id);
    if (!record) return record.error();
    if (record->state != JobState::running) {
      change.from = {record->state};
      auto changed = table_->change(id, change);
      if (!changed && changed.error().code == ErrorCode::failed_precondition) {
        const auto now = table_->get(id);
        if (now && now->state != record->state) continue;
      }
      if (changed) note_change(*changed, by);
      if (changed && is_final(to)) {
        come_to_end(id);
        note_ended(id);
      }
      return changed;
    }
    auto asked = table_->set_target(id, to, by);
    if (!asked && asked.error().code == ErrorCode::failed_precondition) {
      const auto now = table_->get(id);
      if (!now || now->state != record->state || now->attempt != record->attempt) continue;  // its attempt has ended
    }
    if (asked) ask(id, to == JobState::paused ? JobAttempt::Request::pause : JobAttempt::Request::cancel, by);
    return asked;
  }
}

Result<pb::Job> DurableJobs::pause(const std::string& id, const std::string& by) {
  const auto record = stop_job(id, JobState::paused, by);
  if (!record) return record.error();
  return describe(*record);
}

Status DurableJobs::cancel(const std::string& id, const std::string& by) {
  const auto record = stop_job(id, JobState::canceled, by);
  if (!record) return record.error();
  return ok_status();
}

Result<std::string> DurableJobs::owner_of(const std::string& id) const {
  const auto record = table_->get(id);
  if (!record) return record.error();
  return record->owner;
}

Result<pb::Job> DurableJobs::resume(const std::string& id, const std::string& by) {
  JobChange change;
  change.to = JobState::queued;
  change.from = {JobState::paused};
  change.by = by;
  const auto record = table_->change(id, change);
  if (!record) return record.error();
  note_change(*record, by);
  wake();
  return describe(*record);
}

Result<pb::Job> DurableJobs::set_priority(const std::string& id, int priority) {
  Problems problems;
  check_priority(priority, problems);
  if (!problems.empty()) return problems.to_error();
  const auto record = table_->set_priority(id, priority);
  if (!record) return record.error();
  return describe(*record);
}

Result<DurableJobs::ResultFile> DurableJobs::result(const std::string& id, std::uint32_t view) const {
  const auto record = table_->get(id);
  if (!record) return record.error();
  if (view >= record->views) {
    return Error{ErrorCode::not_found, fmt::format("{}; the job has views [0, {}]", view, record->views - 1), "view"};
  }
  const auto results = table_->results(id);
  if (!results) return results.error();
  for (const JobResult& result : *results) {
    if (result.view == view) return ResultFile{to_message(result, to_message(*record).has_output()), result.file};
  }
  return Error{ErrorCode::failed_precondition,
               fmt::format("view {} is not done; the job is {}, with {} of {} views done", view,
                           to_string(record->state), record->views_done, record->views),
               "view"};
}

Result<DurableJobs::ResultTiles> DurableJobs::tiles(const pb::GetResultRequest& asked, const Caller& caller) {
  const auto record = table_->get(asked.job_id());
  if (!record) return record.error();
  pb::SubmitJobRequest request;
  request.ParseFromString(record->summary);
  Problems problems;
  JobTiles::Request wanted;
  wanted.settings = read_settings(request.job().settings(), core_.render_limits(), "settings", problems);
  wanted.format = read_tile_format(asked.tiles().format(), "tiles.format", problems, core_.oidn != nullptr);
  const PixelRect region = wanted.settings.rendered_region();
  wanted.window = region;
  if (asked.tiles().has_window()) {
    const pb::Rect& window = asked.tiles().window();
    wanted.window = {window.x0(), window.y0(), window.x1(), window.y1()};
    const PixelRect& w = wanted.window;
    if (w.x0 >= w.x1 || w.y0 >= w.y1 || intersect(w, region) != w) {
      problems.add("tiles.window", fmt::format("[{}, {}) x [{}, {}); allowed: a part of [{}, {}) x [{}, {})", w.x0,
                                               w.x1, w.y0, w.y1, region.x0, region.x1, region.y0, region.y1));
    }
  }
  if (!problems.empty()) return problems.to_error();

  const std::uint64_t planes = std::uint64_t(region.area()) * 32 * sizeof(float);  // of a file, with all its channels
  const std::uint64_t checkpoint = checkpoint_bytes(wanted.settings) + kMostHeaderBytes;
  auto memory = core_.memory_of(caller).reserve_with_room(
      std::max(2 * planes, film_bytes(wanted.settings) + checkpoint), "the picture of a job");
  if (!memory) return memory.error();
  const auto whole = [&](std::span<const std::uint8_t> file, pb::JobView view) -> Result<ResultTiles> {
    auto tiles = JobTiles::of_file(file, wanted);
    if (!tiles) return tiles.error();
    tiles->count(std::move(*memory));
    return ResultTiles{std::move(view), std::move(*tiles)};
  };
  auto done = result(asked.job_id(), asked.view());
  if (done) {
    const FileDescriptor file = open(*done);
    const auto bytes = read_whole_file(file, done->file, 2 * planes);
    if (!bytes) return Error{ErrorCode::not_found, "'" + done->file + "' is gone, or cannot be read", "view"};
    Sha256 hash;
    hash.update(*bytes);
    if (to_hex(hash.finish()) != done->view.sha256()) {
      return Error{ErrorCode::internal,
                   fmt::format("'{}' is not the picture any more, which had the SHA-256 {}", done->file,
                               done->view.sha256()),
                   "view"};
    }
    return whole(*bytes, std::move(done->view));
  }
  if (done.error().code != ErrorCode::failed_precondition || asked.view() != record->views_done ||
      is_final(record->state)) {
    return done.error();
  }
  bool running = false;
  {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(record->id);
    running = found != running_.end() && !found->second.over && found->second.attempt;
    if (running) found->second.attempt->checkpoint_soon(kFreshSeconds);
  }
  auto newest = checkpoints_.look(record->id, std::max(checkpoint, 2 * planes));
  const auto header = header_of(newest);
  pb::JobView view;
  view.set_view(asked.view());
  if (header && header->view == asked.view() && header->frame_end) {
    view.mutable_end()->ParseFromString(*header->frame_end);
    return whole(newest.file->body, std::move(view));
  }
  if (!can_checkpoint(wanted.settings)) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("view {} is not done, and mode {} with variant {} has no checkpoints that could be shown",
                             asked.view(), to_string(wanted.settings.mode), to_string(wanted.settings.variant)),
                 "view"};
  }
  if (!header || header->view != asked.view()) {
    return Error{running ? ErrorCode::unavailable : ErrorCode::failed_precondition,
                 fmt::format("view {} has no checkpoint{}", asked.view(), running ? " so far" : ""), "view",
                 running ? kFreshSeconds / 2 : 0};
  }
  const auto picture = PictureCheckpoint::decode(std::move(newest.file->body), wanted.settings);
  if (!picture) return picture.error();
  if (const auto kept = kept_progress(*header)) *view.mutable_end()->mutable_totals() = kept->progress;
  ResultTiles tiles{std::move(view), JobTiles::of_checkpoint(*picture, wanted)};
  tiles.tiles.count(std::move(*memory));
  return tiles;
}

DurableJobs::Listener DurableJobs::listen(std::function<void()> told) {
  auto listener = std::make_shared<const std::function<void()>>(std::move(told));
  const std::lock_guard lock(listeners_mutex_);
  std::erase_if(listeners_, [](const auto& one) { return one.expired(); });
  listeners_.push_back(listener);
  return listener;
}

void DurableJobs::tell() {
  const std::lock_guard lock(listeners_mutex_);
  for (const auto& one : listeners_) {
    if (const Listener listener = one.lock()) (*listener)();
  }
}

std::string DurableJobs::keep_upload(const SceneBundle& bundle) {
  const Status kept = scenes_.keep_upload(bundle);
  return kept.ok() ? std::string() : "jobs that are kept cannot use this upload: " + kept.error().to_string();
}

Error DurableJobs::too_many_calls() const {
  return {ErrorCode::resource_exhausted, fmt::format("{} calls about jobs wait already", kMaxWaitingCalls), {},
          kRetrySeconds};
}

void DurableJobs::wake() {
  const std::lock_guard lock(mutex_);
  due_ = true;
  changed_.notify_all();
}

void DurableJobs::schedule() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    std::vector<std::unique_ptr<JobAttempt>> over;  // ended outside the lock
    if (!guarded([&] { return over.reserve(running_.size()), ok_status(); }).ok()) {
      changed_.wait_for(lock, std::chrono::duration<double>(kTryAgainSeconds));
      continue;
    }
    for (auto it = running_.begin(); it != running_.end();) {
      if (it->second.over) over.push_back(std::move(it->second.attempt));
      it = it->second.over ? running_.erase(it) : std::next(it);
    }
    const double now = now_s();
    double next = std::min(forget_at_s_, look_again_s_);
    for (const auto& [id, at_s] : not_before_) next = std::min(next, at_s);
    if (over.empty() && !(due_ && !draining_) && now < next) {
      changed_.wait_for(lock, std::chrono::duration<double>(next - now));
      continue;
    }
    bool due = std::exchange(due_, false);
    due |= std::erase_if(not_before_, [&](const auto& one) { return one.second <= now; }) > 0;
    if (look_again_s_ <= now) {
      due = true;
      look_again_s_ = kNever;
    }
    beginning_ = due && !draining_;
    const bool begin = beginning_;
    lock.unlock();
    over.clear();
    const Status done = guarded([&]() -> Status {
      if (left_running_ && begin) {
        if (const Status taken = take_up_running(left_running_); !taken.ok()) return taken;
        left_running_ = nullptr;
      }
      if (now >= forget_at_s_ || ended_since_ >= kForgetJobs ||
          bytes_since_ > core_.config.max_state_result_bytes / kForgetShare) {
        forget_old();
      }
      if (!takes_changes_) note_state(table_->probe());
      while (begin && begin_next()) {
      }
      return ok_status();
    });
    lock.lock();
    beginning_ = false;
    if (!done.ok()) {
      look_again_s_ = now_s() + kTryAgainSeconds;
      // Without memory the line is lost.
      (void)guarded([&] {
        spdlog::error("no job could be begun error={}", logged(done.error().to_string()));
        return ok_status();
      });
    }
    if (!takes_changes_) look_again_s_ = std::min(look_again_s_, now_s() + kTryAgainSeconds);
    changed_.notify_all();
  }
}

void DurableJobs::forget_old() {
  forget_at_s_ = now_s() + kForgetSeconds;
  ended_since_ = 0;
  bytes_since_ = 0;
  JobTable::Kept kept;
  kept.since_s = unix_time_s() - core_.config.keep_jobs_days * 86400;
  kept.jobs = std::uint64_t(core_.config.max_ended_jobs);
  kept.bytes = core_.config.max_state_result_bytes;
  kept.folder = folder_.results();
  const auto ids = table_->forget_ended(kept);
  if (!ids) return spdlog::warn("old jobs could not be forgotten error={}", logged(ids.error().to_string()));
  for (const std::string& id : *ids) {
    come_to_end(id);
    std::error_code error;
    std::filesystem::remove_all(result_folder(folder_.results(), id), error);
  }
}

// The queued job whose turn it is. False: there is none, or no place.
bool DurableJobs::begin_next() {
  std::vector<std::string> except;
  {
    const std::lock_guard lock(mutex_);
    if (draining_) return false;
    for (const auto& [id, running] : running_) except.push_back(id);
    for (const auto& [id, at_s] : not_before_) except.push_back(id);
  }
  const auto next = table_->next_queued(except);
  if (!next) {
    spdlog::error("the next job is not known error={}", logged(next.error().to_string()));
    const std::lock_guard lock(mutex_);
    look_again_s_ = now_s() + kTryAgainSeconds;
    return false;
  }
  if (!*next) return false;
  auto place = core_.jobs.reserve();
  if (!place) return false;
  auto record = guarded([&] {
    pb::SubmitJobRequest request;
    request.ParseFromString((*next)->summary);
    JobChange change;
    change.to = JobState::running;
    change.from = {JobState::queued};
    // That of the views that are done stays.
    if ((*next)->views_done == 0) change.build = rendering_build(request.job().settings().device());
    auto whole = table_->request((*next)->id);
    if (!whole) return Result<JobRecord>(whole.error());
    auto begun = table_->change((*next)->id, change);
    if (begun) begun->request = std::move(*whole);
    return begun;
  });
  note_state(record ? ok_status() : Status(record.error()));
  if (!record) {
    core_.jobs.remove(*place);
    if (record.error().code == ErrorCode::failed_precondition) return true;  // it was paused or cancelled
    spdlog::error("job cannot begin job={} error={}", (*next)->id, logged(record.error().to_string()));
    const std::lock_guard lock(mutex_);
    due_ = false;  // the place that was given back is no reason to look again at once
    look_again_s_ = now_s() + kTryAgainSeconds;
    return false;
  }
  const std::string& id = record->id;
  Status made = ok_status();
  {
    const std::lock_guard lock(mutex_);
    made = guarded([&] {
      Running& running = running_[id];
      running.place = *place;
      running.attempt = std::make_unique<JobAttempt>(
          stores_, *record, [this, id](const JobAttempt::Outcome& outcome) { attempt_over(id, outcome); });
      return ok_status();
    });
    if (made.ok() && draining_) running_[id].attempt->ask(JobAttempt::Request::suspend, {});
    if (!made.ok()) {
      running_.erase(id);
      look_again_s_ = now_s() + kTryAgainSeconds;
    }
  }
  if (!made.ok()) {
    spdlog::error("job cannot begin job={} error={}", id, logged(made.error().to_string()));
    core_.jobs.remove(*place);
    left_running_ = kNoThread;
    const Status back = guarded([&] { return take_up_running(kNoThread); });
    if (back.ok()) left_running_ = nullptr;
    return false;
  }
  spdlog::info("job begun job={} attempt={}", id, (*next)->attempt + 1);
  // Who asked for an end before the attempt was there has left it in the table.
  const auto asked = table_->get(id);
  if (asked && asked->target == JobState::paused) ask(id, JobAttempt::Request::pause, asked->target_by);
  if (asked && asked->target == JobState::canceled) ask(id, JobAttempt::Request::cancel, asked->target_by);
  return true;
}

// On the attempt's thread, as the last of it.
void DurableJobs::attempt_over(const std::string& id, const JobAttempt::Outcome& outcome) {
  std::optional<JobState> state;  // that was written
  for (;;) {
    const auto changed = table_->change(id, outcome.change);
    note_state(changed ? ok_status() : Status(changed.error()));
    if (changed) {
      state = changed->state;
      note_change(*changed, outcome.change.by);
      break;
    }
    spdlog::error("job's state cannot be written job={} error={}", id, logged(changed.error().to_string()));
    const ErrorCode code = changed.error().code;
    if (code == ErrorCode::not_found || code == ErrorCode::failed_precondition) {
      // It was written by a call before this one, which had no memory for the rest.
      if (const auto now = table_->get(id)) state = now->state;
      break;
    }
    std::unique_lock lock(mutex_);
    // A daemon that ends leaves it to the next one, which finds the job running.
    const auto wait = std::chrono::duration<double>(kTryAgainSeconds);
    if (changed_.wait_for(lock, wait, [this] { return stopping_ || draining_; })) break;
  }
  // Without the row, the next daemon finds the job running, and needs all of it.
  if (state && is_final(*state)) {
    come_to_end(id);
    note_ended(id);
  }
  std::string place;
  {
    const std::lock_guard lock(mutex_);
    Running& running = running_.at(id);
    if (const auto kept = running.attempt ? running.attempt->kept() : std::nullopt) kept_progress_[id] = *kept;
    if (state && is_final(*state)) kept_progress_.erase(id);
    if (state == JobState::queued && outcome.retry_after_s > 0) {
      // What is lacking may never come: each try waits twice as long as the one before.
      const int tries = std::min(tries_[id]++, kMostDoublings);
      not_before_[id] = now_s() + std::ldexp(outcome.retry_after_s, tries);
    } else {
      tries_.erase(id);
    }
    place = running.place;
  }
  core_.jobs.remove(place);  // wakes the scheduler
  const std::lock_guard lock(mutex_);
  running_.at(id).over = true;
  due_ = true;
  changed_.notify_all();
}

void DurableJobs::come_to_end(const std::string& id) {
  scenes_.release(id);
  checkpoints_.remove(id);
  const std::lock_guard lock(mutex_);
  kept_progress_.erase(id);
  tries_.erase(id);
  not_before_.erase(id);
}

// Old jobs are looked for as soon as that is worth it.
void DurableJobs::note_ended(const std::string& id) {
  const auto results = table_->results(id);
  for (std::size_t i = 0; results && i < results->size(); ++i) {
    const JobResult& result = (*results)[i];
    if (result.file.starts_with(folder_.results() + "/")) bytes_since_ += result.bytes;
  }
  ++ended_since_;
}

bool DurableJobs::drain(double deadline_s) {
  std::unique_lock lock(mutex_);
  draining_ = true;
  for (auto& [id, running] : running_) {
    if (!running.over && running.attempt) running.attempt->ask(JobAttempt::Request::suspend, {});
  }
  changed_.notify_all();
  const auto left = std::chrono::duration<double>(std::max(0.0, deadline_s - now_s()));
  return changed_.wait_for(lock, left, [this] {
    return !beginning_ && std::all_of(running_.begin(), running_.end(), [](const auto& one) { return one.second.over; });
  });
}

void DurableJobs::close() {
  closed_ = true;
  tell();
}

}  // namespace helio
