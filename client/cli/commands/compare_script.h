// Options of `heliograph compare` besides its modes: budgets, seeds, measures, regions, references.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/options.h"
#include "heliograph/v1/compare.pb.h"

namespace helio::cli {

struct CompareScriptOptions {
  TextOption seeds, samples, time, measures, worst_pixels, reference, reference_error, reference_samples,
      reference_integrator, gaze;
  std::vector<std::string> regions;
  bool common_seeds = false, exclusive = false;
};
void add_compare_script_options(CLI::App& app, CompareScriptOptions& options);

// Sets all but scene, modes, views and the reference's settings. `seed`: --seed, the first one. `path`: several views
// are compared.
void read_compare_script(const CompareScriptOptions& options, const TextOption& seed, bool path, OptionReader& reader,
                         heliograph::v1::CompareRequest& request);
// Adds a problem for each region that reaches out of the picture, or has no pixel of it.
void check_regions(const heliograph::v1::CompareRequest& request, int width, int height, Problems& problems);

// The place from which references are loaded: a file, of one view; a folder with reference.view0.exr,
// reference.view1.exr, ..., as the pictures of a comparison are; or a name in which #### stands for the view's number.
// None: they are rendered.
struct ReferenceFiles {
  std::string name;

  bool given() const { return !name.empty(); }
  std::string file(int view) const;
};
ReferenceFiles read_reference_files(const CompareScriptOptions& options, OptionReader& reader);

// Reads a view's file: an EXR of the whole picture with finite R, G and B. Adds a problem for what is wrong with it.
// `size`: of the picture, (0, 0): not known yet. Returns the file's own.
std::optional<std::pair<int, int>> check_reference(const ReferenceFiles& files, int view, std::pair<int, int> size,
                                                   OptionReader& reader, const TextOption& option);

// Valid UTF-8, as messages need it: other bytes become U+FFFD.
std::string as_utf8(const std::string& text);

}  // namespace helio::cli
