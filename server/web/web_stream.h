// A browser's connection, by TLS or without: what Boost.Beast reads and writes.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <memory>
#include <utility>
#include <variant>

namespace helio {

// Of Beast's concept AsyncStream. HTTP and WebSocket are compiled once for both kinds.
class WebStream {
 public:
  using Plain = boost::beast::tcp_stream;
  using Tls = boost::beast::ssl_stream<Plain>;
  using next_layer_type = Plain;
  using executor_type = Plain::executor_type;

  // context: null, without TLS.
  WebStream(boost::asio::ip::tcp::socket socket, std::shared_ptr<boost::asio::ssl::context> context)
      : context_(std::move(context)), stream_(std::in_place_type<Plain>, std::move(socket)) {
    if (context_) {
      Plain plain = std::move(std::get<Plain>(stream_));
      stream_.emplace<Tls>(std::move(plain), *context_);
    }
  }

  Tls* tls() { return std::get_if<Tls>(&stream_); }  // null: without
  // The connection below, whose timeouts hold for both kinds.
  Plain& next_layer() noexcept {
    Tls* const over = tls();
    return over ? over->next_layer() : *std::get_if<Plain>(&stream_);
  }
  executor_type get_executor() noexcept { return next_layer().get_executor(); }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (Tls* const over = tls()) {
      over->async_read_some(buffers, std::forward<Handler>(handler));
    } else {
      next_layer().async_read_some(buffers, std::forward<Handler>(handler));
    }
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (Tls* const over = tls()) {
      over->async_write_some(buffers, std::forward<Handler>(handler));
    } else {
      next_layer().async_write_some(buffers, std::forward<Handler>(handler));
    }
  }

 private:
  std::shared_ptr<boost::asio::ssl::context> context_;  // outlives the stream
  std::variant<Plain, Tls> stream_;
};

// How Beast ends a WebSocket's connection. Its closing handshake is over by then, so TLS has nothing to add.
inline void teardown(boost::beast::role_type role, WebStream& stream, boost::beast::error_code& error) {
  using boost::beast::websocket::teardown;
  teardown(role, stream.next_layer(), error);
}
template <class Handler>
void async_teardown(boost::beast::role_type role, WebStream& stream, Handler&& handler) {
  using boost::beast::websocket::async_teardown;
  async_teardown(role, stream.next_layer(), std::forward<Handler>(handler));
}

}  // namespace helio
