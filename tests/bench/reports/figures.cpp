#include "tests/bench/reports/figures.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace helio::bench {

namespace {

const char* to_string(Better better) {
  return better == Better::lower ? "lower" : better == Better::higher ? "higher" : "within";
}

std::string goal_text(const Figure& figure) {
  if (!figure.goal) return "-";
  if (figure.better == Better::within) return fmt::format("{:.4g} to {:.4g}", *figure.least, *figure.goal);
  return fmt::format("{} {:.4g}", figure.better == Better::lower ? "<=" : ">=", *figure.goal);
}

}  // namespace

std::string Figures::json() const {
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();
  for (const Figure& f : items_) {
    figures[f.name] = {{"value", f.value}, {"unit", f.unit}, {"goal", nullptr}, {"better", to_string(f.better)}};
    if (f.goal) figures[f.name]["goal"] = *f.goal;
    if (f.goal && f.least) figures[f.name]["least"] = *f.least;
  }
  return nlohmann::ordered_json({{"figures", figures}}).dump(2);
}

std::string Figures::table() const {
  std::size_t width = 6;
  for (const Figure& f : items_) width = std::max(width, f.name.size());
  std::string text = fmt::format("{:<{}}  {:>12}  {:<8}  {:>12}\n", "figure", width, "value", "unit", "goal");
  for (const Figure& f : items_) {
    text += fmt::format("{:<{}}  {:>12.5g}  {:<8}  {:>12}  {}\n", f.name, width, f.value, f.unit, goal_text(f),
                        !f.goal          ? ""
                        : f.meets_goal() ? "met"
                                         : "missed");
  }
  return text;
}

void note(const std::string& text) {
  std::fprintf(stderr, "helio_bench: %s\n", text.c_str());
}

}  // namespace helio::bench
