#include "client/shards/shard.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>

namespace helio {

namespace pb = heliograph::v1;

Result<Shard> parse_shard(const std::string& text) {
  const char *first = text.data(), *last = first + text.size();
  Shard shard;
  const auto number = std::from_chars(first, last, shard.number);
  const bool slash = number.ec == std::errc() && number.ptr != last && *number.ptr == '/';
  const auto count = std::from_chars(slash ? number.ptr + 1 : last, last, shard.count);
  if (!slash || count.ec != std::errc() || count.ptr != last || shard.count < 1 || shard.count > kMostShards ||
      shard.number < 1 || shard.number > shard.count) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("'{}' is not I/N, part I of N, with I in [1, N] and N in [1, {}]", text, kMostShards),
                 {}};
  }
  return shard;
}

std::string to_string(const Shard& shard) {
  return fmt::format("{}/{}", shard.number, shard.count);
}

int most_shards(int height) {
  return std::min(kMostShards, (height + kShardBlock - 1) / kShardBlock);
}

std::string to_string(const RowRange& rows) {
  return fmt::format("[{}, {})", rows.first, rows.end);
}

RowRange rows_of(const Shard& shard, int height) {
  const std::int64_t blocks = (height + kShardBlock - 1) / kShardBlock;
  const auto row = [&](int part) { return std::min(height, int(blocks * part / shard.count) * kShardBlock); };
  return {row(shard.number - 1), row(shard.number)};
}

RowRange rendered_rows(const Shard& shard, int height) {
  const RowRange own = rows_of(shard, height);
  return {std::max(0, own.first - kShardMargin), std::min(height, own.end + kShardMargin)};
}

std::string no_shards_reason(const pb::RenderSettings& settings, const pb::Budget& budget) {
  if (settings.mode() != pb::MODE_UNSPECIFIED && settings.mode() != pb::MODE_PT)
    return "goes with --mode pt alone: in the others, how many samples a pixel gets depends on the whole picture";
  if (settings.integrator() != pb::INTEGRATOR_UNSPECIFIED && settings.integrator() != pb::INTEGRATOR_PATH)
    return "goes with --integrator path alone: light paths reach the whole picture, and so does their noise";
  if (!settings.device().empty() && settings.device() != "cpu")
    return "goes with --device cpu alone: other devices do not promise the same bits in a part";
  if (budget.samples() == 0 || budget.time_s() > 0 || budget.error() > 0)
    return "goes with --samples alone: by time or error, the parts would end at different numbers of samples";
  return {};
}

}  // namespace helio
