#include "server/web/web_socket.h"

#include <netinet/tcp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <limits>
#include <new>

#include "heliograph/v1/web.pb.h"
#include "server/base/guarded.h"

namespace helio {
namespace {

namespace pb = heliograph::v1;
namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

constexpr std::uint32_t kEnvelopeVersion = 1;
// What gRPC takes, and its envelope.
constexpr std::size_t kMaxMessage = (4 << 20) + 64;
// Requests that wait for the service: beyond this nothing more is read.
constexpr std::size_t kMaxUntaken = 8 << 20;
constexpr std::size_t kMaxCalls = 64;
// Answers that wait for a page that sends and does not read: beyond this nothing more is read.
constexpr std::size_t kMaxSmall = 256;
// Of a slow connection the kernel holds no more than this beside what is on its way, so that the newest tile does not
// wait behind older ones. Without effect on a fast one but for more and smaller writes, which cost a tenth of its
// pictures.
constexpr int kLittleUnsent = 64 << 10;
using UnsentLimit = boost::asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;

pb::WebRequest::RequestCase kind_of(const Envelope& envelope) {
  return static_cast<pb::WebRequest::RequestCase>(envelope.field);
}

// A close reason has at most 123 bytes (RFC 6455, sections 5.5 and 5.5.1).
websocket::close_reason make_reason(std::uint16_t code, std::string_view why) {
  constexpr std::size_t kMaxReason = 123;
  const std::string_view text = why.substr(0, kMaxReason);
  return {static_cast<websocket::close_code>(code), beast::string_view(text.data(), text.size())};
}

}  // namespace

WebSocket::WebSocket(WebStream stream, const WebSite& site, std::shared_ptr<void> gone)
    : socket_(std::move(stream)),
      site_(site),
      gone_(std::move(gone)),
      hello_due_(site.calls.thread()),
      incoming_(kMaxMessage) {}

void WebSocket::accept(Upgrade request) {
  upgrade_ = std::move(request);
  beast::get_lowest_layer(socket_).expires_never();  // its own timeouts take over
  websocket::stream_base::timeout timeouts{std::chrono::seconds(10), std::chrono::seconds(30), true};
  socket_.set_option(timeouts);
  socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(beast::http::field::server, "heliographd");
    response.set(beast::http::field::sec_websocket_protocol,
                 beast::string_view(kWebSubprotocol.data(), kWebSubprotocol.size()));
  }));
  hold_little(true);
  socket_.binary(true);
  socket_.auto_fragment(false);  // a tile is one frame and one write
  socket_.read_message_max(kMaxMessage);
  socket_.async_accept(upgrade_, [self = shared_from_this()](beast::error_code error) {
    if (error) return self->drop();
    self->hello_due_.expires_after(self->site_.patience);
    self->hello_due_.async_wait([weak = std::weak_ptr(self)](beast::error_code cancelled) {
      const auto socket = weak.lock();
      if (socket && !cancelled && !socket->greeted_) socket->close(4408, "no hello came in time");
    });
    self->read();
  });
}

void WebSocket::close(std::uint16_t code, std::string_view why) {
  if (closed_) return;
  spdlog::debug("page closed: {} code={}", why, code);
  auto left = leaving_ ? std::move(leaving_->left) : nullptr;
  drop();
  socket_.async_close(make_reason(code, why),
                      [self = shared_from_this(), left = std::move(left)](beast::error_code) {});
}

void WebSocket::leave(std::uint16_t code, std::string_view why, std::shared_ptr<void> left) {
  if (closed_) return;
  leaving_ = Leave{code, std::string(why), std::move(left)};
  leave_when_done();
}

void WebSocket::leave_when_done() {
  if (!leaving_ || closed_ || writing_ || !calls_.empty() || !small_.empty() || !ready_.empty()) return;
  close(leaving_->code, std::string(leaving_->why));
}

// Nothing more is read or answered.
void WebSocket::drop() {
  const auto until_dropped = std::move(not_reading_);
  closed_ = true;
  leaving_.reset();
  hello_due_.cancel();
  for (const auto& [id, call] : calls_) call->cancel();
  calls_.clear();
  for (const auto& call : ready_) call->next();  // a call is over when a read finds its end
  ready_.clear();
}

void WebSocket::read() {
  if (reading_ || closed_) return;
  if (untaken_bytes_ > kMaxUntaken || small_.size() > kMaxSmall) {
    not_reading_ = shared_from_this();
    return;
  }
  const auto until_read = std::move(not_reading_);
  reading_ = true;
  socket_.async_read(incoming_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    self->reading_ = false;
    if (error) {
      // The stream has sent the code of a broken rule already, without room for a sentence.
      if (error != websocket::error::closed) spdlog::debug("page's connection ended: {}", error.message());
      return self->drop();
    }
    const auto bytes = self->incoming_.data();
    const Status taken = guarded([&]() -> Status {
      if (self->closed_) return ok_status();
      if (!self->socket_.got_binary()) {
        self->close(1003, "text came; allowed: binary messages, each a heliograph.v1.WebRequest");
      } else {
        self->take({static_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
      }
      return ok_status();
    });
    if (!taken.ok()) self->close(1011, taken.error().message);
    self->incoming_.consume(self->incoming_.size());
    self->read();
  });
}

void WebSocket::take(std::span<const std::uint8_t> message) {
  const auto envelope = read_envelope(message);
  if (!envelope) return close(1007, envelope.error().to_string());
  if (!greeted_) return greet(*envelope);
  const auto found = calls_.find(envelope->id);
  switch (kind_of(*envelope)) {
    case pb::WebRequest::kHello:
      return close(1002, "hello came twice; allowed: once, as the first message");
    case pb::WebRequest::kEnd:
      if (found != calls_.end()) found->second->end();
      return;
    case pb::WebRequest::kCancel:
      if (found != calls_.end()) found->second->cancel();
      return;
    default:
      break;
  }
  if (found == calls_.end()) return begin_call(*envelope);
  if (found->second->kind().field != envelope->field)
    return close(1002, "a call changed its kind; allowed: one a call");
  if (!found->second->send(envelope->content)) {
    return close(1002, "a call of one request, or one that was ended, was sent another");
  }
  untaken_bytes_ += envelope->content.size();
}

void WebSocket::greet(const Envelope& envelope) {
  pb::WebRequest::Hello hello;
  if (kind_of(envelope) != pb::WebRequest::kHello ||
      !hello.ParseFromArray(envelope.content.data(), int(envelope.content.size()))) {
    return close(1002, "the first message is not a well-formed hello");
  }
  if (hello.envelope() != kEnvelopeVersion) {
    return close(4400, "the page speaks envelope " + std::to_string(hello.envelope()) + ", this daemon " +
                           std::to_string(kEnvelopeVersion) + "; load the page again");
  }
  if (!site_.tokens.find(hello.token())) return close(4401, "the token is not one of the daemon's");
  authorization_ = site_.tokens.empty() ? std::string() : to_authorization(hello.token());
  greeted_ = true;
  hello_due_.cancel();
  pb::WebResponse response;
  response.mutable_welcome()->set_envelope(kEnvelopeVersion);
  small_.push_back(response.SerializeAsString());
  write();
}

void WebSocket::begin_call(const Envelope& envelope) {
  const std::uint64_t id = envelope.id;
  if (id == 0) return close(1002, "a call without a number; allowed: id in [1, 2^53)");
  if (id <= last_id_) return;  // it is over, which the page may not know yet
  last_id_ = id;
  if (leaving_) return answer_status(id, {grpc::StatusCode::UNAVAILABLE, leaving_->why});
  const WebCall* kind = find_web_call(envelope.field);
  if (!kind) {
    return answer_status(id, {grpc::StatusCode::UNIMPLEMENTED, "field " + std::to_string(envelope.field) +
                                                                   " of WebRequest: this daemon knows no such call"});
  }
  if (calls_.size() >= kMaxCalls) {
    return answer_status(id, {grpc::StatusCode::RESOURCE_EXHAUSTED,
                              std::to_string(kMaxCalls) + " calls are under way on this connection already"});
  }
  const auto call = BridgedCall::start(site_.calls, weak_from_this(), id, *kind, authorization_);
  calls_[id] = call;
  call->send(envelope.content);
  untaken_bytes_ += envelope.content.size();
}

// A response that there is no memory for ends the page's connection: its call is not to wait for ever.
void WebSocket::response_ready(BridgedCall& call) {
  if (closed_) return call.next();
  try {
    ready_.push_back(call.shared_from_this());
  } catch (const std::bad_alloc&) {
    drop();
    return call.next();
  }
  write();
}

void WebSocket::request_taken(std::size_t bytes) {
  untaken_bytes_ -= std::min(untaken_bytes_, bytes);
  read();
}

void WebSocket::call_over(BridgedCall& call, const grpc::Status& status) {
  if (closed_) return;
  calls_.erase(call.id());
  answer_status(call.id(), status, call.ignored_fields());
}

void WebSocket::answer_status(std::uint64_t id, const grpc::Status& status, const std::string& ignored) {
  pb::WebResponse response;
  response.set_id(id);
  pb::WebResponse::Status& told = *response.mutable_status();
  told.set_code(status.error_code());
  told.set_message(status.error_message());
  if (!ignored.empty()) told.add_ignored_fields(ignored);
  small_.push_back(response.SerializeAsString());
  write();
}

void WebSocket::write() {
  if (writing_ || closed_ || (small_.empty() && ready_.empty())) return;
  try {
    write_next();
  } catch (const std::bad_alloc&) {
    writing_ = false;
    drop();
  }
}

void WebSocket::write_next() {
  std::vector<boost::asio::const_buffer> buffers;
  std::shared_ptr<BridgedCall> call;  // null: a small message
  if (!small_.empty()) {
    head_ = std::move(small_.front());
    small_.pop_front();
    buffers.emplace_back(head_.data(), head_.size());
  } else {
    call = ready_.front();
    head_ = envelope_head(call->id(), call->kind().field, call->response().Length());
    buffers.emplace_back(head_.data(), head_.size());
    slices_.clear();
    (void)call->response().Dump(&slices_);
    for (const grpc::Slice& slice : slices_) buffers.emplace_back(slice.begin(), slice.size());
  }
  writing_ = true;
  send_rate_.write_begun(std::chrono::steady_clock::now());
  socket_.async_write(
      buffers, [self = shared_from_this()](beast::error_code error, std::size_t bytes) { self->wrote(error, bytes); });
  if (!call) return;
  ready_.pop_front();
  call->next();  // the slices hold the bytes
}

void WebSocket::tell_link(double bytes_per_second) {
  try {
    pb::WebResponse response;
    response.mutable_link()->set_bytes_per_second(bytes_per_second);
    small_.push_back(response.SerializeAsString());
  } catch (const std::bad_alloc&) {  // it will be told again
  }
}

void WebSocket::hold_little(bool little) {
  if (little == holds_little_) return;
  holds_little_ = little;
  beast::error_code ignored;
  beast::get_lowest_layer(socket_).socket().set_option(
      UnsentLimit(little ? kLittleUnsent : std::numeric_limits<int>::max()), ignored);
}

void WebSocket::wrote(beast::error_code error, std::size_t bytes) {
  writing_ = false;
  slices_.clear();
  if (error) return drop();
  if (const auto rate = send_rate_.write_ended(bytes, std::chrono::steady_clock::now())) tell_link(*rate);
  hold_little(!send_rate_.fast());
  write();
  read();
  leave_when_done();
}

}  // namespace helio
