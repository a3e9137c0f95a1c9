// A page's WebSocket: hello first, then calls side by side, each with its number.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/web/bridged_call.h"
#include "server/web/send_rate.h"
#include "server/web/web_site.h"
#include "server/web/web_stream.h"

namespace helio {

inline constexpr std::string_view kWebSubprotocol = "heliograph.v1";

class WebSocket final : public BridgedCall::Owner, public std::enable_shared_from_this<WebSocket> {
 public:
  using Upgrade = boost::beast::http::request<boost::beast::http::empty_body>;

  // `gone` is kept until the socket is closed.
  WebSocket(WebStream stream, const WebSite& site, std::shared_ptr<void> gone);

  void accept(Upgrade request);  // which must outlive nothing: it is kept until the handshake is over
  // The page is told why; calls are cancelled.
  void close(std::uint16_t code, std::string_view why);
  // As close(), but calls in hand end first and what waits is sent; new ones are answered UNAVAILABLE. `left` is let go
  // when the page has answered the closing handshake, or its connection has ended.
  void leave(std::uint16_t code, std::string_view why, std::shared_ptr<void> left);

 private:
  struct Leave {
    std::uint16_t code;
    std::string why;
    std::shared_ptr<void> left;
  };

  void response_ready(BridgedCall& call) override;
  void request_taken(std::size_t bytes) override;
  void call_over(BridgedCall& call, const grpc::Status& status) override;

  void read();
  void take(std::span<const std::uint8_t> message);
  void greet(const Envelope& envelope);
  void begin_call(const Envelope& envelope);
  void answer_status(std::uint64_t id, const grpc::Status& status, const std::string& ignored = {});
  void write();
  void write_next();  // something waits, and nothing is under way
  void wrote(boost::beast::error_code error, std::size_t bytes);
  void tell_link(double bytes_per_second);
  void hold_little(bool little);
  void drop();
  void leave_when_done();

  boost::beast::websocket::stream<WebStream> socket_;
  const WebSite& site_;
  const std::shared_ptr<void> gone_;
  boost::asio::steady_timer hello_due_;
  Upgrade upgrade_;
  boost::beast::flat_buffer incoming_;
  std::shared_ptr<WebSocket> not_reading_;  // itself, while no read keeps it alive
  bool greeted_ = false, reading_ = false, writing_ = false, closed_ = false;
  std::optional<Leave> leaving_;
  std::string authorization_;
  std::uint64_t last_id_ = 0;
  std::map<std::uint64_t, std::shared_ptr<BridgedCall>> calls_;
  std::size_t untaken_bytes_ = 0;  // of requests that the service has not taken

  // Small messages go before responses; of a call, its status comes after its last response, which is sent by then.
  std::deque<std::string> small_;
  std::deque<std::shared_ptr<BridgedCall>> ready_;
  std::string head_;
  std::vector<grpc::Slice> slices_;  // of the response that is being written
  SendRate send_rate_;
  bool holds_little_ = false;
};

}  // namespace helio
