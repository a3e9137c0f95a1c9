// --tev: the picture in tev or HDRView while it is rendered.
#pragma once

#include <memory>
#include <optional>

#include "client/cli/options.h"
#include "client/cli/terminal.h"
#include "client/frame_assembler.h"
#include "client/tev/tev_bridge.h"

namespace helio::cli {

void add_tev_option(CLI::App& app, TextOption& option);
// Looks the host up. None where the option is absent, or a problem was told.
std::optional<TevAddress> read_tev(const TextOption& option, OptionReader& reader);

// Adds a tile as FrameAssembler::add() does, and shows it when it is taken. `tev` may be null.
Result<FrameAssembler::Outcome> add_and_show(FrameAssembler& picture, heliograph::v1::Tile tile, TevBridge* tev);

// Null where there is no address. Warns on the terminal, which has to outlive it.
std::unique_ptr<TevBridge> open_tev(const std::optional<TevAddress>& address, const heliograph::v1::TileFormat& format,
                                    Terminal& terminal);
// Finishes, and sets the member "tev": address, image, updates, warning (null: none). Nothing for null.
void close_tev(TevBridge* tev, const std::optional<TevAddress>& address, Json& json);

}  // namespace helio::cli
