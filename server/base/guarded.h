// Keeps what a library or the allocator throws away from gRPC's threads and those of loads, edits and replays, where
// it would end the daemon.
#pragma once

#include <exception>
#include <new>

#include "renderer/base/result.h"

namespace helio {

// Without memory for the message: "out of memory", which is short enough to need none.
inline Error error_without_throwing(ErrorCode code, const char* message) noexcept {
  try {
    return {code, message, {}};
  } catch (const std::bad_alloc&) {
    return {code, "out of memory", {}};
  }
}

// Calls `function`, which gives a Result<T>. An exception becomes an Error: resource_exhausted when memory is out (a
// limit that is set above what the machine has), internal otherwise.
template <class Function>
auto guarded(Function&& function) -> decltype(function()) {
  try {
    return function();
  } catch (const std::bad_alloc&) {
    return error_without_throwing(ErrorCode::resource_exhausted,
                                  "the machine's memory is used up, although max_memory is not");
  } catch (const std::exception& exception) {
    return error_without_throwing(ErrorCode::internal, exception.what());
  }
}

}  // namespace helio
