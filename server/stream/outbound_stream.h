// The sending half of a stream: one write in flight, one bounded queue, one place that finishes the call.
//
// It outlives the gRPC call, so that render workers may push at any time; what comes after the call has finished is
// dropped.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "server/base/timer_queue.h"
#include "server/stream/outbound_queue.h"

namespace helio {

class OutboundStream : public std::enable_shared_from_this<OutboundStream> {
 public:
  // The gRPC call: it stays valid until finish() was called on it. Neither function calls back from within.
  class Call {
   public:
    virtual void start_write(const grpc::ByteBuffer* message) = 0;
    virtual void finish(const grpc::Status& status) = 0;

   protected:
    ~Call() = default;
  };
  // An empty (invalid) buffer: this message is not sent.
  using Encoder = std::function<grpc::ByteBuffer(Outbound)>;

  // counters: null: nothing is counted. They outlive it.
  OutboundStream(Call& call, Encoder encoder, TimerQueue& timers, StreamCounters* counters = nullptr)
      : call_(&call), encoder_(std::move(encoder)), timers_(timers), counters_(counters), queue_(counters) {}

  OutboundQueue& queue() { return queue_; }
  const OutboundQueue& queue() const { return queue_; }

  // Sends what can be sent. Call it after anything was put into the queue or credit was added. A message that cannot be
  // encoded, as where memory is out, ends the call with RESOURCE_EXHAUSTED.
  void kick();
  template <class... T>  // as OutboundQueue::push
  void push(T&&... message) {
    queue_.push(std::forward<T>(message)...);
    kick();
  }

  // Ends the call now: what waits is dropped. The first end wins.
  void finish(const grpc::Status& status);
  // Ends the call once everything that waits has been sent.
  void finish_when_drained(const grpc::Status& status);
  bool finished() const;

  // The call's OnWriteDone.
  void write_done(bool ok);

 private:
  // All with mutex_ held. What is thrown on the way of a message ends the call: RESOURCE_EXHAUSTED.
  void advance() noexcept;
  void send_next();
  void set_end(const grpc::Status& status) noexcept;  // the first one counts
  void wake_at(double at_s);
  void note_age(const Outbound& message, double now);

  Call* const call_;
  const Encoder encoder_;
  TimerQueue& timers_;
  StreamCounters* const counters_;
  OutboundQueue queue_;

  mutable std::mutex mutex_;
  bool writing_ = false, finished_ = false;
  std::optional<grpc::Status> end_;
  grpc::ByteBuffer message_;  // in flight
  bool is_tile_ = false;      // it is
  double wake_at_s_ = 0;
};

}  // namespace helio
