// Edits of a scene on the command line: --object, --material, --light, --environment-light.
#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "heliograph/v1/render_service.pb.h"

namespace helio::cli {

// Options that may be given more than once.
struct EditOptions {
  std::vector<std::string> objects, materials, lights, environment;

  bool given() const { return !objects.empty() || !materials.empty() || !lights.empty() || !environment.empty(); }
};
void add_edit_options(CLI::App& app, EditOptions& options);

// TARGET=key:value;key:value; TARGET is a name, or # and a number. Every problem of form is told; what the values mean
// for the scene is the server's to say.
std::vector<heliograph::v1::SceneEdit> read_edits(const EditOptions& options, Problems& problems);

extern const char* const kEditHelp;

}  // namespace helio::cli
