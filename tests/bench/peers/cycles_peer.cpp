#include "tests/bench/peers/cycles_peer.h"

#include <nlohmann/json.hpp>

namespace helio::bench {

Result<std::unique_ptr<CyclesPeer>> CyclesPeer::start(const std::string& blender, int threads) {
  auto probe = ChildProcess::start({blender, "--version"});
  if (!probe || (*probe)->wait() != 0) {
    return Error{
        ErrorCode::failed_precondition,
        "no Cycles: '" + blender + " --version' failed (--blender, HELIO_BLENDER); figures over Cycles are left out",
        {}};
  }
  auto process =
      ChildProcess::start({blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                           HELIO_BENCH_FOLDER "/peers/cycles_bench.py", "--", std::to_string(threads)});
  if (!process) return process.error();
  return std::unique_ptr<CyclesPeer>(new CyclesPeer(PeerProcess("Cycles", std::move(process).value())));
}

Result<std::unique_ptr<CyclesPeer>> CyclesPeer::start_module(const std::string& python, int threads) {
  if (python.empty()) {
    return Error{ErrorCode::failed_precondition,
                 "no Cycles: give --bpy-python or HELIO_BPY_PYTHON; figures over Cycles are left out",
                 {}};
  }
  auto probe = ChildProcess::start({python, "-c", "import bpy, numpy"});
  if (!probe || (*probe)->wait() != 0) {
    return Error{ErrorCode::failed_precondition,
                 "no Cycles: " + python + " cannot import bpy; figures over Cycles are left out",
                 {}};
  }
  auto process = ChildProcess::start({python, HELIO_BENCH_FOLDER "/peers/cycles_bench.py", std::to_string(threads)});
  if (!process) return process.error();
  return std::unique_ptr<CyclesPeer>(new CyclesPeer(PeerProcess("Cycles", std::move(process).value())));
}

Status CyclesPeer::load(const std::string& gltf) {
  const auto answer = process_.ask({{"do", "load"}, {"file", gltf}});
  if (!answer) return answer.error();
  version_ = answer->value("version", "?");
  return ok_status();
}

Status CyclesPeer::import_glb(const std::string& glb, int width, int height) {
  const auto answer = process_.ask({{"do", "import"}, {"file", glb}, {"width", width}, {"height", height}});
  if (!answer) return answer.error();
  version_ = answer->value("version", "?");
  return ok_status();
}

Result<double> CyclesPeer::render_seconds(int samples, int seed, const std::string& output) {
  const auto answer = process_.ask({{"do", "render"}, {"samples", samples}, {"seed", seed}, {"output", output}});
  if (!answer) return answer.error();
  return answer->at("seconds").get<double>();
}

}  // namespace helio::bench
