// Mrad (2022): FLIP of foveated rendering with DLSS and TAA (tables 5.1 to 5.3), and its times (table 5.4).
#include <tuple>

#include "client/cli/presets/preset.h"

namespace helio::cli {

namespace {

struct View {
  const char* name;
  double foveated, dlss, taa;  // weighted medians of FLIP, tables 5.1 to 5.3
};

Experiment still(std::string name, std::string scene, std::string file, std::string stand_in, std::string segments) {
  Experiment experiment;
  experiment.name = std::move(name);
  experiment.scene = std::move(scene);
  experiment.files = {{std::move(file), std::move(stand_in)}};
  experiment.modes = {"pt=pt", "display=display"};
  experiment.samples = {1, 36};
  experiment.measures = {"flip-median", "flip"};
  experiment.words = {"--max-segments", std::move(segments)};
  return experiment;
}

void add_view(Experiment& experiment, const View& view, const std::string& where) {
  const std::tuple<const char*, double, const char*> modes[] = {{"foveated", view.foveated, "table 5.1"},
                                                                {"foveated + DLSS", view.dlss, "table 5.2"},
                                                                {"foveated + DLSS + TAA", view.taa, "table 5.3"}};
  for (const auto& [mode, value, table] : modes) {
    experiment.published.push_back(
        {mode, "", 1, "flip-median", value, kUnpublished, where.empty() ? table : where, view.name});
  }
}

}  // namespace

Preset mrad_preset() {
  Preset preset;
  preset.name = "mrad";
  preset.paper = "Mrad (2022), Image Upscaling for Ray Traced Foveated Rendering";
  preset.hardware = "NVIDIA GeForce RTX 2080 Ti, 1920x1080, ground truth of 36 samples";
  preset.width = 160;
  preset.height = 90;
  preset.reference_error = "0.03";
  preset.reference_samples = "1024";
  preset.notes = {
      "Foveated rendering, upscaling as by DLSS and temporal anti-aliasing do not exist in Heliograph: their rows are "
      "the paper's alone. Measured are pt and the layer display at the paper's sample counts, one for its modes and "
      "36 for its ground truth.",
      "The paper says that a uniformly sampled picture with temporal anti-aliasing has a weighted median of 0.03 to "
      "0.05, which it takes for the least that its modes could reach.",
      "FLIP depends on the pixels per degree, and so on the size of the picture; --size 1920x1080 gives the paper's.",
      "The paper's ray tracer follows one secondary ray (3 in the Cornell box), so that paths have 3 segments (5) "
      "here. Its views are described in words alone: the file's first camera stands for each of them. The rows of the "
      "paper are relative to its foveated mode, ours to pt.",
  };
  Experiment sponza = still("sponza", "Sponza", "sponza-dabrovic.glb", "Dabrovic's Sponza, one camera", "3");
  for (const View& view : {View{"central", 0.228, 0.263, 0.262}, View{"overview", 0.187, 0.221, 0.220},
                           View{"plant", 0.189, 0.200, 0.200}})
    add_view(sponza, view, "");
  const std::string seconds(kSecondsMeasure);
  sponza.published.push_back({"foveated", "", 1, seconds, 0.009158, kUnpublished, "table 5.4", "overview"});
  sponza.published.push_back({"foveated + DLSS", "", 1, seconds, 0.005193, kUnpublished, "table 5.4", "overview"});
  sponza.published.push_back(
      {"foveated + DLSS + TAA", "", 1, seconds, 0.005190, kUnpublished, "table 5.4", "overview"});
  Experiment box = still("cornell-box", "Cornell box with a reflective and a refractive sphere",
                         "cornell-glass-mirror-spheres.glb", "Cornell box with tessellated spheres", "5");
  // The paper prints 0.142 for DLSS, "an increase over the baseline by 0.009", and 0.139 for TAA.
  add_view(box, {"", 0.133, 0.142, 0.139}, "chapter 5.1");
  Experiment temple = still("sun-temple", "Sun Temple", "sun-temple.glb", "", "3");
  for (const View& view : {View{"statue", 0.239, 0.281, 0.280}, View{"chamber", 0.272, 0.304, 0.304}})
    add_view(temple, view, "");
  preset.experiments = {sponza, box, temple};
  return preset;
}

}  // namespace helio::cli
