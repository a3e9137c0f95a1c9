#include "tests/bench/reports/error_report.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "renderer/comparison/power_law.h"
#include "renderer/comparison/student_t.h"

namespace helio::bench {

namespace {

using nlohmann::ordered_json;

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json to_json(const Interval& interval) {
  return {{"mean", number(interval.mean)}, {"low", number(interval.low)}, {"high", number(interval.high)}};
}

std::string csv_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : "";
}

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + "\"";
}

std::vector<double> values_of(std::span<const PictureError> seeds, double PictureError::*member) {
  std::vector<double> values;
  for (const PictureError& seed : seeds) values.push_back(seed.*member);
  return values;
}

}  // namespace

Interval mean_interval(std::span<const double> values) {
  const double n = double(values.size());
  double sum = 0, squares = 0;
  for (const double v : values) sum += v;
  const double mean = sum / n;
  for (const double v : values) squares += (v - mean) * (v - mean);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (values.size() < 2) return {mean, -kInfinity, kInfinity};
  const double half = student_t_95(int(values.size()) - 1) * std::sqrt(squares / (n - 1) / n);
  return {mean, mean - half, mean + half};
}

CurvePointReport summarise(int samples, std::span<const PictureError> seeds) {
  CurvePointReport point;
  point.samples = samples;
  point.seeds = int(seeds.size());
  point.seconds = mean_interval(values_of(seeds, &PictureError::seconds));
  point.mse = mean_interval(values_of(seeds, &PictureError::mse));
  point.relmse = mean_interval(values_of(seeds, &PictureError::relmse));
  point.dssim = mean_interval(values_of(seeds, &PictureError::dssim));
  point.distance_variance = mean_interval(values_of(seeds, &PictureError::distance_variance));
  point.dark_relmse = mean_interval(values_of(seeds, &PictureError::dark_relmse));
  point.dark_bias = mean_interval(values_of(seeds, &PictureError::dark_bias));
  const Interval bias = mean_interval(values_of(seeds, &PictureError::bias));
  point.bias = bias.mean;
  point.bias_standard_error = seeds.size() > 1 ? (bias.high - bias.mean) / student_t_95(int(seeds.size()) - 1)
                                               : std::numeric_limits<double>::infinity();
  return point;
}

double value_at(const CurveReport& curve, Interval CurvePointReport::*measure, double seconds) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  if (curve.points.size() < 2) return kNan;
  std::size_t next = 1;
  while (next + 1 < curve.points.size() && curve.points[next].seconds.mean < seconds) ++next;
  const CurvePointReport &a = curve.points[next - 1], &b = curve.points[next];
  const double value_a = (a.*measure).mean, value_b = (b.*measure).mean;
  if (!(value_a > 0 && value_b > 0 && a.seconds.mean > 0 && b.seconds.mean > a.seconds.mean && seconds > 0))
    return kNan;
  return std::exp(log_on_power_law(a.seconds.mean, value_a, b.seconds.mean, value_b, seconds));
}

std::string to_json(std::span<const CurveReport> curves) {
  ordered_json list = ordered_json::array();
  for (const CurveReport& curve : curves) {
    ordered_json points = ordered_json::array();
    for (const CurvePointReport& p : curve.points) {
      points.push_back({{"samples", p.samples},
                        {"seeds", p.seeds},
                        {"seconds", to_json(p.seconds)},
                        {"samples_per_second", number(p.samples / p.seconds.mean)},
                        {"mse", to_json(p.mse)},
                        {"relmse", to_json(p.relmse)},
                        {"dssim", to_json(p.dssim)},
                        {"distance_variance", to_json(p.distance_variance)},
                        {"dark_relmse", to_json(p.dark_relmse)},
                        {"dark_bias", to_json(p.dark_bias)},
                        {"bias", number(p.bias)},
                        {"bias_standard_error", number(p.bias_standard_error)}});
    }
    list.push_back({{"scene", curve.scene},
                    {"renderer", curve.renderer},
                    {"mode", curve.mode},
                    {"reference_mse", number(curve.reference_mse)},
                    {"points", points}});
  }
  return ordered_json({{"curves", list}}).dump(2);
}

std::string to_csv(std::span<const CurveReport> curves) {
  std::string text = "scene,renderer,mode,reference_mse,samples,seeds";
  for (const char* name : {"seconds", "mse", "relmse", "dssim", "distance_variance", "dark_relmse", "dark_bias"}) {
    text += fmt::format(",{0},{0}_low,{0}_high", name);
  }
  text += ",bias,bias_standard_error\n";
  for (const CurveReport& curve : curves) {
    for (const CurvePointReport& p : curve.points) {
      text += fmt::format("{},{},{},{},{},{}", csv_text(curve.scene), csv_text(curve.renderer), csv_text(curve.mode),
                          csv_number(curve.reference_mse), p.samples, p.seeds);
      for (const Interval* i :
           {&p.seconds, &p.mse, &p.relmse, &p.dssim, &p.distance_variance, &p.dark_relmse, &p.dark_bias}) {
        text += fmt::format(",{},{},{}", csv_number(i->mean), csv_number(i->low), csv_number(i->high));
      }
      text += fmt::format(",{},{}\n", csv_number(p.bias), csv_number(p.bias_standard_error));
    }
  }
  return text;
}

std::string to_table(std::span<const CurveReport> curves) {
  std::string text;
  for (const CurveReport& curve : curves) {
    text += fmt::format("{}, {} {}", curve.scene, curve.renderer, curve.mode);
    if (curve.reference_mse > 0)
      text += fmt::format(" (the reference's noise adds {:.3g} to mse)", curve.reference_mse);
    text += fmt::format("\n{:>8} {:>6} {:>11} {:>11} {:>11} {:>11} {:>23} {:>11} {:>22}\n", "samples", "seeds",
                        "seconds", "samples/s", "mse", "relmse", "95 % of relmse", "dssim", "bias +- its error");
    for (const CurvePointReport& p : curve.points) {
      text += fmt::format(
          "{:>8} {:>6} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g} "
          "{:>+11.3g} {:>10.2g}\n",
          p.samples, p.seeds, p.seconds.mean, p.samples / p.seconds.mean, p.mse.mean, p.relmse.mean, p.relmse.low,
          p.relmse.high, p.dssim.mean, p.bias, p.bias_standard_error);
    }
    text += "\n";
  }
  return text;
}

}  // namespace helio::bench
