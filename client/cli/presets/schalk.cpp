// Schalk (2018): adaptive sampling (chapter 4.2), reprojection along turns (4.3), and both (4.4).
#include <spdlog/fmt/fmt.h>

#include <utility>

#include "client/cli/presets/preset.h"

namespace helio::cli {

namespace {

constexpr int kTurn = 100;  // degrees, chapter 4.3
constexpr const char* kBaseline = "pt=pt";
const std::vector<std::string> kMeasures = {"distance-variance", "mse", "relmse"};

std::string adaptive_mode(int least, int most) {
  return fmt::format("adaptive-{0}-{1}=paper-adaptive:adaptive-min={0}:adaptive-max={1}", least, most);
}

// Table 1.
std::vector<std::string> table_1_modes() {
  std::vector<std::string> modes{kBaseline};
  for (const auto& [least, most] : {std::pair(2, 16), {4, 16}, {8, 16}, {2, 32}, {4, 32}, {8, 32}, {16, 32}})
    modes.push_back(adaptive_mode(least, most));
  return modes;
}

// The scene of an experiment, and the paper's finding.
struct Subject {
  std::string name, scene;
  std::vector<SceneFile> files;
  std::string graph, finding;
};

Experiment experiment_of(Subject subject) {
  Experiment experiment;
  experiment.name = std::move(subject.name);
  experiment.scene = std::move(subject.scene);
  experiment.files = std::move(subject.files);
  experiment.graph = std::move(subject.graph);
  experiment.finding = std::move(subject.finding);
  experiment.measures = kMeasures;
  return experiment;
}

Experiment still(Subject subject) {
  Experiment experiment = experiment_of(std::move(subject));
  experiment.modes = table_1_modes();
  experiment.samples = {4, 16, 32};
  return experiment;
}

Experiment property(Subject subject) {
  Experiment experiment = still(std::move(subject));
  experiment.modes = {kBaseline, adaptive_mode(2, 32), adaptive_mode(4, 32)};  // chapter 4.2.4
  return experiment;
}

std::string turn_path(int step) {
  return fmt::format(R"({{"views": [{{"turn_degrees": {}}}, {{"turn_degrees": -{}, "repeat": {}}}]}})"
                     "\n",
                     kTurn, step, kTurn / step);
}

// Seconds of a frame of one sample per pixel, plain and with one stored hit.
struct FrameTimes {
  double plain, reprojected, shorter;  // the share by which a plain frame is shorter than one with four stored hits
  double plain_4, reprojected_4;       // after four samples, with four stored hits
};

Experiment turn(Subject subject, int step, const std::string& chapter, const std::string& figure,
                const FrameTimes& times) {
  Experiment experiment = experiment_of(std::move(subject));
  experiment.modes = {kBaseline,
                      "reproject-1=paper-reproject:stored-hits=1",
                      "reproject-4=paper-reproject:stored-hits=4",
                      "combined-2-32-1=paper-combined:adaptive-min=2:adaptive-max=32:stored-hits=1",
                      "combined-4-32-1=paper-combined:adaptive-min=4:adaptive-max=32:stored-hits=1",
                      "combined-4-32-4=paper-combined:adaptive-min=4:adaptive-max=32:stored-hits=4"};
  experiment.samples = {1, 4, 32};
  experiment.path = turn_path(step);
  const std::string measure(kSecondsMeasure);
  experiment.published = {
      {"default path tracer", "pt", 1, measure, times.plain, kUnpublished, chapter},
      {"reprojection, one hit", "reproject-1", 1, measure, times.reprojected, kUnpublished, chapter},
      // The paper prints the overhead of four hits as a share alone.
      {"reprojection, four hits", "reproject-4", 1, measure, times.plain / (1 - times.shorter), kUnpublished, chapter},
      {"default path tracer", "pt", 4, measure, times.plain_4, kUnpublished, figure},
      {"reprojection, four hits", "reproject-4", 4, measure, times.reprojected_4, kUnpublished, figure},
  };
  return experiment;
}

}  // namespace

Preset schalk_preset() {
  Preset preset;
  preset.name = "schalk";
  preset.paper = "Schalk (2018), Combining Reprojection and Adaptive Sampling for Real-Time Path Tracing on the GPU";
  preset.hardware = "NVIDIA GeForce GTX 1070, 1280x720, references of 4,096 samples";
  preset.width = 64;
  preset.height = 36;
  preset.reference_error = "0.03";
  preset.reference_samples = "512";
  preset.notes = {
      "The paper draws its errors as graphs over time and prints no figures of them; its findings stand above each "
      "table, and our errors relative to plain path tracing are what to hold against them. They are at equal samples, "
      "with the ratio of times beside them; the report of each comparison has them at equal time.",
      "Along a turn the paper renders 32 or 64 samples at each step and then measures the last view while samples "
      "come; here every view has the same budget, and the errors are those of the last view: the row of 32 samples "
      "is the paper's point of 32 samples after steps of 32. Seconds are means over all views.",
      "The paper prints how much shorter a plain frame is than one with four reprojected samples (25 % in the Cornell "
      "box); the seconds of that frame are computed from it.",
      "Heliograph's paper-adaptive, paper-reproject and paper-combined follow the published method; its own modes of "
      "the same names differ from it and are not in this table.",
  };

  // Boxes that scenes/generate writes come first: those boxes are closed behind the camera, which sees something after
  // a turn.
  const std::vector<SceneFile> box = {
      {"box-area.glb", "Cornell box of scenes/generate, closed behind the camera, 34 triangles"},
      {"cornell-glossy-boxes.glb", "Cornell box with two glossy boxes, 38 triangles"}};
  const std::vector<SceneFile> sponza = {{"sponza-dabrovic.glb", "Dabrovic's Sponza, 66,445 triangles"}};
  const std::vector<SceneFile> san_miguel = {
      {"san-miguel.glb"},
      {"courtyard.glb", "courtyard of scenes/generate with trees, 10,401,010 triangles, a sun alone"}};
  const std::string not_effective = "Adaptive sampling is not effective; 4/32 is better than 2/32 (4.2.4).";
  const std::string box_turns =
      "Every step size gives a lower error than plain path tracing, most of all four hits within the first 100 ms; "
      "after about 1.5 s they are equal (4.3.1). Combined with a minimum of 2 the path tracer catches up at 200 ms "
      "(4.4.1).";
  const FrameTimes box_times{0.00930, 0.01253, 0.25, 0.039, 0.052};
  Experiment box_steps = turn(
      {"cornell-box-turn-5", "Cornell box, turn of 100 degrees in steps of 5", box, "figures 20, 32 and 33", box_turns},
      5, "chapter 4.3.1", "figure 21", box_times);
  box_steps.samples = {1, 32};

  preset.experiments = {
      still({"cornell-box", "Cornell box, 34 triangles", box, "figure 10",
             "Adaptive sampling is better than plain path tracing at first; 4/32 is the most stable (4.2.1)."}),
      still({"sponza", "Sponza, 262,267 triangles", sponza, "figure 13",
             "Adaptive sampling is better at first; 2/32 is the best setting (4.2.2)."}),
      still({"san-miguel", "San Miguel, 9,980,693 triangles", san_miguel, "figure 15",
             "No setting is better than plain path tracing (4.2.3)."}),
      property({"triangles-69k",
                "Cornell box with 69,461 triangles",
                {{"box-69k.glb", "Cornell box of scenes/generate with a model, 69,446 triangles"},
                 {"cornell-bunny.glb", "Cornell box with a bunny, 69,465 triangles"}},
                "appendix A.1.1",
                ""}),
      property(
          {"triangles-1m",
           "Cornell box with 1,087,726 triangles",
           {{"cornell-buddha.glb"}, {"box-1m.glb", "Cornell box of scenes/generate with a model, 1,087,862 triangles"}},
           "appendix A.1.1",
           ""}),
      property(
          {"directional-light",
           "Cornell box, directional light",
           {{"cornell-directional.glb"}, {"box-directional.glb", "box of scenes/generate under a directional light"}},
           "figure 17",
           not_effective}),
      property({"point-light",
                "Cornell box, point light",
                {{"cornell-point.glb"}, {"box-point.glb", "Cornell box of scenes/generate with a point light"}},
                "appendix A.1.1",
                ""}),
      property({"reflective",
                "Cornell box, highly reflective materials",
                {{"cornell-low-roughness.glb"},
                 {"box-low-roughness.glb",
                  "Cornell box of scenes/generate, walls of roughness (alpha) 0.05, blocks of 0.02"}},
                "figure 18",
                not_effective}),
      property({"glass",
                "Cornell box, glass",
                {{"box-glass.glb", "Cornell box of scenes/generate with glass blocks"},
                 {"cornell-glass-mirror-spheres.glb", "Cornell box with a glass and a mirror sphere"}},
                "appendix A.1.1",
                ""}),
      turn({"cornell-box-turn-20", "Cornell box, turn of 100 degrees in steps of 20", box,
            "figures 32 and 33, appendix B.1", box_turns},
           20, "chapter 4.3.1", "figure 21", box_times),
      turn({"sponza-turn-20", "Sponza, turn of 100 degrees in steps of 20", sponza, "figures 35 and 36, appendix B.2",
            "As in the Cornell box, but reprojection stays ahead for longer than 1.5 s (4.3.2); combined, a minimum of "
            "4 is better than 2, and four hits are better than one (4.4.2)."},
           20, "chapter 4.3.2", "figure 25", {0.02599, 0.03164, 0.17, 0.106, 0.125}),
      box_steps,
      turn({"san-miguel-turn-5", "San Miguel, turn of 100 degrees in steps of 5", san_miguel, "figures 27, 38 and 39",
            "Reprojection is better than plain path tracing; 32 or 64 samples a step make no difference (4.3.3)."},
           5, "chapter 4.3.3", "figure 28", {0.03635, 0.04301, 0.18, 0.145, 0.170}),
  };
  return preset;
}

}  // namespace helio::cli
