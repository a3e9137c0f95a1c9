#include "client/cli/shard_option.h"

#include <spdlog/fmt/fmt.h>

namespace helio::cli {

namespace pb = heliograph::v1;

void add_shard_option(CLI::App& app, TextOption& option) {
  add_text(
      app, option, "--shard", "I/N",
      "Render part I of N, I in [1, N]: rows of the picture and a margin of 16 more, for heliograph merge. Only with "
      "--mode pt, --integrator path and --samples. Default: the whole picture");
}

std::optional<Shard> read_shard(const TextOption& option, const SettingsOptions& options,
                                const pb::RenderSettings& settings, const pb::Budget& budget,
                                const pb::TileFormat& format, OptionReader& reader) {
  if (!option.given()) return std::nullopt;
  const auto shard = parse_shard(option.text);
  if (!shard) {
    reader.problem(option, shard.error().message);
    return std::nullopt;
  }
  if (const std::string reason = no_shards_reason(settings, budget); !reason.empty()) reader.problem(option, reason);
  if (options.region.given()) reader.problem(option, "is given beside --region; allowed: one of them");
  if (format.display()) {
    reader.problem(option,
                   "does not go with the layer display (--layers display, --png without --raw), which looks at more of "
                   "the picture than a part");
  }
  return *shard;
}

void set_region(const std::optional<Shard>& shard, const TextOption& option, pb::RenderSettings& settings,
                OptionReader& reader) {
  if (!shard) return;
  if (settings.has_region()) {
    reader.problem(option, "does not go with the crop that the scene gives its camera; --size leaves that out");
    return;
  }
  const int most = most_shards(settings.height());
  if (shard->count > most) {
    reader.problem(option, fmt::format("'{}': {} rows have {} blocks of {}; allowed: N in [1, {}]", option.text,
                                       settings.height(), most, kShardBlock, most));
    return;
  }
  const RowRange rows = rendered_rows(*shard, settings.height());
  pb::Rect& region = *settings.mutable_region();
  region.set_x1(settings.width());
  region.set_y0(rows.first);
  region.set_y1(rows.end);
}

}  // namespace helio::cli
