#include "server/app/metrics_page.h"

#include <utility>

#include "renderer/base/clock.h"
#include "renderer/base/unix_time.h"
#include "server/base/build_info.h"
#include "server/metrics/exposition.h"
#include "server/metrics/process_use.h"

namespace helio {
namespace {

void tell_sessions_and_jobs(Exposition& page, CompareCore& compare, const DurableJobs* jobs) {
  ServiceCore& core = compare.core;
  int attached = 0, idle = 0;
  for (const auto& session : core.sessions.list()) ++(session->idle_s() > 0 ? idle : attached);
  page.gauge("heliograph_sessions", "Sessions, with a stream (attached) and without one (idle).")
      .add(attached, {{"state", "attached"}})
      .add(idle, {{"state", "idle"}});
  page.gauge("heliograph_scenes", "Scenes that are held, loaded and edited ones.")
      .add(double(core.scenes.list().size()));

  auto by_state = page.gauge("heliograph_jobs",
                             "Jobs by state: those that the daemon keeps (kept) and those of calls of RunJob (call).");
  by_state.add(double(core.jobs.of_calls()), {{"kind", "call"}, {"state", "running"}});
  if (jobs) {
    if (const auto counts = jobs->table().counts()) {
      for (const JobState state : kJobStates)
        by_state.add(double((*counts)[std::size_t(state)]), {{"kind", "kept"}, {"state", to_word(state)}});
    }
  }
  page.gauge("heliograph_state_writable", "1 while the state folder takes changes of jobs, 0 while not or without one.")
      .add(jobs && jobs->takes_changes() ? 1 : 0);
  page.counter("heliograph_jobs_ended_total", "Kept jobs that came to their end since the daemon began.")
      .add(double(core.counters.jobs_succeeded.value()), {{"state", "succeeded"}})
      .add(double(core.counters.jobs_failed.value()), {{"state", "failed"}})
      .add(double(core.counters.jobs_canceled.value()), {{"state", "canceled"}});

  auto waiting = page.gauge("heliograph_queue_length", "Requests that wait for a thread, by what they ask for.");
  const std::pair<const char*, std::size_t> queues[] = {
      {"loads", core.loader.waiting()},   {"edits", core.editor.waiting()},   {"replays", core.replayer.waiting()},
      {"lists", core.lister.waiting()},   {"films", core.films.waiting()},    {"devices", core.placer.waiting()},
      {"comparisons", compare.queue.waiting()}};
  for (const auto& [queue, length] : queues) waiting.add(double(length), {{"queue", queue}});
}

void tell_rendering(Exposition& page, const ServiceCore& core) {
  const RenderTotals done = core.engine.totals();
  page.counter("heliograph_samples_total", "Samples of pixels that were rendered.").add(double(done.samples));
  page.counter("heliograph_rays_total", "Rays that were traced: intersection and occlusion queries.")
      .add(double(done.rays));
  page.counter("heliograph_invalid_samples_total", "Samples that were NaN or infinite, and are in no picture.")
      .add(double(done.invalid_samples));
  page.counter("heliograph_render_seconds_total", "Processor time of the render threads, in seconds.")
      .add(core.engine.used_seconds());
  page.gauge("heliograph_render_threads", "Threads that render.").add(core.engine.threads());
}

void tell_streams(Exposition& page, const StreamCounters& streams) {
  page.counter("heliograph_stream_bytes_total", "Bytes of the messages sent on StreamFrames, WatchFrames and RunJob.")
      .add(double(streams.bytes.value()));
  page.counter("heliograph_stream_tiles_total", "Tiles sent on StreamFrames, WatchFrames and RunJob.")
      .add(double(streams.tiles.value()));
  page.counter("heliograph_superseded_tiles_total",
               "Tiles that were dropped before they were sent, for newer ones of the same place or for a newer view.")
      .add(double(streams.superseded_tiles.value()));
  page.histogram("heliograph_first_tile_seconds",
                 "Seconds from a change of a session's view to the first tile of it that was rendered.")
      .add(streams.first_preview, {{"picture", "preview"}})
      .add(streams.first_tile, {{"picture", "film"}});
  page.histogram("heliograph_picture_age_seconds",
                 "Seconds from a change of a session's view to the sending of the first tile of it at each place.")
      .add(streams.preview_age, {{"picture", "preview"}})
      .add(streams.picture_age, {{"picture", "film"}});
}

void tell_checkpoints(Exposition& page, const CheckpointCounters& checkpoints) {
  page.histogram("heliograph_checkpoint_seconds", "Seconds that a kept job's samples stood still for a checkpoint.")
      .add(checkpoints.pause);
  page.histogram("heliograph_checkpoint_write_seconds", "Seconds that writing a checkpoint to the disk took.")
      .add(checkpoints.write);
  page.counter("heliograph_checkpoint_failures_total", "Checkpoints that could not be written.")
      .add(double(checkpoints.failures.value()));
}

void tell_memory(Exposition& page, const MemoryAccount& memory) {
  auto by_owner = page.gauge("heliograph_memory_bytes", "Bytes of the memory account that are in use, by owner.");
  const auto used = memory.used_by_owner();
  for (std::size_t i = 0; i < kMemoryOwners; ++i) by_owner.add(double(used[i]), {{"owner", to_string(MemoryOwner(i))}});
  page.gauge("heliograph_memory_limit_bytes", "Bytes that the memory account may hold (max-memory).")
      .add(double(memory.limit()));
  page.gauge("heliograph_memory_peak_bytes", "The most bytes that the memory account ever held.")
      .add(double(memory.peak()));
  page.counter("heliograph_memory_refusals_total", "Requests for memory that the account refused.")
      .add(double(memory.refusals()));
}

void tell_calls(Exposition& page, const RpcCounts& calls) {
  auto ended = page.counter("heliograph_rpc_total", "Calls that have ended, by method and status code.");
  for (std::size_t method = 0; method < calls.methods(); ++method) {
    for (int code = 0; code < RpcCounts::kCodes; ++code) {
      if (const std::uint64_t count = calls.value(method, code); count > 0)
        ended.add(double(count), {{"method", calls.name(method)}, {"code", RpcCounts::code_name(code)}});
    }
  }
}

// By the names that Prometheus' own libraries use.
void tell_process(Exposition& page, double started_s) {
  const ProcessUse use = process_use();
  page.counter("process_cpu_seconds_total", "Processor time of the process, in seconds.").add(use.cpu_seconds);
  page.gauge("process_resident_memory_bytes", "Bytes of the process that are in memory.")
      .add(double(use.resident_bytes));
  page.gauge("process_virtual_memory_bytes", "Bytes of the process' address space.").add(double(use.virtual_bytes));
  page.gauge("process_open_fds", "File descriptors that are open.").add(double(use.open_files));
  page.gauge("process_max_fds", "The most file descriptors that may be open.").add(double(use.most_open_files));
  page.gauge("process_start_time_seconds", "Unix time at which the daemon began, in seconds.").add(started_s);
}

}  // namespace

MetricsPage::MetricsPage(CompareCore& compare, const DurableJobs* jobs, const RpcCounts& calls)
    : compare_(compare),
      jobs_(jobs),
      calls_(calls),
      started_s_(unix_time_s() - (now_s() - compare.core.started_s)) {}

std::string MetricsPage::text() const {
  const ServiceCore& core = compare_.core;
  Exposition page;
  page.gauge("heliograph_build_info", "1, with version, build and instruction sets of the daemon.")
      .add(1, {{"version", build_version()}, {"build", build_description()}, {"isa", rendering_isa()}});
  page.gauge("heliograph_draining", "1 while the daemon drains, else 0.").add(core.draining ? 1 : 0);
  tell_sessions_and_jobs(page, compare_, jobs_);
  tell_rendering(page, core);
  tell_streams(page, core.counters.streams);
  tell_checkpoints(page, core.counters.checkpoints);
  tell_memory(page, core.memory);
  tell_calls(page, calls_);
  tell_process(page, started_s_);
  return page.text();
}

}  // namespace helio
