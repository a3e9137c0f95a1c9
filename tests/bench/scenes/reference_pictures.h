// Pictures of many samples that errors are measured against, rendered once and kept: one for every scene, view and
// setting.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tests/bench/scenes/loop_rendering.h"

namespace helio::bench {

// As many as the paper's references have (Schalk 2018, chapter 4.1).
inline constexpr std::uint32_t kReferenceSamples = 4096;

struct ReferenceRequest {
  std::string name;                  // of the scene, for the file's name
  std::uint64_t scene_checksum = 0;  // of every byte the scene was read from
  std::shared_ptr<const RenderScene> scene;
  CameraPose view;
  RenderSettings settings;                    // mode, variant and seed do not count: always pt, own seeds
  std::uint32_t samples = kReferenceSamples;  // per pixel, >= 2
};

struct Reference {
  LoopPicture picture;
  LoopPicture variance;  // of the picture's values
  LoopPicture noise;     // ((a - b) / 2)^2 of the two pictures, of each value by itself
};

// Where it is kept: in `folder`, by the scene's name, size, samples and a checksum of all that makes the picture. Who
// changes what scene files or settings mean deletes the folder.
std::filesystem::path reference_file(const std::filesystem::path& folder, const ReferenceRequest& request);

// Read from its file where there is one; else the mean of two independent pictures of half the samples, of seeds that
// no run uses (those count from 0), written there. The variance is from their differences, each the mean over 3x3
// pixels: a single difference says next to nothing of its own pixel. permission_denied, and what rendering and EXR
// files say.
Result<Reference> reference_picture(RenderEngine& engine, const std::filesystem::path& folder,
                                    const ReferenceRequest& request);

// R, G and B of an EXR file, each with `prefix`. invalid_argument when one is missing, and what read_exr says.
Result<LoopPicture> read_picture(const std::filesystem::path& file, const std::string& prefix = "");

// Mean over pixels and channels.
double mean_of(const LoopPicture& picture);

}  // namespace helio::bench
