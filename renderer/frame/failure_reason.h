// The reason of a frame that failed.
#pragma once

#include <exception>
#include <new>
#include <string>

namespace helio {

// Tells of the exception that is being handled. Itself it never throws: without memory the text is one that
// std::string holds without allocating.
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
  return "out of memory";
}

}  // namespace helio
