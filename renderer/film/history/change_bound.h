// How far a picture may have changed, from differences that were measured at few of its places.
//
// A cell is a square of pixels with two independent samples, A and B, of the change of its mean: d_A, d_B, each noisy.
// Over a neighbourhood of n cells the mean P of d_A d_B has the mean square of the change as its expectation, whatever
// the noise and wherever the change has which sign; m, the mean of their squares, has the noise in it as well. With
// s^2 = m - P the deviation of P by chance is sqrt((s^4 + 2 P s^2) / n).
//
//   - Over 7x7 cells the change's square is taken to be P and one deviation. m is never taken to be zero because few
//     samples saw nothing: a quarter as many samples again are counted that are as the mean over some 20x20 cells, and
//     among those one more that has changed by its whole radiance with the probability that samples of the whole
//     picture have changed at all; there, too, one more than was seen.
//   - Where the cell itself, or 3x3 around it, tell of more by two deviations, that is what counts: an edge of a shadow
//     that the larger neighbourhood would blur.
//   - What has changed by more than a quarter of what samples there show has no bound: of the old picture a few samples
//     would be left to count, whose errors all have one sign.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/core/film.h"

namespace helio {

class ChangeBound {
 public:
  ChangeBound(int columns, int rows);

  // Of a cell, the radiance of both samples before and after; once. Thread safe for different cells. What is not set,
  // and what is not finite, is not known.
  void set(int x, int y, const Rgb (&before)[kHalves], const Rgb (&after)[kHalves]);
  // After all of them.
  void finish();

  // Bound on the square of the change, mean over the channels, radiance^2; +inf: beyond use, or
  // nothing around is known.
  double squared(int x, int y) const;
  // Of the picture's samples, those that have changed, one more among them; (0, 1].
  double changed_share() const { return changed_share_; }

 private:
  struct Cell {
    float product = 0, squares = 0;  // d_A d_B | mean of their squares
    float power = 0;                 // mean square of the radiance
    std::uint8_t known = 0;
    std::uint8_t changed = 0;  // samples
  };
  struct Sums {
    double product = 0, squares = 0, power = 0, n = 0;
    void add(const Cell& cell);
    void add(const Sums& sums);
  };
  Sums sum_around(int x, int y, int radius) const;
  Sums sum_far_around(int x, int y) const;

  int columns_, rows_, bin_columns_, bin_rows_;
  std::vector<Cell> cells_;
  std::vector<Sums> bins_;  // of squares of cells
  double changed_share_ = 1, mean_power_ = 0;
};

}  // namespace helio
