// The modes of `heliograph compare`: words of --modes and --mode, each with options of `heliograph render`.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/cli/render_options.h"
#include "heliograph/v1/compare.pb.h"

namespace helio::cli {

struct CompareModeOptions {
  TextOption list;
  std::vector<std::string> named;
  // Settings of all modes, unless a mode says otherwise: size, camera, seed, filter, and length and roulette of paths.
  SettingsOptions common;
};
void add_compare_mode_options(CLI::App& app, CompareModeOptions& options);

// One mode as it was asked for.
class ChosenMode {
 public:
  // `text`: WORD[:option=value...]. `name`: empty for one made of the text. `option`: "--modes" or "--mode", for
  // messages.
  ChosenMode(const std::string& text, const std::string& name, const std::string& option, const SettingsOptions& common,
             Problems& problems);
  ~ChosenMode();
  ChosenMode(ChosenMode&&) noexcept;
  ChosenMode& operator=(ChosenMode&&) noexcept;

  const heliograph::v1::CompareMode& message() const;
  heliograph::v1::CompareMode& message();
  bool needs_path() const;  // its pictures are previews
  bool needs_oidn() const;
  // Checks the settings against the daemon's limits, modes and integrators.
  void check_against_server(const heliograph::v1::GetServerInfoResponse& server, Problems& problems) const;
  // Sets what the scene decides, and fills in all defaults.
  void complete(const heliograph::v1::SceneInfo& scene, const heliograph::v1::SceneCamera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The modes in their order, [1, 64], of unique names: the first is what the others are compared with.
std::vector<ChosenMode> read_compare_modes(const CompareModeOptions& options, Problems& problems);

// The settings that render a reference for a mode with `settings`.
heliograph::v1::RenderSettings reference_settings(heliograph::v1::RenderSettings settings);

extern const char* const kCompareModesHelp;

}  // namespace helio::cli
