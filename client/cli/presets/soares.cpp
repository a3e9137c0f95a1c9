// Soares (2020): path tracing, bidirectional path tracing and a learned denoiser; tables 4.1, 4.3 and B.1 to B.3.
#include <algorithm>
#include <span>

#include "client/cli/presets/preset.h"

namespace helio::cli {

namespace {

constexpr std::uint32_t kMostSamples = 64;  // of the paper's counts that are rendered unless --samples gives others

struct Row {
  std::uint32_t samples;
  double seconds, dssim, denoised;
};

constexpr Row kTeapotPt[] = {{1, 0.005, 0.39787133, 0.05277607},     {8, 0.039, 0.26160547, 0.02572754},
                             {16, 0.078, 0.23111120, 0.01830349},    {64, 0.315, 0.15784105, 0.00733049},
                             {256, 1.248, 0.07981995, 0.00335810},   {1024, 5.019, 0.03635421, 0.00210892},
                             {4096, 20.165, 0.01291957, 0.00147753}, {16384, 96.396, 0.00424378, 0.00114861}};
constexpr Row kTeapotBdpt[] = {{1, 0.021, 0.51703851, 0.06156353},    {2, 0.039, 0.51923883, 0.06253241},
                               {4, 0.078, 0.39809779, 0.06832022},    {15, 0.315, 0.25522760, 0.06919949},
                               {60, 1.248, 0.16639614, 0.06581431},   {238, 5.019, 0.11592539, 0.06380560},
                               {954, 20.165, 0.08846302, 0.06315037}, {4610, 96.396, 0.07062779, 0.06270523}};
constexpr Row kDragonPt[] = {{1, 0.009, 0.67127678, 0.24979752},     {8, 0.076, 0.53247813, 0.14160439},
                             {16, 0.151, 0.49367307, 0.10571623},    {64, 0.604, 0.41864464, 0.05444154},
                             {256, 2.420, 0.31710149, 0.02478038},   {1024, 9.459, 0.20818218, 0.01338085},
                             {4096, 38.492, 0.10746079, 0.00801028}, {16384, 154.397, 0.04065980, 0.00525720}};
constexpr Row kDragonBdpt[] = {{1, 0.024, 0.70049155, 0.23078512},     {4, 0.076, 0.60348738, 0.15192630},
                               {7, 0.151, 0.53577495, 0.10813048},     {25, 0.604, 0.38973450, 0.06516590},
                               {49, 2.420, 0.24681416, 0.04564624},    {405, 9.459, 0.15275928, 0.03949232},
                               {1562, 38.492, 0.08936442, 0.03638964}, {6299, 154.397, 0.05268307, 0.03479745}};
constexpr Row kBreakfastPt[] = {{1, 0.006, 2.33128486, 0.55346293},     {8, 0.049, 3.49258348, 0.33203885},
                                {16, 0.1, 3.04279178, 0.22883567},      {64, 0.4, 1.88681548, 0.10495783},
                                {256, 1.606, 1.15137247, 0.04917518},   {1024, 6.393, 0.65067683, 0.02310055},
                                {4096, 25.504, 0.32394587, 0.00891766}, {16384, 102.059, 0.13719233, 0.00383266}};
constexpr Row kBreakfastBdpt[] = {{1, 0.018, 2.28904392, 0.55360024},     {3, 0.049, 2.80307390, 0.49734572},
                                  {6, 0.1, 3.19377557, 0.37768401},       {23, 0.4, 2.36387127, 0.19685868},
                                  {89, 1.606, 1.37773956, 0.11487482},    {347, 6.393, 0.72884005, 0.07396845},
                                  {1405, 25.504, 0.36259777, 0.05088362}, {5633, 102.059, 0.15782825, 0.03924146}};
constexpr Row kClassroomPt[] = {{1, 0.02, 3.06367398, 0.65222797},      {8, 0.161, 1.26624604, 0.28258904},
                                {16, 0.343, 0.96657428, 0.16146306},    {64, 1.292, 0.64997775, 0.05030262},
                                {256, 5.196, 0.38104223, 0.02352854},   {1024, 20.773, 0.20920310, 0.01472628},
                                {4096, 83.245, 0.08585196, 0.00990925}, {16384, 331.638, 0.02705733, 0.00731504}};
constexpr Row kClassroomBdpt[] = {{1, 0.048, 2.62315406, 0.71196505},     {4, 0.161, 1.67064845, 0.49393342},
                                  {7, 0.343, 1.32711299, 0.32785179},     {25, 1.292, 0.96057530, 0.15214008},
                                  {49, 5.196, 0.61820777, 0.09179273},    {405, 20.773, 0.37519143, 0.07441921},
                                  {1562, 83.245, 0.22043505, 0.06788891}, {6299, 331.638, 0.12450785, 0.06423006}};

struct Rates {
  double hd, full_hd;  // frames per second at 1280x720 and 1920x1080, table 4.1
};

void add_rows(Experiment& experiment, std::span<const Row> rows, const std::string& mode, const std::string& our_mode,
              const std::string& table) {
  for (const Row& row : rows)
    experiment.published.push_back({mode, our_mode, row.samples, "dssim", row.dssim, row.seconds, table});
  for (const Row& row : rows) {
    if (row.samples > kMostSamples) continue;
    experiment.published.push_back(
        {mode + " + OptiX denoiser", "", row.samples, "dssim", row.denoised, kUnpublished, table});
  }
}

void add_rates(Experiment& experiment, const Rates& rates, const std::string& mode, const std::string& our_mode) {
  const std::string measure(kFramesMeasure);
  experiment.published.push_back({mode, our_mode, 1, measure, rates.hd, kUnpublished, "table 4.1", "1280x720"});
  experiment.published.push_back({mode, our_mode, 1, measure, rates.full_hd, kUnpublished, "table 4.1", "1920x1080"});
}

struct Scene {
  std::string name, scene, file, stand_in, table;
  std::span<const Row> pt, bdpt;
  Rates pt_rates, bdpt_rates;
};

Experiment experiment_of(const Scene& scene) {
  Experiment experiment;
  experiment.name = scene.name;
  experiment.scene = scene.scene;
  experiment.files = {{scene.file, scene.stand_in}};
  experiment.modes = {"pt=pt", "bdpt=bdpt", "pt+bdpt=pt+bdpt"};
  experiment.measures = {"dssim", "relmse"};
  experiment.also = {"mse", "bias", "distance-variance"};
  // The light of Covered Dragon is out of a path tracer's reach, so that its reference would be noisy.
  experiment.words = {"--max-segments", "32", "--reference-integrator", "pt+bdpt"};
  add_rows(experiment, scene.pt, "PT", "pt", scene.table);
  add_rows(experiment, scene.bdpt, "BDPT", "bdpt", scene.table);
  add_rates(experiment, scene.pt_rates, "PT", "pt");
  add_rates(experiment, scene.bdpt_rates, "BDPT", "bdpt");
  for (const std::span<const Row> rows : {scene.pt, scene.bdpt})
    for (const Row& row : rows)
      if (row.samples <= kMostSamples) experiment.samples.push_back(row.samples);
  std::sort(experiment.samples.begin(), experiment.samples.end());
  experiment.samples.erase(std::unique(experiment.samples.begin(), experiment.samples.end()), experiment.samples.end());
  return experiment;
}

}  // namespace

Preset soares_preset() {
  Preset preset;
  preset.name = "soares";
  preset.paper = "Soares (2020), Interactive Physics-Based Rendering with AI-Accelerated Denoiser";
  preset.hardware = "NVIDIA GeForce RTX 2070, 1920x1080 unless the row says otherwise, paths of up to 32 bounces";
  preset.width = 96;
  preset.height = 54;
  preset.reference_error = "0.03";
  preset.reference_samples = "1024";
  preset.notes = {
      "The paper measured DSSIM by the program dssim of kornelski, over several scales in L*a*b*; ours is 1/SSIM - 1 "
      "of "
      "one scale. Compare how the values fall, not the values.",
      "Where a row is relative to the first mode, it is so to that mode's row of the same time in the paper, so that "
      "our times for the two may differ: they stand beside it.",
      "The paper's bidirectional pictures do not tend to those of its path tracer (its errors level off); ours do.",
      "Frames per second are pictures of one sample per pixel, which the paper shows as they come. Ours are the "
      "inverse "
      "of the time of the first sample of each pixel at our size, so that only the ratio of two modes compares.",
      "The paper's own denoiser (OptiX) is no mode of Heliograph; display and oidn are other ones, for --modes. The "
      "covered dragon's table is printed twice in the paper (B.2 and B.4), with the same figures.",
      "References are rendered by pt+bdpt, with paths of up to 32 segments; the paper does not say how many samples "
      "its own have.",
  };
  preset.experiments = {
      experiment_of({"teapot-cornell-box",
                     "Teapot Cornell Box",
                     "cornell-teapot.glb",
                     "a Cornell box with the Utah teapot, 6,334 triangles",
                     "table B.1",
                     kTeapotPt,
                     kTeapotBdpt,
                     {416.2, 208.3},
                     {103.9, 48.3}}),
      experiment_of({"covered-dragon",
                     "Covered Dragon",
                     "cornell-dragon-res2-covered-light.glb",
                     "the Stanford dragon in a box, 202,534 triangles, its light turned to the ceiling",
                     "table B.2",
                     kDragonPt,
                     kDragonBdpt,
                     {219.7, 104.7},
                     {87.0, 40.8}}),
      experiment_of({"breakfast-room",
                     "Breakfast Room",
                     "breakfast-room.glb",
                     "Bitterli's scene as glTF, without its environment",
                     "table B.3",
                     kBreakfastPt,
                     kBreakfastBdpt,
                     {332.7, 158.7},
                     {118.3, 55.4}}),
      experiment_of({"japanese-classroom",
                     "Japanese Classroom",
                     "japanese-classroom.glb",
                     "",
                     "table 4.3",
                     kClassroomPt,
                     kClassroomBdpt,
                     {106.8, 49.4},
                     {45.4, 20.5}}),
  };
  return preset;
}

}  // namespace helio::cli
