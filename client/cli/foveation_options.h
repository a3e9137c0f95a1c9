// Options that say what a gaze changes: --foveation and what belongs to it.
#pragma once

#include "client/cli/options.h"
#include "heliograph/v1/types.pb.h"

namespace helio::cli {

struct FoveationOptions {
  TextOption kind, viewing_distance, disk, antialiasing, mends;

  // All of them.
  std::vector<TextOption*> all() { return {&kind, &viewing_distance, &disk, &antialiasing, &mends}; }
};
void add_foveation_options(CLI::App& app, FoveationOptions& options);

// Sets what is given. Returns whether a gaze has a use.
bool read_foveation(const FoveationOptions& options, OptionReader& reader, heliograph::v1::RenderSettings& settings);

// An option x,y, in pixels of the film.
std::optional<heliograph::v1::Gaze> read_point(const TextOption& option, OptionReader& reader);
heliograph::v1::Gaze centre_of_film(const heliograph::v1::RenderSettings& settings);

}  // namespace helio::cli
