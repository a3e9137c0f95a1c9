// Curves of error against time and samples, over seeds: what `helio_bench peers` reports.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace helio::bench {

// One picture of one seed, compared with its scene's reference (renderer/metrics).
struct PictureError {
  double seconds = 0;  // wall time of the picture
  double mse = 0, relmse = 0, dssim = 0;
  double bias = 0;                        // mean(x - r) / mean(r)
  double distance_variance = 0;           // variance over the picture of |x - r| (Schalk 2018, chapter 4)
  double dark_relmse = 0, dark_bias = 0;  // of the dark half (dark_half.h); NaN where it has none
};

// A mean over seeds with its confidence interval of 95 % (Student's t). One seed: the interval is the whole line.
struct Interval {
  double mean = 0, low = 0, high = 0;
};

struct CurvePointReport {
  int samples = 0;  // per pixel
  int seeds = 0;
  Interval seconds, mse, relmse, dssim, distance_variance, dark_relmse, dark_bias;
  double bias = 0, bias_standard_error = 0;  // over seeds; infinity for one seed
};

struct CurveReport {
  std::string scene;
  std::string renderer;      // "heliograph" or a peer with its version
  std::string mode;          // of our renderer: "pt", ...; of a peer: the name of its integrator
  double reference_mse = 0;  // what noise of the reference adds to mse, on average; 0: not known
  std::vector<CurvePointReport> points;
};

// Precondition: not empty.
Interval mean_interval(std::span<const double> values);

// Precondition: not empty.
CurvePointReport summarise(int samples, std::span<const PictureError> seeds);

// What a measure of `curve` comes to at `seconds`: between its two neighbouring points, or beyond the outermost two, as
// a power of time. NaN unless it has two points and the values used are positive.
double value_at(const CurveReport& curve, Interval CurvePointReport::*measure, double seconds);

// {"curves": [{scene, renderer, mode, reference_mse, points: [{samples, seeds, seconds: {mean, low, high},
// samples_per_second, ...}]}]}; what is not finite is null.
std::string to_json(std::span<const CurveReport> curves);
// One line a point, with a header; what is not finite is an empty field. Quoted as RFC 4180 wants it.
std::string to_csv(std::span<const CurveReport> curves);
std::string to_table(std::span<const CurveReport> curves);

}  // namespace helio::bench
