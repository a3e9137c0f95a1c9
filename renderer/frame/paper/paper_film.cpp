#include "renderer/frame/paper/paper_film.h"

#include <algorithm>

#include "renderer/base/check.h"

namespace helio {
namespace {

template <int kStoredHits, bool kProbabilities>
constexpr FilmExtensionKind kKind{PaperFilm::bytes_per_pixel(kStoredHits, kProbabilities),
                                  [](int width, int height) -> std::unique_ptr<FilmExtension> {
                                    return std::make_unique<PaperFilm>(width, height, kStoredHits, kProbabilities);
                                  }};

template <bool kProbabilities>
const FilmExtensionKind* kind_of(int stored_hits) {
  HELIO_DCHECK(stored_hits == 0 || stored_hits == 1 || stored_hits == kMostStoredHits);
  if (stored_hits == 0) return kProbabilities ? &kKind<0, kProbabilities> : nullptr;
  return stored_hits == 1 ? &kKind<1, kProbabilities> : &kKind<kMostStoredHits, kProbabilities>;
}

}  // namespace

PaperFilm::PaperFilm(int width, int height, int stored_hits, bool probabilities)
    : width_(width), probability_(probabilities ? std::size_t(width) * std::size_t(height) : 0) {
  if (stored_hits > 0) first_hits_ = std::make_unique<FirstHits>(width, height, stored_hits);
}

void PaperFilm::clear(const PixelRect& window) {
  if (first_hits_) first_hits_->clear(window);
  if (!has_probabilities()) return;
  for (int y = window.y0; y < window.y1; ++y)
    std::fill_n(probability_.begin() + std::ptrdiff_t(index(window.x0, y)), window.width(), 0.0f);
}

void PaperFilm::forget() {
  if (first_hits_) first_hits_->left().pose.reset();
}

std::size_t PaperFilm::bytes() const {
  return probability_.capacity() * sizeof(float) + (first_hits_ ? first_hits_->bytes() : 0);
}

FilmState paper_film_state(FilmState state, int stored_hits) {
  const int hits = state.history ? stored_hits : 0;
  state.exact_counts = state.targets;
  state.carried_only = state.history;
  state.extension = state.targets ? kind_of<true>(hits) : kind_of<false>(hits);
  return state;
}

PaperFilm& paper_film(Film& film) {
  HELIO_DCHECK(dynamic_cast<PaperFilm*>(film.extension()));
  return static_cast<PaperFilm&>(*film.extension());
}

const PaperFilm& paper_film(const Film& film) {
  return paper_film(const_cast<Film&>(film));
}

}  // namespace helio
