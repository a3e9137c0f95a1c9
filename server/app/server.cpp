#include "server/app/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "renderer/base/clock.h"
#include "renderer/trace/accel/traversal_isa.h"
#include "server/base/listen_address.h"
#include "server/jobs/durable_jobs.h"
#include "server/rpc/render_service.h"
#include "server/web/web_server.h"

namespace helio {
namespace {

constexpr int kMaxReceivedMessage = 4 << 20;
// For calls that nobody ends, such as a health watch, once all work is done.
constexpr double kLastCallsSeconds = 0.3;
// How long a drain may last beyond its grace. A connection whose peer takes no bytes closes only when the keepalive
// timeout is over.
constexpr double kOvertimeSeconds = 0.5;
// Jobs get the grace less this, in which their results are sent.
constexpr double kResultSeconds = 0.5;

}  // namespace

struct Server::Impl {
  Impl(const ServerConfig& config, SceneRoots roots, std::shared_ptr<const OidnLibrary> oidn, AccessTokens tokens)
      : core(config, std::move(roots), std::move(oidn), std::move(tokens)), compare(core) {}

  ServiceCore core;
  CompareCore compare;
  std::unique_ptr<DurableJobs> jobs;  // null: none are kept
  std::optional<RenderService> service;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<WebServer> web;  // null: none
  std::string address;
  std::mutex draining;
  bool drained = false;
  bool jobs_over = true;  // none of those that are kept runs
  std::thread stopper;  // shuts the gRPC server down
  std::promise<void> stop_promise;
  std::future<void> stopped = stop_promise.get_future();

  // Takes the state folder; why no jobs are kept, empty: they are. A folder that the person did not name may be in use.
  Result<std::string> open_jobs() {
    const ServerConfig& config = core.config;
    if (config.state.empty()) return std::string("it was started without a state folder (--state)");
    const bool own = config.state == kOwnState;
    auto folder = own ? default_state_folder() : Result<std::string>(config.state);
    std::vector<std::string> notices;
    const auto open = [&]() -> Result<std::unique_ptr<DurableJobs>> {
      if (!folder) return folder.error();
      return DurableJobs::open(core, *folder, notices);
    };
    auto opened = open();
    for (const std::string& notice : notices) spdlog::warn("{}", notice);
    if (!opened && (!own || opened.error().where == "output-root")) return opened.error();
    if (!opened) {
      spdlog::warn("no jobs are kept: {}", opened.error().to_string());
      return opened.error().to_string();
    }
    jobs = std::move(*opened);
    core.keep_upload = [this](const SceneBundle& bundle) { return jobs->keep_upload(bundle); };
    spdlog::info("jobs are kept in {}", *folder);
    return std::string();
  }
};

// Mesa's software device takes as many threads as it is told, else one for each core. Its variable is read when a device
// is opened; this is before the threads that do.
static void limit_software_devices(const ServerConfig& config) {
  if (!config.vulkan_devices) return;
  setenv("LP_NUM_THREADS", std::to_string(config.render_threads).c_str(), 0);
}

Result<std::unique_ptr<Server>> Server::start(const ServerConfig& config) {
  limit_software_devices(complete(config));
  auto roots = SceneRoots::open(config.scene_roots);
  if (!roots) return roots.error();
  if (const Status chosen = choose_traversal_isa(config.isa); !chosen) return chosen.error();
  auto oidn = ServiceCore::load_oidn(config);
  if (!oidn) return oidn.error();
  if (*oidn) spdlog::info("Open Image Denoise {} of {}", (*oidn)->version(), config.oidn_library);
  auto tokens = ServiceCore::read_tokens(config);
  if (!tokens) return tokens.error();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  auto impl = std::make_unique<Impl>(complete(config), std::move(*roots), std::move(*oidn), std::move(*tokens));
  auto no_jobs_reason = impl->open_jobs();
  if (!no_jobs_reason) return no_jobs_reason.error();
  impl->service.emplace(impl->compare, impl->jobs.get(), std::move(*no_jobs_reason));
  if (!config.http.empty()) {
    auto web = WebServer::listen({config.http, config.http_hosts, config.max_http_connections, impl->core.tokens});
    if (!web) return web.error();
    impl->web = std::move(*web);
    impl->core.http_address = impl->web->address();
  }
  grpc::ServerBuilder builder;
  builder.RegisterService(&*impl->service);
  builder.SetMaxReceiveMessageSize(kMaxReceivedMessage);
  grpc::ResourceQuota quota("heliographd");
  builder.SetResourceQuota(quota.Resize(std::size_t(config.max_rpc_memory)));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, config.max_streams);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);        // a second daemon on the same port is an error
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20000);  // finds clients that vanished without a word
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5000);
  int port = 0;
  ListenAddress listen;
  if (!config.listen.empty()) {
    auto parsed = parse_listen_address(config.listen);
    if (!parsed) return parsed.error();
    listen = *parsed;
    builder.AddListeningPort(config.listen, grpc::InsecureServerCredentials(), &port);
  }
  impl->server = builder.BuildAndStart();
  if (!impl->server || (!config.listen.empty() && port == 0)) {
    return Error{ErrorCode::unavailable, "cannot listen on " + config.listen + "; is the address in use?", "listen"};
  }
  if (impl->jobs) impl->jobs->begin();
  impl->server->GetHealthCheckService()->SetServingStatus(heliograph::v1::RenderService::service_full_name(), true);
  if (!config.listen.empty()) {
    impl->address = bracketed(listen.host) + ":" + std::to_string(port);
    if (!listen.loopback) {
      spdlog::warn(
          "listening on {}: there is no TLS yet, everyone who can reach this address can read and render; "
          "prefer the loopback address and ssh -L",
          impl->address);
    }
  }
  if (impl->web) {
    impl->web->serve(impl->server->InProcessChannel(grpc::ChannelArguments()),
                     [&core = impl->core] { return !core.draining; });
  }
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() {
  drain(0);
  impl_->stopper.join();
  if (!impl_->jobs) return;
  // Loads and calls in hand use what goes before their threads do.
  impl_->core.loader.stop();
  impl_->core.placer.stop();
  impl_->jobs->calls().stop();
  while (impl_->core.loader.busy() || impl_->core.placer.busy() || impl_->jobs->calls().busy())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

const std::string& Server::http_address() const {
  return impl_->core.http_address;
}

const std::string& Server::address() const {
  return impl_->address;
}

std::shared_ptr<grpc::Channel> Server::in_process_channel() {
  grpc::ChannelArguments arguments;
  // The table of a comparison of many views may be larger than gRPC's 4 MiB, and both ends are this process.
  arguments.SetMaxReceiveMessageSize(-1);
  return impl_->server->InProcessChannel(arguments);
}

bool Server::drain(double grace_s) {
  const std::lock_guard lock(impl_->draining);
  ServiceCore& core = impl_->core;
  const auto idle = [&](double seconds) {
    const auto wait = std::chrono::duration<double>(std::max(0.0, seconds));
    return impl_->stopped.wait_for(wait) == std::future_status::ready && !core.busy() &&
           !impl_->compare.queue.busy() && impl_->jobs_over;
  };
  if (impl_->drained) return idle(0);
  impl_->drained = true;
  const double deadline = now_s() + grace_s;
  core.draining = true;
  impl_->server->GetHealthCheckService()->SetServingStatus(false);
  const grpc::Status status(grpc::StatusCode::UNAVAILABLE, "the daemon is draining");
  if (impl_->jobs && grace_s > 0) {
    impl_->jobs->sessions().keep_all(deadline - std::min(kResultSeconds, grace_s / 2));
  } else {
    for (const auto& session : core.sessions.list()) session->drain(status);
  }
  // Comparisons have told all that a later call needs to go on.
  impl_->compare.queue.cancel_all();
  const double result_seconds = std::min(kResultSeconds, grace_s / 2);
  impl_->jobs_over = !impl_->jobs || impl_->jobs->drain(deadline - result_seconds);
  if (!impl_->jobs_over)
    spdlog::warn("jobs still run; they go on from their newest checkpoints when a daemon takes up the state folder");
  if (!core.jobs.wait_until_empty(deadline - result_seconds)) {
    core.jobs.cancel_all();
    core.jobs.wait_until_empty(deadline);
  }
  impl_->compare.queue.wait_until_empty(deadline);
  if (impl_->jobs) {
    if (!impl_->jobs->sessions().wait_until_kept(deadline))
      spdlog::warn("not all sessions are kept for the next daemon");
    impl_->jobs->close();
  }
  const auto last_calls = deadline_in(std::min(kLastCallsSeconds, deadline - now_s()));
  impl_->stopper = std::thread([this, last_calls] {
    impl_->server->Shutdown(last_calls);
    impl_->web.reset();
    impl_->stop_promise.set_value();
  });
  return idle(deadline - now_s() + kOvertimeSeconds);
}

}  // namespace helio
