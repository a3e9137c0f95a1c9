#include "tests/bench/peers/mitsuba_peer.h"

#include <nlohmann/json.hpp>

#include "tests/bench/scenes/error_scenes.h"

namespace helio::bench {

using nlohmann::json;

Result<std::unique_ptr<MitsubaPeer>> MitsubaPeer::start(const std::string& python, int threads) {
  if (python.empty()) {
    return Error{ErrorCode::failed_precondition,
                 "no Mitsuba: give --mitsuba-python or HELIO_MITSUBA_PYTHON; figures over Mitsuba are left out",
                 {}};
  }
  auto probe = ChildProcess::start({python, "-c", "import drjit, mitsuba, numpy"});
  if (!probe || (*probe)->wait() != 0) {
    return Error{ErrorCode::failed_precondition,
                 "no Mitsuba: " + python + " cannot import mitsuba and numpy; figures over Mitsuba are left out",
                 {}};
  }
  auto process = ChildProcess::start({python, HELIO_BENCH_FOLDER "/peers/mitsuba_bench.py", std::to_string(threads)});
  if (!process) return process.error();
  return std::unique_ptr<MitsubaPeer>(new MitsubaPeer(PeerProcess("Mitsuba", std::move(process).value())));
}

Status MitsubaPeer::load(const std::string& scene, const std::string& xml) {
  const auto answer = process_.ask({{"do", "load"}, {"scene", scene}, {"file", xml}});
  if (!answer) return answer.error();
  version_ = answer->value("version", "?") + " " + answer->value("variant", "?");
  return ok_status();
}

Result<double> MitsubaPeer::render_seconds(const std::string& scene, int samples, int seed) {
  const auto answer = process_.ask({{"do", "time"}, {"scene", scene}, {"samples", samples}, {"seed", seed}});
  if (!answer) return answer.error();
  return answer->at("seconds").get<double>();
}

Status MitsubaPeer::resize(const std::string& scene, int width, int height) {
  const auto answer = process_.ask({{"do", "resize"}, {"scene", scene}, {"width", width}, {"height", height}});
  if (!answer) return answer.error();
  return ok_status();
}

Result<LoopPicture> MitsubaPeer::render_picture(const std::string& scene, int samples, int seed,
                                                const std::string& file) {
  const auto answer =
      process_.ask({{"do", "picture"}, {"scene", scene}, {"samples", samples}, {"seed", seed}, {"file", file}});
  if (!answer) return answer.error();
  auto picture = read_picture(file);
  if (picture) picture->seconds = answer->at("seconds").get<double>();
  return picture;
}

Result<std::vector<CurvePoint>> MitsubaPeer::error_curve(const std::string& scene, int step, int seed, double target,
                                                         int limit, const std::string& reference) {
  const auto answer = process_.ask({{"do", "curve"},
                                    {"scene", scene},
                                    {"step", step},
                                    {"seed", seed},
                                    {"target", target},
                                    {"limit", limit},
                                    {"reference", reference}});
  if (!answer) return answer.error();
  std::vector<CurvePoint> points;
  for (const json& point : answer->at("points")) {
    points.push_back({point[0].get<int>(), point[1].get<double>(), point[2].get<double>()});
  }
  return points;
}

Result<PeerRayCount> MitsubaPeer::count_rays(const std::string& scene, int samples, int seed, int max_depth,
                                             int roulette_depth) {
  constexpr double kSamePicture = 1e-5;  // sums of floats in another order are apart by 1e-7
  const auto answer = process_.ask({{"do", "rays"},
                                    {"scene", scene},
                                    {"samples", samples},
                                    {"seed", seed},
                                    {"max_depth", max_depth},
                                    {"rr_depth", roulette_depth}});
  if (!answer) return answer.error();
  if (const double difference = answer->at("difference").get<double>(); !(difference <= kSamePicture)) {
    return Error{ErrorCode::internal,
                 "the integrator that counts rays makes another picture, off by " + std::to_string(difference),
                 scene};
  }
  return PeerRayCount{answer->at("segments").get<double>(), answer->at("shadow_rays").get<double>(),
                      answer->at("useful_shadow_rays").get<double>()};
}

}  // namespace helio::bench
