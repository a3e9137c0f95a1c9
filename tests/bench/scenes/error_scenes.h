// Scenes of the benches that measure errors, with the pictures that errors are measured against.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/bench_context.h"
#include "tests/bench/scenes/reference_pictures.h"

namespace helio::bench {

struct ErrorScene {
  std::string name;
  std::filesystem::path file;
  std::shared_ptr<const RenderScene> scene;
  std::uint64_t checksum = 0;  // of every byte the scene was read from
  CameraPose view;             // the scene's own
  RenderSettings settings;     // as the file says (scene_settings.h), of the reference's size
  std::filesystem::path reference_file;
  LoopPicture reference;           // of that view
  LoopPicture reference_variance;  // of its values; zeroes: not known
  LoopPicture reference_noise;     // Reference::noise; the variance where another renderer made the reference
};

// What the reference's own noise adds to errors against it, in expectation: to the mean squared error, and to relMSE as
// renderer/metrics defines it. 0: not known.
double reference_mse(const ErrorScene& scene);
double reference_relmse(const ErrorScene& scene);

enum class SceneKind { any, mitsuba_xml };

// `name`: a file, or the name of a scene: of those that are generated (generated_scenes.h), of shared scenes/bench, of
// the project's scenes/ or of shared scenes/glb, in this order; with `mitsuba_xml` of shared scenes/bench/mitsuba or
// scenes/mitsuba-references. not_found lists where it was looked for.
Result<std::filesystem::path> find_error_scene(const BenchOptions& options, const std::string& name, SceneKind kind);

// The scene with its reference: STEM.reference.exr or STEM.mean.exr, with STEM.variance.exr, beside the file or in the
// folder above it, made by another renderer; where there is none, a picture of `samples` samples a pixel of our own,
// options.size pixels high, made as the file says and kept in options.cache (reference_pictures.h).
Result<ErrorScene> load_error_scene(const BenchOptions& options, const std::filesystem::path& file,
                                    RenderEngine& engine, std::uint32_t samples);

// The two in one. Nothing, and a note, where a scene that nobody asked for by
// name (options.scenes is empty) is not there.
Result<std::optional<ErrorScene>> open_error_scene(const BenchOptions& options, const std::string& name,
                                                   RenderEngine& engine,
                                                   std::uint32_t reference_samples = kReferenceSamples);

// Opens and measures the scenes of options.scenes or, where that is empty, those of `defaults`, one after the
// other. Ends with the first error.
Status measure_error_scenes(const BenchOptions& options, const std::vector<std::string>& defaults, RenderEngine& engine,
                            std::uint32_t reference_samples, const std::function<Status(const ErrorScene&)>& measure);

}  // namespace helio::bench
