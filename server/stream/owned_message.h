// Members of a oneof, for set_allocated_*(): mutable_*() notes which member is there before it allocates it, and the
// message's destructor would free what is not there if that failed.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace helio {

// Throws std::bad_alloc. Moved, not copied: copies of oneofs have the same flaw.
template <class Message>
Message* owned_message(Message&& message) {
  static_assert(!std::is_reference_v<Message>);
  return std::make_unique<Message>(std::move(message)).release();
}

}  // namespace helio
