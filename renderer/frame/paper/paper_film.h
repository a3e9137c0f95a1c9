// What films keep for variant paper: first hits where pictures are reused, probabilities where samples are allocated.
#pragma once

#include <memory>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/core/film_extension.h"
#include "renderer/frame/paper/first_hits.h"

namespace helio {

class PaperFilm final : public FilmExtension {
 public:
  // stored_hits: 0, 1 or 4.
  PaperFilm(int width, int height, int stored_hits, bool probabilities);

  FirstHits* first_hits() { return first_hits_.get(); }  // null: none
  const FirstHits* first_hits() const { return first_hits_.get(); }

  bool has_probabilities() const { return !probability_.empty(); }
  // Of a further sample (threshold_allocation.h), >= 0; 0: not calculated yet. Precondition: has_probabilities().
  float& probability(int x, int y) { return probability_[index(x, y)]; }
  float probability(int x, int y) const { return probability_[index(x, y)]; }

  void clear(const PixelRect& window) override;
  void forget() override;
  std::size_t bytes() const override;

  static constexpr std::size_t bytes_per_pixel(int stored_hits, bool probabilities) {
    return (stored_hits > 0 ? FirstHits::bytes_per_pixel(stored_hits) : 0) + (probabilities ? sizeof(float) : 0);
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_;
  std::unique_ptr<FirstHits> first_hits_;
  std::vector<float> probability_;
};

// The state with what the variant needs of a film besides: of the mode's history the carried samples alone and first
// hits, 1 or 4 a pixel; exact targets and probabilities. With neither targets nor history it stays as it is.
FilmState paper_film_state(FilmState state, int stored_hits);

// Precondition: the film's state is such a one.
PaperFilm& paper_film(Film& film);
const PaperFilm& paper_film(const Film& film);

}  // namespace helio
