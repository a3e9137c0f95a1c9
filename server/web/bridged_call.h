// A call of the page on its way to RenderService: gRPC without a socket, so that limits, errors and pace are those of
// any other client. At most one response is held: the next is asked for when that one has been sent on.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/client_callback.h>

#include <boost/asio/io_context.hpp>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "server/web/envelope.h"

namespace helio {

// What all calls of a server share. Outlives them: wait_until_empty() before it goes.
class BridgedCalls {
 public:
  explicit BridgedCalls(boost::asio::io_context& thread) : thread_(thread) {}
  // Before any call, on the thread.
  void set_channel(std::shared_ptr<grpc::Channel> channel) { channel_ = std::move(channel); }
  boost::asio::io_context& thread() { return thread_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  void begun();  // also for other work of the daemon that hands its outcome to the thread
  void over();
  void wait_until_empty();

 private:
  boost::asio::io_context& thread_;
  std::shared_ptr<grpc::Channel> channel_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int calls_ = 0;
};

// All functions are called, and call their owner, on the thread of BridgedCalls.
class BridgedCall final : private grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                          public std::enable_shared_from_this<BridgedCall> {
 public:
  class Owner {
   public:
    virtual ~Owner() = default;
    virtual void response_ready(BridgedCall& call) = 0;  // response() is there until next()
    virtual void request_taken(std::size_t bytes) = 0;
    virtual void call_over(BridgedCall& call, const grpc::Status& status) = 0;  // the last
  };

  // `authorization`: of the page's token; empty: none.
  static std::shared_ptr<BridgedCall> start(BridgedCalls& calls, std::weak_ptr<Owner> owner, std::uint64_t id,
                                            const WebCall& kind, const std::string& authorization);

  std::uint64_t id() const { return id_; }
  const WebCall& kind() const { return kind_; }
  const grpc::ByteBuffer& response() const { return response_; }
  void next();
  // False: nothing more may follow (end() was called, or the one request has been).
  bool send(std::span<const std::uint8_t> request);
  void end();
  void cancel() { context_.TryCancel(); }
  // That the service did not know; once the call is over.
  std::string ignored_fields() const;

 private:
  BridgedCall(BridgedCalls& calls, std::weak_ptr<Owner> owner, std::uint64_t id, const WebCall& kind)
      : calls_(calls), owner_(std::move(owner)), id_(id), kind_(kind) {}
  ~BridgedCall() override = default;

  // Room for one function on its way to the owner's thread. gRPC's threads must not run out of memory over it.
  struct Room {
    static constexpr std::size_t kBytes = 256;
    alignas(std::max_align_t) std::byte bytes[kBytes];
  };
  template <class T>
  class RoomAllocator;
  template <class Function>
  class Posted;
  // At most one in each room at a time.
  template <class Function>
  void post(Room& room, Function function);

  // gRPC's threads.
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  void write_more();
  void read_failed();

  BridgedCalls& calls_;
  const std::weak_ptr<Owner> owner_;
  const std::uint64_t id_;
  const WebCall& kind_;
  grpc::ClientContext context_;
  grpc::ByteBuffer response_;
  grpc::Status status_;                    // of the call, once it is over
  std::deque<grpc::ByteBuffer> requests_;  // the first is being written
  Room read_room_, write_room_, done_room_;
  bool writing_ = false, ended_ = false, writes_done_ = false, closed_ = false;
  std::shared_ptr<BridgedCall> self_;  // until the call is over
};

}  // namespace helio
