#include "renderer/film/allocation/sample_allocation.h"

#include <algorithm>
#include <bit>

#include "renderer/base/check.h"
#include "renderer/film/allocation/fill_allocation.h"
#include "renderer/film/allocation/neyman_allocation.h"
#include "renderer/film/core/film_windows.h"

namespace helio {
namespace {

constexpr int kPartRows = 2 * kFilmBlock, kPartColumns = 64 * kFilmBlock;

// Adds the levels [from, to) to the octaves that they lie in.
void add_levels(std::uint32_t from, std::uint32_t to, std::array<std::uint64_t, 32>& by_octave) {
  if (from == 0 && to > 0) by_octave[0] += 1;
  for (std::uint64_t level = std::max(from, 1u); level < to;) {
    const int octave = std::bit_width(level) - 1;
    const std::uint64_t end = std::min<std::uint64_t>(to, std::uint64_t(2) << octave);
    by_octave[std::size_t(octave)] += end - level;
    level = end;
  }
}

}  // namespace

SampleAllocation::SampleAllocation(Film& film, const PixelRect& region, int sweeps)
    : film_(film),
      region_(intersect(region, film.bounds())),
      windows_(cut_aligned(region_, kPartColumns, kPartRows)),
      sweeps_(sweeps) {
  HELIO_DCHECK(film.targets() && !region_.empty());
  sums_.resize(windows_.size());
}

void SampleAllocation::note_targets(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  RoundSummary& round = sums_[part];
  const PixelRect& w = windows_[part];
  for (int by = w.y0; by < w.y1; by = next_edge(by, kFilmBlock)) {
    for (int bx = w.x0; bx < w.x1; bx = next_edge(bx, kFilmBlock)) {
      const PixelRect block = intersect({bx, by, next_edge(bx, kFilmBlock), next_edge(by, kFilmBlock)}, w);
      BlockLevels& levels = targets.block(bx, by);
      for (int h = 0; h < kHalves; ++h) {
        std::uint32_t first = ~0u, top = 0;
        for (int y = block.y0; y < block.y1; ++y) {
          for (int x = block.x0; x < block.x1; ++x) {
            const std::uint32_t has = film_.attempted(h, x, y), wants = targets.target(h, x, y);
            if (wants <= has) continue;
            first = std::min(first, has);
            top = std::max(top, wants);
            add_levels(has, wants, round.by_octave[h]);
          }
        }
        levels.first[h] = std::min(first, top);
        levels.top[h] = top;
        round.top[h] = std::max(round.top[h], top);
      }
    }
  }
}

void SampleAllocation::finish_round() {
  RoundSummary total;
  for (int h = 0; h < kHalves; ++h) {
    for (const RoundSummary& round : sums_) {
      total.top[h] = std::max(total.top[h], round.top[h]);
      for (std::size_t k = 0; k < total.by_octave[h].size(); ++k) total.by_octave[h][k] += round.by_octave[h][k];
    }
  }
  film_.targets()->round = total;
}

std::unique_ptr<SampleAllocation> make_allocation(Film& film, const PixelRect& region,
                                                  const AllocationSettings& settings,
                                                  const AllocationRequest& request) {
  HELIO_DCHECK(!settings.iterates);
  if (request.fill) return std::make_unique<FillAllocation>(film, region, settings, request);
  return std::make_unique<NeymanAllocation>(film, region, settings, request);
}

}  // namespace helio
