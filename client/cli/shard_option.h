// --shard: one of several parts of a picture, which `heliograph merge` puts together.
#pragma once

#include <optional>

#include "client/cli/options.h"
#include "client/cli/render_options.h"
#include "client/shards/shard.h"

namespace helio::cli {

void add_shard_option(CLI::App& app, TextOption& option);

// What goes with it is told here: settings, budget, no --region, no layer display.
std::optional<Shard> read_shard(const TextOption& option, const SettingsOptions& options,
                                const heliograph::v1::RenderSettings& settings, const heliograph::v1::Budget& budget,
                                const heliograph::v1::TileFormat& format, OptionReader& reader);

// Sets the region. Precondition: the settings have their size (set_defaults).
void set_region(const std::optional<Shard>& shard, const TextOption& option, heliograph::v1::RenderSettings& settings,
                OptionReader& reader);

}  // namespace helio::cli
