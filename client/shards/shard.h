// A picture in parts: bands of rows that are rendered apart, on several machines or one after the other.
//
// A sample is a function of pixel, half, index, dimension and seed, so a region of a picture by path tracing has the
// bits of the whole picture. Only the variance looks at its neighbours, up to 3 pixels away (renderer/film/estimate/
// variance_pool.h): a part is rendered with a margin, and put together without it. Paths are traced in blocks of 16x16
// pixels whatever the region, so margins are whole blocks.
#pragma once

#include <string>

#include "heliograph/v1/types.pb.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

inline constexpr int kShardBlock = 16;   // rows; parts begin at multiples of it
inline constexpr int kShardMargin = 16;  // rows above and below, as far as the picture goes
inline constexpr int kMostShards = 4096;

struct Shard {
  int number = 1;  // [1, count]
  int count = 1;   // [1, kMostShards]

  bool operator==(const Shard&) const = default;
};

// "2/4": the second of four. invalid_argument otherwise.
Result<Shard> parse_shard(const std::string& text);
std::string to_string(const Shard& shard);

// Into how many parts a picture of this height can be cut, at most.
int most_shards(int height);

// Rows [first, end) of the picture.
struct RowRange {
  int first = 0, end = 0;

  bool operator==(const RowRange&) const = default;
};
std::string to_string(const RowRange& rows);  // "[64, 128)"

// The rows that are the part's own: all parts together have each row once. Precondition: shard.count <=
// most_shards(height).
RowRange rows_of(const Shard& shard, int height);
// The same with the margin.
RowRange rendered_rows(const Shard& shard, int height);

// Why these settings cannot be rendered in parts; empty: they can.
std::string no_shards_reason(const heliograph::v1::RenderSettings& settings, const heliograph::v1::Budget& budget);

}  // namespace helio
