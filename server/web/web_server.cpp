#include "server/web/web_server.h"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <future>
#include <thread>

#include "server/base/listen_address.h"
#include "server/web/http_connection.h"
#include "server/web/web_socket.h"
#include "server/web/web_tls.h"

namespace helio {
namespace {

namespace asio = boost::asio;
using boost::asio::ip::tcp;

constexpr std::string_view kFull =
    "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Type: text/plain\r\nRetry-After: 5\r\n\r\n"
    "all connections of this daemon are in use (--max-http-connections)\n";
// When there are no file descriptors left, accepting fails at once, again and again.
constexpr auto kAcceptAgain = std::chrono::milliseconds(100);
// Time for pages to receive how their calls ended and to answer the closing handshake.
constexpr auto kLastMessages = std::chrono::milliseconds(300);
constexpr std::uint16_t kGoingAway = 1001;  // RFC 6455, section 7.4.1
constexpr std::string_view kEnded = "the daemon has ended";

std::vector<std::string> names(const WebServer::Options& options, const ListenAddress& listen) {
  std::vector<std::string> hosts = options.hosts;
  hosts.push_back(bracketed(listen.host));
  return hosts;
}

}  // namespace

class WebServer::Impl {
 public:
  Impl(const Options& options, const ListenAddress& listen)
      : max_connections_(options.max_connections),
        access_(names(options, listen)),
        tokens_(options.tokens ? *options.tokens : everyone_),
        tls_(options.certificates),
        calls_(io_),
        site_{files_,
              access_,
              tokens_,
              calls_,
              std::chrono::milliseconds(std::int64_t(options.patience_s * 1000)),
              {},
              {},
              stopping_,
              [this](const std::weak_ptr<WebSocket>& socket) { add(socket); }},
        acceptor_(io_),
        again_(io_) {}

  ~Impl() {
    if (!thread_.joinable()) return;
    const auto running = asio::make_work_guard(io_);  // though nothing listens any more
    std::promise<void> closed;
    const auto left = std::make_shared<std::promise<void>>();
    std::shared_ptr<void> leaving(nullptr, [left](void*) { left->set_value(); });  // when the last socket lets go of it
    asio::post(io_, [this, leaving = std::move(leaving)]() mutable {
      stopping_ = true;
      acceptor_.close();
      again_.cancel();
      for_sockets([&](WebSocket& socket) { socket.leave(kGoingAway, kEnded, leaving); });
      leaving.reset();
    });
    left->get_future().wait_for(kLastMessages);
    asio::post(io_, [this, &closed] {
      for_sockets([](WebSocket& socket) { socket.close(kGoingAway, kEnded); });
      closed.set_value();
    });
    closed.get_future().wait();  // from here on no call begins
    calls_.wait_until_empty();
    // Closing handshakes that are still under way are not waited for.
    asio::post(io_, [this] { io_.stop(); });
    thread_.join();
  }

  Status listen(const ListenAddress& listen) {
    boost::system::error_code error;
    tcp::resolver resolver(io_);
    const auto found = resolver.resolve(listen.host, std::to_string(listen.port),
                                        tcp::resolver::passive | tcp::resolver::numeric_service, error);
    if (!error && !found.empty()) {
      const tcp::endpoint endpoint = *found.begin();
      acceptor_.open(endpoint.protocol(), error);
      if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
      if (!error) acceptor_.bind(endpoint, error);
      if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    }
    if (error || found.empty()) {
      return Error{ErrorCode::unavailable,
                   fmt::format("cannot listen on {}:{}: {}", listen.host, listen.port, error.message()), "http"};
    }
    address_ = fmt::format("{}:{}", bracketed(listen.host), acceptor_.local_endpoint().port());
    return ok_status();
  }

  void serve(Sources sources) {
    site_.unready = std::move(sources.unready);
    site_.metrics = std::move(sources.metrics);
    accept();
    thread_ = std::thread([this] {
      pthread_setname_np(pthread_self(), "http");
      run();
    });
  }

  void open(std::shared_ptr<grpc::Channel> channel) {
    asio::post(io_, [this, channel = std::move(channel)] { calls_.set_channel(channel); });
  }

  const std::string& address() const { return address_; }

 private:
  // What a connection throws ends it (its handler is gone), not the daemon.
  void run() {
    for (;;) {
      try {
        io_.run();
        return;
      } catch (const std::exception& exception) {
        spdlog::error("http: {}", exception.what());
      }
    }
  }

  void accept() {
    acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
      if (!acceptor_.is_open()) return;
      if (error) {
        again_.expires_after(kAcceptAgain);
        again_.async_wait([this](boost::system::error_code cancelled) {
          if (!cancelled) accept();
        });
        return;
      }
      boost::system::error_code ignored;
      auto context = tls_.context();
      if (connections_.use_count() > max_connections_) {
        socket.non_blocking(true, ignored);
        if (!context) socket.write_some(asio::buffer(kFull.data(), kFull.size()), ignored);
      } else {
        socket.set_option(tcp::no_delay(true), ignored);
        WebStream stream(std::move(socket), std::move(context));
        std::make_shared<HttpConnection>(std::move(stream), site_, connections_)->begin();
      }
      accept();
    });
  }

  template <class Function>
  void for_sockets(const Function& function) {
    for (const auto& weak : sockets_) {
      if (const auto socket = weak.lock()) function(*socket);
    }
  }

  void add(const std::weak_ptr<WebSocket>& socket) {
    sockets_.erase(std::remove_if(sockets_.begin(), sockets_.end(), [](const auto& weak) { return weak.expired(); }),
                   sockets_.end());
    sockets_.push_back(socket);
  }

  // In this order: handlers that were never run are destroyed with io_, and use what comes before it.
  const int max_connections_;
  const PageFiles files_;
  const WebAccess access_;
  const AccessControl everyone_;
  const AccessControl& tokens_;
  WebTls tls_;
  const std::shared_ptr<void> connections_ = std::make_shared<int>(0);  // counts them
  bool stopping_ = false;                                               // of the thread
  asio::io_context io_{1};
  BridgedCalls calls_;
  WebSite site_;
  std::vector<std::weak_ptr<WebSocket>> sockets_;
  tcp::acceptor acceptor_;
  asio::steady_timer again_;
  std::string address_;
  std::thread thread_;
};

Result<std::unique_ptr<WebServer>> WebServer::listen(const Options& options) {
  const auto listen = parse_listen_address(options.listen);
  if (!listen) return Error{ErrorCode::invalid_argument, listen.error().message, "http"};
  const bool tokens = options.tokens && !options.tokens->empty();
  if (!listen->loopback && !tokens && !(options.certificates && options.certificates->asks_callers())) {
    return Error{ErrorCode::invalid_argument,
                 "'" + options.listen +
                     "' without --token-file and --tls-client-ca; allowed: an address of loopback, or any with one of "
                     "them",
                 "http"};
  }
  auto impl = std::make_unique<Impl>(options, *listen);
  if (const Status listening = impl->listen(*listen); !listening.ok()) return listening.error();
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

void WebServer::serve(Sources sources) {
  impl_->serve(std::move(sources));
}

void WebServer::open(std::shared_ptr<grpc::Channel> channel) {
  impl_->open(std::move(channel));
}

const std::string& WebServer::address() const {
  return impl_->address();
}

}  // namespace helio
