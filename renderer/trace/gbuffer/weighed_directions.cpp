#include "renderer/trace/gbuffer/weighed_directions.h"

#include <algorithm>
#include <cfloat>

#include "renderer/trace/sampling/sampler.h"

namespace helio {

void WeighedDirections::merge_equal() {
  std::size_t distinct = 0;
  std::uint64_t seen = 0;  // of the hashes of those before: most directions are met once
  for (const WeighedDirection& d : all()) {
    const std::uint64_t hash = std::uint64_t(1) << (d.packed * 0x9e3779b9u >> 26);
    std::size_t i = seen & hash ? 0 : distinct;
    seen |= hash;
    while (i < distinct && of[i].packed != d.packed) ++i;
    if (i == distinct)
      of[distinct++] = d;
    else
      of[i].weight = std::min(of[i].weight + d.weight, FLT_MAX);
  }
  count = distinct;
}

void pick_directions(std::span<const WeighedDirections* const> among, std::uint32_t key, DirectionReservoir& out) {
  constexpr unsigned kPlaces = kHalves * DirectionReservoir::kPlaces;
  out = {};
  double total = 0, light = 0;
  for (const WeighedDirections* directions : among) {
    light += directions->light;
    for (const WeighedDirection& d : directions->all()) total += double(d.weight);
  }
  if (!(total > 0)) return;
  key = hash32(key);
  // Rounded up in one half where they are rounded down in the other.
  const float first = unit_float(hash32(~key)), u[kHalves] = {first, kOneMinusEpsilon - first};
  for (int h = 0; light > 0 && h < kHalves; ++h)
    out.set_share(h, DirectionReservoir::share_of(float(total / light)), u[h]);
  const double step = total / kPlaces;
  double next = double(unit_float(key)) * step, sum = 0;
  // Of the first: samples that come all for one half replace none but its places.
  const unsigned start = hash32(key) % kPlaces;
  unsigned filled = 0;
  const auto fill = [&](std::uint32_t packed) {
    const unsigned place = (start + filled++) % kPlaces;
    out.set_direction(int(place / DirectionReservoir::kPlaces), int(place % DirectionReservoir::kPlaces), packed);
  };
  std::uint32_t last = DirectionReservoir::kNone;
  for (const WeighedDirections* directions : among) {
    for (const WeighedDirection& d : directions->all()) {
      if (!(d.weight > 0)) continue;
      last = d.packed;
      sum += double(d.weight);
      for (; filled < kPlaces && next < sum; next += step) fill(last);
    }
  }
  while (filled < kPlaces) fill(last);  // rounding
}

}  // namespace helio
