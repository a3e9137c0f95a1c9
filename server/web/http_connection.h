// A connection of a browser: files of the page, health, and the upgrade to a WebSocket.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/string_body.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/web/web_site.h"
#include "server/web/web_stream.h"

namespace helio {

class HttpConnection final : public std::enable_shared_from_this<HttpConnection> {
 public:
  // `gone` is kept until the connection, or the WebSocket that it becomes, is closed.
  HttpConnection(WebStream stream, const WebSite& site, std::shared_ptr<void> gone);
  // Reads its requests, after the handshake of TLS.
  void begin();

 private:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;

  void read();
  void answer(Request request);
  void send_file(const Request& request, const PageFile& file);
  void send_metrics(const Request& request);
  void refuse_host(const Request& request);
  void send_text(const Request& request, boost::beast::http::status status, std::string text,
                 const char* type = "text/plain; charset=utf-8");
  template <class Body>
  void send(boost::beast::http::response<Body> response);
  void upgrade(Request request);
  void refuse_handshake(boost::beast::error_code error);
  void finish();

  WebStream stream_;
  const WebSite& site_;
  std::shared_ptr<void> gone_;
  boost::beast::flat_buffer incoming_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
};

}  // namespace helio
