#include "server/web/bridged_call.h"

#include <grpcpp/generic/generic_stub.h>

#include <boost/asio/post.hpp>
#include <new>
#include <utility>

#include "server/base/access_tokens.h"
#include "server/base/grpc_status.h"
#include "server/base/parse_message.h"

namespace helio {

void BridgedCalls::begun() {
  const std::lock_guard lock(mutex_);
  ++calls_;
}

void BridgedCalls::over() {
  const std::lock_guard lock(mutex_);
  if (--calls_ == 0) changed_.notify_all();
}

void BridgedCalls::wait_until_empty() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return calls_ == 0; });
}

std::shared_ptr<BridgedCall> BridgedCall::start(BridgedCalls& calls, std::weak_ptr<Owner> owner, std::uint64_t id,
                                                const WebCall& kind, const std::string& authorization) {
  struct Delete {
    void operator()(BridgedCall* call) const { delete call; }
  };
  const std::shared_ptr<BridgedCall> call(new BridgedCall(calls, std::move(owner), id, kind), Delete());
  call->self_ = call;
  calls.begun();
  if (!authorization.empty()) call->context_.AddMetadata(kAuthorizationKey, authorization);
  grpc::GenericStub stub(calls.channel());
  stub.PrepareBidiStreamingCall(&call->context_, kind.method, grpc::StubOptions(), call.get());
  call->AddHold();  // writes and further reads start outside of gRPC's threads
  call->StartRead(&call->response_);
  call->StartCall();
  return call;
}

void BridgedCall::next() {
  response_.Clear();
  if (!closed_) StartRead(&response_);
}

bool BridgedCall::send(std::span<const std::uint8_t> request) {
  if (ended_) return false;
  const grpc::Slice slice(request.data(), request.size());
  requests_.emplace_back(&slice, 1);
  if (!kind_.many_requests) ended_ = true;
  write_more();
  return true;
}

void BridgedCall::end() {
  ended_ = true;
  write_more();
}

void BridgedCall::write_more() {
  if (writing_ || writes_done_ || closed_) return;
  if (!requests_.empty()) {
    writing_ = true;
    StartWrite(&requests_.front());
  } else if (ended_) {
    writes_done_ = true;
    StartWritesDone();
  }
}

template <class T>
class BridgedCall::RoomAllocator {
 public:
  using value_type = T;
  explicit RoomAllocator(Room& room) : room_(&room) {}
  template <class U>
  RoomAllocator(const RoomAllocator<U>& other) : room_(other.room_) {}
  T* allocate(std::size_t n) {
    if (n * sizeof(T) > Room::kBytes) throw std::bad_alloc();
    return reinterpret_cast<T*>(room_->bytes);
  }
  void deallocate(T*, std::size_t) {}
  template <class U>
  bool operator==(const RoomAllocator<U>& other) const {
    return room_ == other.room_;
  }

 private:
  template <class U>
  friend class RoomAllocator;
  Room* room_;
};

template <class Function>
class BridgedCall::Posted {
 public:
  using allocator_type = RoomAllocator<std::byte>;
  Posted(Room& room, Function function) : room_(&room), function_(std::move(function)) {}
  allocator_type get_allocator() const noexcept { return allocator_type(*room_); }
  void operator()() { function_(); }

 private:
  Room* room_;
  Function function_;
};

template <class Function>
void BridgedCall::post(Room& room, Function function) {
  boost::asio::post(calls_.thread(), Posted<Function>(room, std::move(function)));
}

void BridgedCall::OnReadDone(bool ok) {
  post(read_room_, [call = self_, ok] {
    if (!ok) return call->read_failed();
    if (const auto owner = call->owner_.lock()) return owner->response_ready(*call);
    call->cancel();
    call->next();
  });
}

// No more responses: the status follows as soon as nothing is under way and nothing more may begin.
void BridgedCall::read_failed() {
  closed_ = true;
  RemoveHold();
}

void BridgedCall::OnWriteDone(bool ok) {
  post(write_room_, [call = self_, ok] {
    const std::size_t bytes = call->requests_.front().Length();
    call->requests_.pop_front();
    call->writing_ = false;
    if (ok) call->write_more();
    if (const auto owner = call->owner_.lock()) owner->request_taken(bytes);
  });
}

void BridgedCall::OnDone(const grpc::Status& status) {
  status_ = copy_status(status);
  post(done_room_, [call = std::move(self_)] {
    struct Over {
      BridgedCalls& calls;
      ~Over() { calls.over(); }  // whatever the owner throws
    } over{call->calls_};
    std::size_t untaken = 0;
    for (const grpc::ByteBuffer& request : call->requests_) untaken += request.Length();
    if (const auto owner = call->owner_.lock()) {
      if (untaken > 0) owner->request_taken(untaken);
      owner->call_over(*call, call->status_);
    }
  });
}

std::string BridgedCall::ignored_fields() const {
  const auto& trailing = context_.GetServerTrailingMetadata();
  const auto found = trailing.find(kIgnoredFieldsKey);
  return found == trailing.end() ? std::string() : std::string(found->second.data(), found->second.size());
}

}  // namespace helio
