// Film, mode and budget of a command, as the protocol's messages.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "client/cli/options.h"
#include "heliograph/v1/render_service.pb.h"

namespace helio::cli {

struct SettingsOptions {
  TextOption size, camera, seed, technique, filter, region, device;
  std::map<std::string, TextOption, std::less<>> fields;  // by path in the protocol's RenderSettings
};
// Those that any picture has: size, camera, seed, roulette, filter, region, device. The others stay absent.
void add_picture_options(CLI::App& app, SettingsOptions& options);
// These and all others.
void add_settings_options(CLI::App& app, SettingsOptions& options);
// Width and height stay 0 when --size is absent: see set_defaults. Problems are those of the daemon's validator, named
// by the option that the field comes from. mode: where --mode is absent.
heliograph::v1::RenderSettings read_settings(const SettingsOptions& options, OptionReader& reader,
                                             heliograph::v1::Mode mode = heliograph::v1::MODE_UNSPECIFIED);
// True where the settings name a device other than the CPU.
bool asks_for_device(const heliograph::v1::RenderSettings& settings);
// Checks settings, which need not be whole, against the daemon's limits, modes and integrators.
void check_against_server(const SettingsOptions& options, const heliograph::v1::RenderSettings& settings,
                          const heliograph::v1::GetServerInfoResponse& server, OptionReader& reader);

// The camera to look through: --camera, else the scene's first.
const heliograph::v1::SceneCamera* choose_camera(const SettingsOptions& options, const heliograph::v1::SceneInfo& scene,
                                                 OptionReader& reader);
// What was not asked for: the size and crop that the file gives the camera, else 720 rows at its aspect, 1280x720 when
// it has none; filter, longest path and roulette as the file says, the longest path as far as the integrator allows.
void set_defaults(heliograph::v1::RenderSettings& settings, const heliograph::v1::SceneInfo& scene,
                  const heliograph::v1::SceneCamera& camera);
struct BudgetOptions {
  std::map<std::string, TextOption, std::less<>> fields;  // by name in the protocol's Budget
};
// `paced`: tiles are sent on the way.
void add_budget_options(CLI::App& app, BudgetOptions& options, const std::string& of_what, bool paced = true);
heliograph::v1::Budget read_budget(const BudgetOptions& options, OptionReader& reader);

struct TransportOptions {
  TextOption compression, pixel_type, layers;
};
void add_transport_options(CLI::App& app, TransportOptions& options);
// Of a file that the daemon writes.
void add_kept_file_options(CLI::App& app, TransportOptions& options);
heliograph::v1::TileFormat read_kept_file(const TransportOptions& options, OptionReader& reader);
// `address`: the daemon's; empty: in process.
heliograph::v1::TileFormat read_transport(const TransportOptions& options, const std::string& address,
                                          OptionReader& reader);

}  // namespace helio::cli
