#include "server/app/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/trace/accel/traversal_isa.h"
#include "server/app/call_counter.h"
#include "server/app/metrics_page.h"
#include "server/app/tls_credentials.h"
#include "server/base/grpc_status.h"
#include "server/base/listen_address.h"
#include "server/base/log_format.h"
#include "server/web/tls_certificates.h"
#include "server/jobs/durable_jobs.h"
#include "server/rpc/render_service.h"
#include "server/web/web_server.h"

namespace helio {
namespace {

constexpr int kMaxReceivedMessage = 4 << 20;
// Once all work is done, for clients that take their last messages slowly, and for calls that nobody ends, such as a
// health watch.
constexpr double kLastCallsSeconds = 2;
// How long a drain may last beyond its grace. A connection whose peer takes no bytes closes only when the keepalive
// timeout is over.
constexpr double kOvertimeSeconds = 0.5;
// Jobs get the grace less this, in which their results are sent.
constexpr double kResultSeconds = 0.5;
// The service by which grpc.health.v1.Health tells whether jobs are kept.
constexpr char kJobsHealth[] = "heliograph.v1.jobs";
constexpr std::size_t kMaxWaitingScrapes = 8;

}  // namespace

struct Server::Impl {
  Impl(const ServerConfig& config, SceneRoots roots, std::shared_ptr<const OidnLibrary> oidn, AccessTokens tokens)
      : core(config, std::move(roots), std::move(oidn), std::move(tokens)), compare(core) {}

  RpcCounts calls = counts_of_service();
  ServiceCore core;
  CompareCore compare;
  std::unique_ptr<DurableJobs> jobs;  // null: none are kept
  std::optional<RenderService> service;
  std::shared_ptr<TlsCertificates> certificates;         // null: no TLS
  std::shared_ptr<grpc::ServerCredentials> credentials;  // outlives the server, which asks it for certificates
  std::optional<MetricsPage> metrics;
  std::atomic<bool> open = false;  // all of the above is there
  std::unique_ptr<grpc::Server> server;
  TaskThread scraper{kMaxWaitingScrapes};  // makes the text of /metrics, which may wait for the disk
  std::unique_ptr<WebServer> web;          // null: none
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
      spdlog::warn("no jobs are kept reason={}", logged(opened.error().to_string()));
      return opened.error().to_string();
    }
    jobs = std::move(*opened);
    core.job_quota.count_kept_by([this](const std::string& owner) { return jobs->table().unfinished_of(owner); });
    core.keep_upload = [this](const SceneBundle& bundle) { return jobs->keep_upload(bundle); };
    spdlog::info("jobs are kept folder={}", logged(*folder));
    return std::string();
  }

  // Why no new work is taken, for probes; empty: it is.
  std::string unready() const {
    if (!open) return "the daemon is starting: the state of its jobs is not open yet";
    return core.draining ? "the daemon is draining" : "";
  }

  bool scrape(std::function<void(std::string)> told) {
    return scraper.submit([this, told = std::move(told)] { told(open ? metrics->text() : std::string()); });
  }

  WebServer::Sources web_sources() {
    return {[this] { return unready(); }, [this](auto told) { return scrape(std::move(told)); }};
  }
};

// Mesa's software device takes as many threads as it is told, else one for each core. Its variable is read when a device
// is opened; this is before the threads that do.
static void limit_software_devices(const ServerConfig& config) {
  if (!config.vulkan_devices) return;
  setenv("LP_NUM_THREADS", std::to_string(config.render_threads).c_str(), 0);
}

// The certificates of the configuration; null: it names none. invalid_argument: as of read_tls_files().
static Result<std::shared_ptr<TlsCertificates>> open_certificates(const ServerConfig& config) {
  if (config.tls_certificate.empty() && config.tls_key.empty() && config.tls_client_ca.empty())
    return std::shared_ptr<TlsCertificates>();
  return TlsCertificates::open({config.tls_certificate, config.tls_key, config.tls_client_ca});
}

// invalid_argument: other machines reach an address, and what travels there could be read.
static Status check_addresses(const ServerConfig& config, bool tls) {
  if (tls || config.insecure) return ok_status();
  Problems problems;
  const auto check = [&](const char* option, const std::string& text) {
    const auto address = parse_listen_address(text);
    if (text.empty() || !address || address->loopback) return;  // one that cannot be read is told by whoever listens
    problems.add(option, "'" + text +
                             "' is reached by other machines, and without TLS all that travels can be read; allowed: "
                             "--tls-certificate and --tls-key, an address of loopback (elsewhere: ssh -L), --insecure");
  };
  check("listen", config.listen);
  check("http", config.http);
  if (!problems.empty()) return problems.to_error();
  return ok_status();
}

Result<std::unique_ptr<Server>> Server::start(const ServerConfig& config) {
  limit_software_devices(complete(config));
  auto certificates = open_certificates(config);
  if (!certificates) return certificates.error();
  const bool tls = *certificates != nullptr;
  if (const Status safe = check_addresses(config, tls); !safe.ok()) return safe.error();
  auto roots = SceneRoots::open(config.scene_roots);
  if (!roots) return roots.error();
  if (const Status chosen = choose_traversal_isa(config.isa); !chosen) return chosen.error();
  auto oidn = ServiceCore::load_oidn(config);
  if (!oidn) return oidn.error();
  if (*oidn) {
    spdlog::info("Open Image Denoise version={} library={}", logged((*oidn)->version()), logged(config.oidn_library));
  }
  auto tokens = ServiceCore::read_tokens(config);
  if (!tokens) return tokens.error();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  auto impl = std::make_unique<Impl>(complete(config), std::move(*roots), std::move(*oidn), std::move(*tokens));
  impl->certificates = std::move(*certificates);
  if (!config.http.empty()) {
    auto web = WebServer::listen(
        {config.http, config.http_hosts, config.max_http_connections, &impl->core.access, impl->certificates});
    if (!web) return web.error();
    impl->web = std::move(*web);
    impl->core.http_address = impl->web->address();
    impl->web->serve(impl->web_sources());  // probes are answered while the state folder is opened
  }
  auto no_jobs_reason = impl->open_jobs();
  if (!no_jobs_reason) return no_jobs_reason.error();
  impl->service.emplace(impl->compare, impl->jobs.get(), std::move(*no_jobs_reason));
  impl->metrics.emplace(impl->compare, impl->jobs.get(), impl->calls);
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
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CallCounter>(impl->calls));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  int port = 0;
  ListenAddress listen;
  if (!config.listen.empty()) {
    auto parsed = parse_listen_address(config.listen);
    if (!parsed) return parsed.error();
    listen = *parsed;
    impl->credentials = tls ? make_tls_credentials(impl->certificates) : grpc::InsecureServerCredentials();
    builder.AddListeningPort(config.listen, impl->credentials, &port);
  }
  impl->server = builder.BuildAndStart();
  if (!impl->server || (!config.listen.empty() && port == 0)) {
    return Error{ErrorCode::unavailable, "cannot listen on " + config.listen + "; is the address in use?", "listen"};
  }
  grpc::HealthCheckServiceInterface& health = *impl->server->GetHealthCheckService();
  health.SetServingStatus(heliograph::v1::RenderService::service_full_name(), true);
  health.SetServingStatus(kJobsHealth, impl->jobs != nullptr);
  if (impl->jobs) {
    impl->jobs->on_state([&health](const Status& state) { health.SetServingStatus(kJobsHealth, state.ok()); });
    impl->jobs->begin();
  }
  if (!config.listen.empty()) {
    impl->address = bracketed(listen.host) + ":" + std::to_string(port);
    if (!listen.loopback && !tls)
      spdlog::warn("listening on {} without TLS (--insecure): all that travels there can be read", impl->address);
    if (!listen.loopback && impl->core.access.empty() && config.tls_client_ca.empty()) {
      spdlog::warn("listening on {} without --token-file and --tls-client-ca: everyone who can reach it can render",
                   impl->address);
    }
  }
  impl->open = true;
  if (impl->web) impl->web->open(impl->server->InProcessChannel(grpc::ChannelArguments()));
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

void Server::reload() {
  if (impl_->certificates) impl_->certificates->reload();
  AccessControl& access = impl_->core.access;
  if (access.empty()) {
    if (!impl_->certificates) spdlog::info("there are no files of tokens or TLS to read again");
    return;
  }
  if (const Status read = access.reload(); !read.ok())
    return spdlog::error("the tokens are left as they were: {}", read.error().to_string());
  spdlog::info("the token file was read again: {} tokens", access.tokens()->callers().size());
}

bool Server::tls() const {
  return impl_->certificates != nullptr;
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

std::uint64_t Server::memory_used() const {
  return impl_->core.memory.used();
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
  if (impl_->jobs) impl_->jobs->on_state({});
  impl_->server->GetHealthCheckService()->SetServingStatus(false);
  core.open_calls.end_all();
  if (impl_->jobs && grace_s > 0) {
    impl_->jobs->sessions().keep_all(deadline - std::min(kResultSeconds, grace_s / 2));
  } else {
    // Without a time to try again: nothing of a session is left then.
    const grpc::Status status(grpc::StatusCode::UNAVAILABLE, "the daemon is draining");
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
