#include "tests/bench/peers/script_figures.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/bench/bench_context.h"
#include "tests/bench/peers/child_process.h"

namespace helio::bench {

Status add_script_figures(const std::string& script, const std::vector<std::string>& arguments,
                          const std::string& prefix, const std::map<std::string, ScriptFigure>& known,
                          Figures& figures) {
  const auto file = std::filesystem::path(HELIO_SOURCE_DIR) / "tests/bench/peers" / script;
  std::vector<std::string> command{"/usr/bin/python3", "-B", file.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  auto process = ChildProcess::start(command);
  if (!process) return process.error();
  for (auto line = (*process)->read_line(); line; line = (*process)->read_line()) {
    const auto told = nlohmann::json::parse(*line, nullptr, false);
    if (!told.is_object()) continue;
    if (told.contains("note")) {
      note(prefix + ": " + told["note"].get<std::string>());
      continue;
    }
    const std::string name = told["name"];
    const auto figure = known.find(name);
    if (figure == known.end()) return Error{ErrorCode::internal, "no figure is called " + name, script};
    const auto& [unit, goal, better] = figure->second;
    figures.add({prefix + "." + name, told["value"].get<double>(), unit, goal, better});
  }
  if (const int code = (*process)->wait(); code != 0)
    return Error{ErrorCode::internal, "ended with " + std::to_string(code), script};
  return ok_status();
}

}  // namespace helio::bench
