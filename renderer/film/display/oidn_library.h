// Intel Open Image Denoise 2.x, loaded from a shared library when the program runs: nothing of it is linked or
// included. Its filter "RT" is a network that was trained on path-traced pictures (Afra, Intel Open Image Denoise,
// 2019-2025).
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"

namespace helio {

struct OidnFunctions;  // of its C API

class OidnLibrary {
 public:
  // path: a file, or a file name that the dynamic linker looks up. threads: that a picture is denoised with, >= 0; 0:
  // one per core. Errors, in one sentence with the path and what is allowed: not_found (no such library),
  // failed_precondition (a missing symbol, which is named; a version other than 2.x; no device of the processor's).
  // The library stays in the process.
  static Result<std::shared_ptr<const OidnLibrary>> load(const std::string& path, int threads);
  ~OidnLibrary();
  OidnLibrary(const OidnLibrary&) = delete;
  OidnLibrary& operator=(const OidnLibrary&) = delete;

  // width x height pixels, row-major, top row first, three floats a pixel. None overlap.
  struct Images {
    int width = 0, height = 0;      // > 0
    const float* color = nullptr;   // linear radiance, finite, >= 0
    const float* albedo = nullptr;  // of the first hits, [0, 1]; may be noisy
    const float* normal = nullptr;  // of the first hits, world space, length at most 1; may be noisy
    float* output = nullptr;        // linear radiance; unspecified after an error
  };
  // Blocks; seconds for millions of pixels. Thread safe, each call with a device and threads of its own. Ends soon
  // after `cancel` (null: never) is raised. Errors: cancelled; internal, in the library's words.
  Status denoise(const Images& images, const CancelToken* cancel) const;

  // Most bytes that denoise() takes beside the images of so many pixels. Large pictures are denoised in tiles.
  static std::size_t scratch_bytes(std::size_t pixels);

  const std::string& path() const { return path_; }
  const std::string& version() const { return version_; }  // "2.5.1"

 private:
  OidnLibrary(std::string path, int threads);
  Status check_device();

  const std::string path_;
  const int threads_;
  std::string version_;
  std::unique_ptr<const OidnFunctions> functions_;
};

}  // namespace helio
