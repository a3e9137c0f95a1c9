// What a person at the viewer waits for: peers/viewer_bench.py in a browser on this machine.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/bench/peers/child_process.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace fs = std::filesystem;

struct ViewerFigure {
  const char* unit;
  std::optional<double> goal;
  Better better = Better::lower;
};

// Figures without a goal say what the others cost.
const std::map<std::string, ViewerFigure> kFigures = {
    {"view.url_s", {"s", 0.7}},
    {"page.bytes", {"bytes", 150e3}},
    {"page.first_whole_s", {"s", 1}},
    {"input_to_pixel.default.p50_ms", {"ms", 100}},
    {"input_to_pixel.default.p95_ms", {"ms", std::nullopt}},
    {"input_to_pixel.15ms.p50_ms", {"ms", 65}},
    {"input_to_pixel.15ms.p95_ms", {"ms", std::nullopt}},
    {"drag.pictures_per_s", {"1/s", 10, Better::higher}},
    {"drag.megabytes_per_s", {"MB/s", std::nullopt, Better::higher}},
    {"drag.http_thread_share", {"", std::nullopt}},
    {"drag.http_thread_share_at_20", {"", 0.15}},
    {"drag.daemon_cores", {"", std::nullopt}},
    {"drag.browser_cores", {"", std::nullopt}},
};

}  // namespace

Status run_viewer(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  const fs::path source(HELIO_SOURCE_DIR);
  const std::string heliograph = (fs::path(options.daemon).parent_path() / "heliograph").string();
  // The distribution's Python, for which python3-selenium is made.
  auto script = ChildProcess::start({"/usr/bin/python3", "-B", (source / "tests/bench/peers/viewer_bench.py").string(),
                                     (source / "tests/browser").string(), heliograph, options.daemon,
                                     context.cornell().string()});
  if (!script) return script.error();
  for (auto line = (*script)->read_line(); line; line = (*script)->read_line()) {
    const auto told = nlohmann::json::parse(*line, nullptr, false);
    if (!told.is_object()) continue;
    if (told.contains("note")) {
      note("viewer: " + told["note"].get<std::string>());
      continue;
    }
    const std::string name = told["name"];
    const auto figure = kFigures.find(name);
    if (figure == kFigures.end()) return Error{ErrorCode::internal, "no figure is called " + name, "viewer_bench.py"};
    const auto& [unit, goal, better] = figure->second;
    figures.add({"viewer." + name, told["value"].get<double>(), unit, goal, better});
  }
  if (const int code = (*script)->wait(); code != 0)
    return Error{ErrorCode::internal, "ended with " + std::to_string(code), "viewer_bench.py"};
  return ok_status();
}

}  // namespace helio::bench
