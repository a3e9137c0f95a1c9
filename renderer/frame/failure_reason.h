// The reason of a frame that failed.
#pragma once

#include <exception>
#include <new>
#include <string>

namespace helio {

// FrameEnd.message of a frame that lacked memory: short enough that std::string holds it without allocating.
inline constexpr char kOutOfMemory[] = "out of memory";

// Tells of the exception that is being handled. Itself it never throws: without memory the text is kOutOfMemory.
inline std::string failure_reason() noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
  } catch (const std::exception& exception) {
    try {
      return exception.what();
    } catch (...) {
    }
  } catch (...) {
    return "unknown error";
  }
  return kOutOfMemory;
}

}  // namespace helio
