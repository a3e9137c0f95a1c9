#include "client/cli/denoiser_options.h"

#include <cstdlib>

namespace helio::cli {

void add_denoiser_options(CLI::App& app, DenoiserOptions& options) {
  add_text(app, options.denoiser, "--denoiser", "NAME",
           "Who makes the layer display: own, a cross filter, or oidn, Intel Open Image Denoise, which has to be "
           "provided. Default: own");
  add_text(app, options.oidn_library, "--oidn-library", "PATH",
           "libOpenImageDenoise.so of Open Image Denoise 2.x for --denoiser oidn; only without --server. Default: "
           "HELIOGRAPH_OIDN of the environment");
}

std::string read_denoiser(const DenoiserOptions& options, Connection& connection, heliograph::v1::TileFormat& format,
                          OptionReader& reader) {
  const std::string name = reader.choice(options.denoiser, {"own", "oidn"}).value_or("own");
  const bool in_process = connection.address.empty();
  if (options.oidn_library.given()) {
    if (!in_process) reader.problem(options.oidn_library, "does not go with --server: the daemon has its own");
    if (name != "oidn") reader.problem(options.oidn_library, "is only valid with --denoiser oidn");
  }
  const auto given = reader.text(options.oidn_library);
  if (name != "oidn") return name;
  if (!format.display())
    reader.problem(options.denoiser, "'oidn' makes the layer display, for which --png or --layers display has to ask");
  format.set_display_denoiser(heliograph::v1::DENOISER_OIDN);
  if (!in_process) return name;
  const char* const variable = std::getenv("HELIOGRAPH_OIDN");
  connection.oidn_library = given.value_or(variable ? variable : "");
  if (connection.oidn_library.empty() && !options.oidn_library.given()) {
    reader.problem(options.denoiser,
                   "'oidn' needs Open Image Denoise, whose libOpenImageDenoise.so --oidn-library or HELIOGRAPH_OIDN "
                   "has to name");
  }
  return name;
}

}  // namespace helio::cli
