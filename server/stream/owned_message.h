// Members of a oneof, for set_allocated_*(): mutable_*() notes which member is there before it allocates it, and the
// message's destructor would free what is not there if that failed.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace helio {

// Throws std::bad_alloc.
template <class Message>
std::decay_t<Message>* owned_message(Message&& message) {
  return std::make_unique<std::decay_t<Message>>(std::forward<Message>(message)).release();
}

}  // namespace helio
