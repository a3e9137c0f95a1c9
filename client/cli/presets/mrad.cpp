// Mrad (2022): FLIP of foveated rendering with DLSS and TAA (tables 5.1 to 5.3), and its times (table 5.4).
#include <spdlog/fmt/fmt.h>

#include <tuple>

#include "client/cli/presets/preset.h"

namespace helio::cli {

namespace {

struct View {
  std::string name, start;        // start: of the camera path, JSON
  double foveated, dlss, taa;     // weighted medians of FLIP, tables 5.1 to 5.3; not a number: none is printed
  std::string table = {};         // in place of the three tables
};

// A start, and a turn of a few pictures: previews draw on those before.
std::string turn_from(const std::string& start) {
  return fmt::format(R"({{"views": [{}, {{"turn_degrees": -0.5, "repeat": 6}}]}})"
                     "\n",
                     start);
}

Experiment drag(const std::string& scene_name, const std::string& scene, SceneFile file, const std::string& segments,
                const View& view) {
  Experiment experiment;
  experiment.name = scene_name + "-" + view.name;
  experiment.scene = scene + ", " + view.name;
  experiment.files = {std::move(file)};
  // At this rate no picture waits for its turn.
  const std::string preview = "preview:preview-rate=120", published = preview + ":foveation=paper";
  experiment.modes = {"foveated=" + published + ":paper-antialiasing=off",
                      "upscaled=" + published + ":paper-antialiasing=off:preview-upscaling=on",
                      "antialiased=" + published + ":preview-upscaling=on",
                      "mended=" + published +
                          ":preview-upscaling=on:paper-mend=reject-history,fixed-disk,mean-rate,surface-motion",
                      "ours=" + preview + ":foveation=density:preview-upscaling=on:preview-budget=5",
                      "ours-without-gaze=" + preview + ":preview-budget=5"};
  experiment.samples = {1};
  experiment.measures = {"flip-median", "flip@fovea", "flicker@periphery", std::string(kFramesMeasure)};
  experiment.words = {"--max-segments", segments};
  experiment.path = turn_from(view.start);
  experiment.fovea = 0.15;
  const std::tuple<const char*, const char*, double, const char*> modes[] = {
      {"foveated", "foveated", view.foveated, "table 5.1"},
      {"foveated + DLSS", "upscaled", view.dlss, "table 5.2"},
      {"foveated + DLSS + TAA", "antialiased", view.taa, "table 5.3"}};
  for (const auto& [mode, ours, value, table] : modes) {
    experiment.published.push_back({mode, ours, 1, "flip-median", value, kUnpublished,
                                    value != value      ? "not printed"
                                    : view.table.empty() ? table
                                                         : view.table,
                                    view.name});
  }
  return experiment;
}

}  // namespace

Preset mrad_preset() {
  Preset preset;
  preset.name = "mrad";
  preset.paper = "Mrad (2022), Image Upscaling for Ray Traced Foveated Rendering";
  preset.hardware = "NVIDIA GeForce RTX 2080 Ti, 1920x1080, ground truth of 36 samples";
  preset.width = 160;
  preset.height = 90;
  preset.reference_error = "0.05";
  preset.reference_samples = "512";
  preset.notes = {
      "foveated, upscaled and antialiased are the paper's three modes (preview:foveation=paper), mended is the last "
      "with its faults mended, and ours is preview:foveation=density with upscaling, in at most 5 ms a picture. The "
      "gaze is the picture's middle. Measured is the last picture of a turn of 3 degrees after a start of one sample, "
      "its FLIP as a whole and in the region fovea (15 % of the way to a corner), and its change of error from the "
      "picture before in the region periphery; seconds are means over the turn.",
      "The paper's network (DLSS) is not published: temporal upsampling with the same inputs stands for it. The paper "
      "shades as Whitted, with three shadow rays a light, where these are paths of one sample: noise raises FLIP.",
      "The paper says that a uniformly sampled picture with temporal anti-aliasing has a weighted median of 0.03 to "
      "0.05, which it takes for the least that its modes could reach. It judged flicker by eye and printed no figure.",
      "FLIP depends on the pixels per degree, and so on the size of the picture; --size 1920x1080 gives the paper's.",
      "The paper's ray tracer follows one secondary ray (3 in the Cornell box), so that paths have 3 segments (5) "
      "here. Its views are described in words alone: ours are like them, and of the box it has one.",
  };
  const SceneFile sponza{"sponza-dabrovic.glb", "Dabrovic's Sponza, with a column in place of the plants"};
  const std::string central = R"({"position": [8, 2, 0], "target": [-8, 4, 0], "fov_degrees": 60})";
  const std::string overview = R"({"camera": "0"})";
  const std::string plant = R"({"position": [3, 2, 1.5], "target": [5.6, 1.8, 4.3], "fov_degrees": 60})";
  Experiment overview_turn = drag("sponza", "Sponza", sponza, "3", {"overview", overview, 0.187, 0.221, 0.220});
  const std::string frames(kFramesMeasure);
  for (const auto& [mode, ours, seconds] : {std::tuple("foveated", "foveated", 0.009158),
                                            {"foveated + DLSS", "upscaled", 0.005193},
                                            {"foveated + DLSS + TAA", "antialiased", 0.005190}})
    overview_turn.published.push_back(
        {mode, ours, 1, frames, 1 / seconds, seconds, "table 5.4", "overview"});
  const SceneFile box{"cornell-glass-mirror-spheres.glb", "Cornell box with tessellated spheres"};
  const std::string box_scene = "Cornell box with a reflective and a refractive sphere";
  // The paper prints 0.142 for DLSS, "an increase over the baseline by 0.009", and 0.139 for TAA.
  const std::string chapter = "chapter 5.1";
  const SceneFile temple{"sun-temple.glb"};
  preset.experiments = {
      drag("sponza", "Sponza", sponza, "3", {"central", central, 0.228, 0.263, 0.262}),
      std::move(overview_turn),
      drag("sponza", "Sponza", sponza, "3", {"plant", plant, 0.189, 0.200, 0.200}),
      drag("cornell-box", box_scene, box, "5", {"front", R"({"camera": "0"})", 0.133, 0.142, 0.139, chapter}),
      drag("cornell-box", box_scene, box, "5",
           {"side", R"({"position": [130, 330, -600], "target": [300, 220, 280], "fov_degrees": 45})", kUnpublished,
            kUnpublished, kUnpublished}),
      drag("cornell-box", box_scene, box, "5",
           {"near", R"({"position": [278, 200, -250], "target": [330, 130, 300], "fov_degrees": 45})", kUnpublished,
            kUnpublished, kUnpublished}),
      drag("sun-temple", "Sun Temple", temple, "3", {"statue", R"({"camera": "0"})", 0.239, 0.281, 0.280}),
      drag("sun-temple", "Sun Temple", temple, "3", {"chamber", R"({"camera": "0"})", 0.272, 0.304, 0.304}),
  };
  return preset;
}

}  // namespace helio::cli
