// The tables of a paper as comparisons: what is rendered, and the figures that the paper printed.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace helio::cli {

// Measures of a PublishedFigure besides the short names of CompareMeasure.
inline constexpr std::string_view kSecondsMeasure = "seconds";           // of a picture, wall time
inline constexpr std::string_view kFramesMeasure = "frames-per-second";  // pictures of one sample per pixel
inline constexpr double kUnpublished = std::numeric_limits<double>::quiet_NaN();

struct PublishedFigure {
  std::string mode;           // in the paper's words: "BDPT"
  std::string our_mode;       // the name of a mode of the experiment; empty: Heliograph has no such mode
  std::uint32_t samples = 0;  // per pixel; 0: the paper does not say
  // A short name of CompareMeasure, or one of those above; of a region "flip@fovea".
  std::string measure;
  double value = kUnpublished;
  double seconds = kUnpublished;  // that the paper's picture took
  std::string place;              // "table B.1"
  std::string view = {};          // of several views or picture sizes of one scene: which
};

// A file in which the scene of an experiment may be.
struct SceneFile {
  std::string name;           // that is looked up below --scenes
  std::string stand_in = {};  // how it differs from the paper's scene; empty: it is the paper's scene
};

// One scene, or one camera motion in it: an ordinary comparison in a folder of its own.
struct Experiment {
  std::string name;                     // of the folder, and for --only: a-z, 0-9, '-'
  std::string scene;                    // the paper's
  std::vector<SceneFile> files;         // the first of which that is there is rendered; at least one
  std::string finding;                  // what the paper says about the experiment, as a sentence; may be empty
  std::string graph;                    // where the paper draws what it prints no figures of: "figure 10"; may be empty
  std::vector<std::string> modes;       // NAME=MODE, as --mode of compare takes them; the first is the baseline
  std::vector<std::uint32_t> samples;   // budgets unless --samples gives others, rising
  std::vector<std::string> measures;    // those of the table, as PublishedFigure has them
  std::vector<std::string> also = {};   // measured as well, for the report of the comparison alone
  std::vector<std::string> words = {};  // further words of the command line
  std::string path = {};                // a camera path (client/camera_path.h), JSON; empty: a still
  std::vector<PublishedFigure> published = {};
  // Radius of a disk around the picture's middle, over half of its diagonal, where somebody looks; the regions fovea, and
  // periphery around it. 0: none.
  double fovea = 0;
};

struct Preset {
  std::string name;                                // of --preset
  std::string paper;                               // author, year, title
  std::string hardware;                            // the paper's, with the size of its pictures
  int width = 0, height = 0;                       // of our pictures unless --size gives another
  std::string reference_error, reference_samples;  // unless the options give others
  std::vector<std::string> notes;                  // sentences: why figures differ that are not about the method
  std::vector<Experiment> experiments;
};

Preset schalk_preset();
Preset soares_preset();
Preset mrad_preset();

}  // namespace helio::cli
