#include "renderer/film/allocation/first_samples.h"

#include "renderer/film/core/film_windows.h"
#include "renderer/film/history/film_history.h"

namespace helio {

std::uint64_t target_first_samples(Film& film, const PixelRect& window) {
  SampleTargets& targets = *film.targets();
  const FilmHistory& history = *film.history();
  std::uint64_t samples = 0;
  for (const PixelRect& block : cut_aligned(window, kFilmBlock, kFilmBlock)) {
    bool any = false;
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        const CarriedPixel& carried = history.carried(x, y);
        const bool nothing = carried.count[0] == 0 && carried.count[1] == 0;
        targets.set_target(0, x, y, nothing);
        targets.set_target(1, x, y, 0);
        samples += nothing;
        any |= nothing;
      }
    }
    targets.block(block.x0, block.y0) = {{0, 0}, {any, 0}};
  }
  return samples;
}

RoundSummary round_of_first_samples(std::uint64_t samples) {
  RoundSummary round;
  round.top[0] = samples > 0;
  round.by_octave[0][0] = samples;
  return round;
}

}  // namespace helio
