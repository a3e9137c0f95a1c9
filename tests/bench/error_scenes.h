// Scenes of `helio_bench modes` and `peers`, with the pictures that errors are measured against.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "bench_context.h"
#include "loop_rendering.h"

namespace helio::bench {

struct ErrorScene {
  std::string name;
  std::filesystem::path file;
  std::shared_ptr<const RenderScene> scene;
  LoopPicture reference;
  double reference_mse = 0;  // its own: mean variance over pixels and channels; 0: not known
};

// R, G and B of an EXR file. invalid_argument when one is missing, and what read_exr says.
Result<LoopPicture> read_picture(const std::filesystem::path& file, const std::string& prefix = "");

enum class SceneKind { any, mitsuba_xml };

// `name`: a file, or the name of a scene: of shared scenes/bench (with `mitsuba_xml` of its folder mitsuba and of
// scenes/mitsuba-references), else of the project's scenes/. not_found lists where it was looked for.
Result<std::filesystem::path> find_error_scene(const BenchOptions& options, const std::string& name, SceneKind kind);

// The scene with its reference: STEM.reference.exr or STEM.mean.exr, with STEM.variance.exr, beside the file or in the
// folder above it, made by another renderer; where there is none, a picture of `samples` samples a pixel of our own, of
// seeds that no curve uses, options.size pixels high. That one is kept in options.cache under a name that holds a
// checksum of every byte the scene was read from: who changes what a scene file means deletes it.
Result<ErrorScene> load_error_scene(const BenchOptions& options, const std::filesystem::path& file,
                                    RenderEngine& engine, std::uint32_t samples);

}  // namespace helio::bench
