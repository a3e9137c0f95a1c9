#include "client/cli/tev_option.h"

#include <filesystem>
#include <string>
#include <system_error>

namespace helio::cli {

void add_tev_option(CLI::App& app, TextOption& option) {
  add_text_or_none(app, option, "--tev", "HOST:PORT",
                   std::string("Shows the picture in tev or HDRView while it is rendered; also unix:PATH. Default "
                               "address: ") +
                       kDefaultTevAddress);
}

std::optional<TevAddress> read_tev(const TextOption& option, OptionReader& reader) {
  if (!option.given()) return std::nullopt;
  auto address = resolve_tev_address(option.text.empty() ? kDefaultTevAddress : option.text);
  if (address) return std::move(*address);
  // A scene that follows the option is taken for the address.
  std::error_code ignored;
  const bool file = std::filesystem::exists(option.text, ignored);
  reader.problem(option, address.error().message + (file ? "; a FILE stands before --tev, or after its address" : ""));
  return std::nullopt;
}

Result<FrameAssembler::Outcome> add_and_show(FrameAssembler& picture, heliograph::v1::Tile tile, TevBridge* tev) {
  heliograph::v1::Tile shown;
  if (tev) shown = tile;
  auto added = picture.add(std::move(tile));
  if (tev && added && *added == FrameAssembler::Outcome::taken) tev->add(std::move(shown));
  return added;
}

std::unique_ptr<TevBridge> open_tev(const std::optional<TevAddress>& address, const heliograph::v1::TileFormat& format,
                                    Terminal& terminal) {
  if (!address) return nullptr;
  return std::make_unique<TevBridge>(*address, format, [&terminal](const std::string& text) { terminal.warn(text); });
}

void close_tev(TevBridge* tev, const std::optional<TevAddress>& address, Json& json) {
  if (!tev) return;
  tev->finish();
  const TevReport report = tev->report();
  json["tev"] = {{"address", address->text},
                 {"image", tev->image_name()},
                 {"updates", report.updates},
                 {"warning", report.warning.empty() ? Json() : Json(report.warning)}};
}

}  // namespace helio::cli
