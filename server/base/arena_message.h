// A message whose parts may fail to be allocated. Parsing and copying note which member of a oneof is there before they
// allocate it; on the heap the message's destructor would free what is not there, on an arena there is nothing to free.
#pragma once

#include <google/protobuf/arena.h>

#include <memory>

namespace helio {

template <class Message>
class ArenaMessage {
 public:
  // Throws std::bad_alloc.
  ArenaMessage() : message_(google::protobuf::Arena::CreateMessage<Message>(&arena_)) {}

  Message& operator*() { return *message_; }
  const Message& operator*() const { return *message_; }
  Message* operator->() { return message_; }
  const Message* operator->() const { return message_; }

 private:
  google::protobuf::Arena arena_;
  Message* message_;
};

// For whoever holds it longest. Throws std::bad_alloc.
template <class Message>
std::shared_ptr<Message> make_arena_message() {
  const auto held = std::make_shared<ArenaMessage<Message>>();
  return {held, &**held};
}

}  // namespace helio
