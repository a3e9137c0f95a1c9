// Figures that a Python script measures and tells line by line.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "tests/bench/reports/figures.h"

namespace helio::bench {

struct ScriptFigure {
  const char* unit;
  std::optional<double> goal;  // absent: it says what the others cost
  Better better = Better::lower;
};

// Runs a script of tests/bench/peers by the distribution's Python, which has the modules that install-deps.sh installs.
// On its stdout is one JSON object a line: {"name", "value"} of a figure, which is added as PREFIX.NAME, or {"note"}
// with the reason why one is missing. internal: a name that is not among `known`, or another exit code than 0.
Status add_script_figures(const std::string& script, const std::vector<std::string>& arguments,
                          const std::string& prefix, const std::map<std::string, ScriptFigure>& known,
                          Figures& figures);

}  // namespace helio::bench
