// Everything that the service's methods act on.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "renderer/base/cancel.h"
#include "renderer/base/clock.h"
#include "renderer/film/display/oidn_library.h"
#include "renderer/frame/render_loop.h"
#include "server/base/access_control.h"
#include "server/base/memory_account.h"
#include "server/base/open_calls.h"
#include "server/base/reaper.h"
#include "server/base/retry.h"
#include "server/base/server_config.h"
#include "server/base/task_thread.h"
#include "server/base/timer_queue.h"
#include "server/metrics/daemon_counters.h"
#include "server/scenes/scene_registry.h"
#include "server/sessions/device_rendering.h"
#include "server/sessions/idle_room.h"
#include "server/sessions/job_quota.h"
#include "server/sessions/job_store.h"
#include "server/sessions/owner_accounts.h"
#include "server/sessions/session_registry.h"

namespace helio {

struct ServiceCore {
  ServiceCore(const ServerConfig& complete_config, SceneRoots roots,
              std::shared_ptr<const OidnLibrary> denoiser = nullptr, AccessTokens access_tokens = {})
      : config(complete_config),
        oidn(std::move(denoiser)),
        access(std::move(access_tokens), config.token.empty() ? config.token_file : std::string()),
        memory(config.max_memory, &room),
        engine(config.render_threads),
        devices(config.vulkan_devices ? machine_devices() : nullptr, memory),
        scenes(
            std::move(roots),
            {config.max_scene_bytes, config.max_scene_memory, config.max_scenes, config.render_threads, config.strict},
            memory),
        sessions(config.max_sessions, timers),
        jobs(config.max_jobs),
        loader(std::size_t(config.max_queued_loads)),
        editor(std::size_t(config.max_queued_loads)),
        replayer(std::size_t(config.max_queued_loads)),
        lister(kMaxWaitingLists),
        films(kMaxWaitingFilms, kFilmThreads),
        placer(kMaxWaitingFilms, kPlaceThreads) {}
  // Timers first: a function in hand may use anything below.
  ~ServiceCore() { timers.stop(); }

  // The library that config.oidn_library names; null: it names none. invalid_argument: it cannot be used.
  static Result<std::shared_ptr<const OidnLibrary>> load_oidn(const ServerConfig& config) {
    if (config.oidn_library.empty()) return std::shared_ptr<const OidnLibrary>();
    auto library = OidnLibrary::load(config.oidn_library, config.render_threads);
    if (!library) return Error{ErrorCode::invalid_argument, library.error().message, "oidn-library"};
    return library;
  }

  // Of config.token_file and config.token; none: everyone may call. invalid_argument names the file and its line.
  static Result<AccessTokens> read_tokens(const ServerConfig& config) {
    if (!config.token.empty()) return AccessTokens::of(config.token);
    if (config.token_file.empty()) return AccessTokens();
    return AccessTokens::read(config.token_file);
  }

  RenderLimits render_limits() const { return {config.max_film_side, config.max_film_pixels}; }
  RenderContext::Resources resources() { return resources_of(memory, {}); }
  // Of whoever calls, or of whoever has a token of this name: memory that counts on his account, and his share of the
  // machine.
  RenderContext::Resources resources(const Caller& caller) { return resources_of(memory_of(caller), caller.name); }
  RenderContext::Resources resources(const std::string& owner) { return resources_of(memory_of(owner), owner); }
  MemoryAccount& memory_of(const Caller& caller) { return accounts.of(caller.name, caller.quotas); }
  // Of whoever has a token of this name, who need not be calling now.
  MemoryAccount& memory_of(const std::string& owner) { return accounts.of(owner, access.quotas_of(owner)); }
  // For requests with this RenderSettings.device.
  TaskThread& thread_for(const std::string& device) { return device.empty() || device == "cpu" ? films : placer; }
  // For requests that switch the session's scene and leave its settings: the scene is placed on the session's device.
  // Null: the session renders on the CPU, where a switch takes no time worth a thread.
  TaskThread* thread_for_scene(const Session& session) {
    return session.settings().device.kind == RenderDevice::Kind::cpu ? nullptr : &placer;
  }
  bool busy() const {
    return loader.busy() || editor.busy() || replayer.busy() || lister.busy() || films.busy() ||
           placer.busy();
  }
  // After films.submit() or placer.submit() gave false.
  Error too_many_waiting() const { return queue_full(kMaxWaitingFilms, "requests wait for their films"); }
  // After lister.submit() did.
  Error too_many_lists() const { return queue_full(kMaxWaitingLists, "folders wait to be listed"); }
  // unavailable while the daemon drains. Who asks again finds the next one there, or the same one still draining.
  Status check_accepting() const {
    if (!draining) return ok_status();
    return Error{ErrorCode::unavailable, "the daemon is draining", {}, kRetrySeconds};
  }

  // For requests that may allocate a film: a few that take seconds do not hold up small ones.
  static constexpr std::size_t kMaxWaitingFilms = 4096;
  static constexpr int kFilmThreads = 4;
  static constexpr int kPlaceThreads = 16;  // most of the time they wait for a driver, or for one another
  static constexpr std::size_t kMaxWaitingLists = 64;

  const ServerConfig config;
  const std::shared_ptr<const OidnLibrary> oidn;  // null: there is none
  AccessControl access;
  std::string http_address;  // of the page, set before anything is served; empty: there is none
  // An upload that has come, before it is loaded: for jobs that are kept. What it answers goes into the log. Set before
  // anything is served; empty: none are.
  std::function<std::string(const SceneBundle&)> keep_upload;
  const double started_s = now_s();
  std::atomic<bool> draining{false};
  OpenCalls open_calls;  // whoever adds to it may be told at once that the daemon drains
  DaemonCounters counters;

  // In this order: what is named later uses what is named earlier, and is destroyed first.
  IdleRoom room{memory, reaper, scenes, sessions};
  MemoryAccount memory;
  OwnerAccounts accounts{memory, reaper, sessions};
  RenderEngine engine;
  RenderDevices devices;
  SceneRegistry scenes;
  Reaper reaper;  // frees what renders
  TimerQueue timers;
  SessionRegistry sessions;
  JobStore jobs;
  JobQuota job_quota{jobs};
  // A thread each, so that an edit or a replay, which someone waits for at the screen, never waits for a load.
  TaskThread loader, editor, replayer;
  TaskThread lister;  // of folders, on disks that may be slow
  TaskThread films;
  TaskThread placer;  // of requests that put a scene on a device, which may compile shaders for minutes

 private:
  RenderContext::Resources resources_of(MemoryAccount& account, const std::string& owner) {
    return {engine, account, timers, reaper, oidn, &devices, &counters.streams, owner};
  }
  Error queue_full(std::size_t count, const char* what) const {
    if (draining) return check_accepting().error();
    return {ErrorCode::resource_exhausted,
            "the daemon: " + std::to_string(count) + " " + what + " already",
            {},
            kRetrySeconds};
  }
};

}  // namespace helio
