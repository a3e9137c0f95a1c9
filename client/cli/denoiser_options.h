// Who makes the layer display: --denoiser and --oidn-library.
#pragma once

#include <string>

#include "client/cli/connection.h"
#include "client/cli/options.h"
#include "heliograph/v1/types.pb.h"

namespace helio::cli {

struct DenoiserOptions {
  TextOption denoiser, oidn_library;
};
void add_denoiser_options(CLI::App& app, DenoiserOptions& options);
// Returns "own" or "oidn". The latter is asked for in `format`, which must have the layer display by now, and in
// process `connection` gets the library that the options or HELIOGRAPH_OIDN name.
std::string read_denoiser(const DenoiserOptions& options, Connection& connection, heliograph::v1::TileFormat& format,
                          OptionReader& reader);

}  // namespace helio::cli
