// Assertions on what the program itself guarantees; what a user or a file may get wrong is an Error (result.h) instead.
//
// HELIO_CHECK is tested in every build: for conditions that are cheap beside the code around them and whose violation
// would read or write memory that is not ours. HELIO_DCHECK is tested where HELIO_DCHECKS is defined (the builds that
// tests run in: CMake's option HELIO_DCHECKS) and costs nothing elsewhere. A violated condition ends the process with
// its text and place on stderr.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace helio {

[[noreturn, gnu::cold, gnu::noinline]] inline void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace helio

#define HELIO_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::helio::check_failed(#condition, __FILE__, __LINE__))

#ifdef HELIO_DCHECKS
#define HELIO_DCHECK(condition) HELIO_CHECK(condition)
#else
#define HELIO_DCHECK(condition) static_cast<void>(sizeof(!(condition)))
#endif
