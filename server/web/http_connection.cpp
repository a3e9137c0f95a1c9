#include "server/web/http_connection.h"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "server/web/web_socket.h"

namespace helio {
namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;

constexpr std::uint32_t kMaxHeader = 8 << 10;
constexpr std::string_view kSpeaksTls =
    "HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Type: text/plain\r\n\r\nthis port speaks https alone\n";
// The text format of Prometheus.
constexpr const char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";
constexpr const char kSecurityPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

bool is_head(const http::request<http::empty_body>& request) {
  return request.method() == http::verb::head;
}

// Whether a proxy says that the request comes from elsewhere.
bool passed_on(const http::request<http::empty_body>& request) {
  for (const char* name : {"Forwarded", "X-Forwarded-For", "X-Real-IP", "Via"}) {
    if (request.find(name) != request.end()) return true;
  }
  return false;
}

bool is_loopback(const boost::asio::ip::address& address) {
  if (!address.is_v6() || !address.to_v6().is_v4_mapped()) return address.is_loopback();
  return boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, address.to_v6()).is_loopback();
}

template <class Response>
void set_headers(Response& response) {
  response.set(http::field::server, "heliographd");
  response.set("Content-Security-Policy", kSecurityPolicy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set(http::field::cache_control, "no-cache");
}

}  // namespace

HttpConnection::HttpConnection(WebStream stream, const WebSite& site, std::shared_ptr<void> gone)
    : stream_(std::move(stream)), site_(site), gone_(std::move(gone)), incoming_(kMaxHeader) {}

void HttpConnection::begin() {
  WebStream::Tls* const tls = stream_.tls();
  if (!tls) return read();
  stream_.next_layer().expires_after(site_.patience);
  tls->async_handshake(boost::asio::ssl::stream_base::server, [self = shared_from_this()](beast::error_code error) {
    if (error) return self->refuse_handshake(error);
    self->read();
  });
}

// A browser that was sent to http:// in place of https:// is told.
void HttpConnection::refuse_handshake(beast::error_code error) {
  spdlog::debug("http: no handshake: {}", error.message());
  const bool plain = error.category() == boost::asio::error::get_ssl_category() &&
                     ERR_GET_REASON(static_cast<unsigned long>(error.value())) == SSL_R_HTTP_REQUEST;
  if (!plain) return;
  auto& socket = stream_.next_layer().socket();
  beast::error_code ignored;
  socket.non_blocking(true, ignored);
  socket.write_some(boost::asio::buffer(kSpeaksTls.data(), kSpeaksTls.size()), ignored);
  socket.shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
}

void HttpConnection::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHeader);
  parser_->body_limit(0);
  stream_.next_layer().expires_after(site_.patience);
  http::async_read(stream_, incoming_, *parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (!error) return self->answer(self->parser_->release());
    if (error == http::error::end_of_stream ||
        error.category() != make_error_code(http::error::end_of_stream).category()) {
      return self->finish();
    }
    Request request = self->parser_->release();
    request.keep_alive(false);
    const bool large = error == http::error::header_limit || error == http::error::buffer_overflow;
    self->send_text(
        request, large ? http::status::request_header_fields_too_large : http::status::bad_request,
        large
            ? fmt::format("a request above {} bytes; allowed: requests without a body, of at most so many", kMaxHeader)
            : "not a well-formed request without a body: " + error.message());
  });
}

void HttpConnection::answer(Request request) {
  const std::string_view target = view(request.target());
  const std::string_view path = target.substr(0, target.find('?'));
  if (request.method() != http::verb::get && !is_head(request)) {
    return send_text(request, http::status::method_not_allowed, "allowed: GET and HEAD");
  }
  // Probes call the daemon by whatever address they know; these two tell nothing else.
  if (path == "/healthz") return send_text(request, http::status::ok, "ok");
  if (path == "/readyz") {
    const std::string reason = site_.unready ? site_.unready() : std::string();
    return reason.empty() ? send_text(request, http::status::ok, "ok")
                          : send_text(request, http::status::service_unavailable, reason);
  }
  if (path == "/metrics") return send_metrics(request);
  if (!site_.access.allows_host(view(request[http::field::host]))) return refuse_host(request);
  if (path == "/ws") return upgrade(std::move(request));
  if (path.starts_with('/')) {
    if (const PageFile* file = site_.files.find(path.substr(1))) return send_file(request, *file);
  }
  send_text(request, http::status::not_found, "there is no such page; the viewer is at /");
}

void HttpConnection::send_metrics(const Request& request) {
  beast::error_code gone;
  const auto peer = stream_.next_layer().socket().remote_endpoint(gone);
  const WebAccess::Scraper scraper{!gone && is_loopback(peer.address()) && !passed_on(request),
                                   view(request[http::field::host]), view(request[http::field::authorization])};
  switch (site_.access.judge_scraper(scraper, *site_.tokens.tokens())) {
    case WebAccess::Verdict::allowed:
      break;
    case WebAccess::Verdict::unknown_token:
      return send_text(request, http::status::unauthorized,
                       "a token of the daemon's token file is required (Authorization: Bearer TOKEN)");
    case WebAccess::Verdict::unknown_host:
      return refuse_host(request);
    case WebAccess::Verdict::not_local:
      return send_text(request, http::status::forbidden,
                       "metrics are for programs on this machine; for others give the daemon tokens (--token-file)");
  }
  if (!site_.metrics) return send_text(request, http::status::not_found, "there are no metrics here");
  // Goes to the thread that makes the text, and back to this one, which the server waits for.
  struct Pending {
    Pending(std::shared_ptr<HttpConnection> asked, const Request& by, BridgedCalls& counted)
        : connection(std::move(asked)), request(by), calls(counted) {
      calls.begun();
    }
    Pending(const Pending&) = delete;
    ~Pending() { calls.over(); }
    std::shared_ptr<HttpConnection> connection;
    Request request;
    BridgedCalls& calls;
  };
  auto pending = std::make_shared<Pending>(shared_from_this(), request, site_.calls);
  const bool taken = site_.metrics([pending](std::string text) mutable {
    const auto executor = pending->connection->stream_.get_executor();
    boost::asio::post(executor, [pending = std::move(pending), text = std::move(text)]() mutable {
      HttpConnection& connection = *pending->connection;
      if (text.empty())
        return connection.send_text(pending->request, http::status::service_unavailable, "the daemon is starting");
      connection.send_text(pending->request, http::status::ok, std::move(text), kMetricsType);
    });
  });
  if (!taken) send_text(request, http::status::service_unavailable, "too many ask for the metrics at once");
}

void HttpConnection::refuse_host(const Request& request) {
  send_text(request, http::status::forbidden,
            fmt::format("Host '{}' is not a name of this daemon; allowed: localhost, 127.0.0.1, [::1], and "
                        "those given to heliographd by --http-host",
                        view(request[http::field::host]).substr(0, 256)));
}

void HttpConnection::send_file(const Request& request, const PageFile& file) {
  const bool known = view(request[http::field::if_none_match]) == file.tag;
  const bool packed =
      !file.gzip.empty() && view(request[http::field::accept_encoding]).find("gzip") != std::string_view::npos;
  const std::string_view bytes = packed ? std::string_view(file.gzip) : file.bytes;
  http::response<http::span_body<const char>> response(known ? http::status::not_modified : http::status::ok,
                                                       request.version());
  set_headers(response);
  response.set(http::field::content_type, beast::string_view(file.type.data(), file.type.size()));
  response.set(http::field::etag, file.tag);
  response.set(http::field::vary, "Accept-Encoding");
  if (packed) response.set(http::field::content_encoding, "gzip");
  if (!known && !is_head(request)) response.body() = beast::span<const char>(bytes.data(), bytes.size());
  if (!known) response.content_length(bytes.size());
  response.keep_alive(request.keep_alive());
  send(std::move(response));
}

void HttpConnection::send_text(const Request& request, http::status status, std::string text, const char* type) {
  http::response<http::string_body> response(status, request.version());
  set_headers(response);
  response.set(http::field::content_type, type);
  if (status == http::status::method_not_allowed) response.set(http::field::allow, "GET, HEAD");
  if (status == http::status::unauthorized) response.set(http::field::www_authenticate, "Bearer");
  if (!text.ends_with('\n')) text += '\n';
  response.content_length(text.size());
  if (!is_head(request)) response.body() = std::move(text);
  response.keep_alive(request.keep_alive());
  send(std::move(response));
}

template <class Body>
void HttpConnection::send(http::response<Body> response) {
  const auto held = std::make_shared<http::response<Body>>(std::move(response));
  stream_.next_layer().expires_after(site_.patience);
  http::async_write(stream_, *held, [self = shared_from_this(), held](beast::error_code error, std::size_t) {
    if (error || held->need_eof()) return self->finish();
    self->read();
  });
}

void HttpConnection::upgrade(Request request) {
  if (!beast::websocket::is_upgrade(request)) {
    request.keep_alive(false);
    return send_text(request, http::status::upgrade_required, "/ws speaks WebSocket alone");
  }
  if (!site_.calls.channel()) {
    return send_text(request, http::status::service_unavailable, "the daemon is starting");
  }
  if (site_.stopping) return send_text(request, http::status::service_unavailable, "the daemon has ended");
  const std::string_view host = view(request[http::field::host]), origin = view(request[http::field::origin]);
  if (!WebAccess::allows_origin(origin, host)) {
    return send_text(
        request, http::status::forbidden,
        fmt::format("Origin '{}' is not the page of this daemon at '{}'", origin.substr(0, 256), host.substr(0, 256)));
  }
  if (view(request[http::field::sec_websocket_protocol]) != kWebSubprotocol) {
    return send_text(request, http::status::bad_request,
                     fmt::format("Sec-WebSocket-Protocol '{}'; allowed: {}",
                                 view(request[http::field::sec_websocket_protocol]).substr(0, 256), kWebSubprotocol));
  }
  const auto socket = std::make_shared<WebSocket>(std::move(stream_), site_, std::move(gone_));
  site_.opened(socket);
  socket->accept(std::move(request));
}

void HttpConnection::finish() {
  if (WebStream::Tls* const tls = stream_.tls()) {
    stream_.next_layer().expires_after(site_.patience);
    return tls->async_shutdown([self = shared_from_this()](beast::error_code) {});
  }
  beast::error_code ignored;
  stream_.next_layer().socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
}

}  // namespace helio
