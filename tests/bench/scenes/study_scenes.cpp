#include "tests/bench/scenes/study_scenes.h"

namespace helio::bench {

const std::vector<std::string>& study_scenes() {
  static const std::vector<std::string> names = {"box-area",  "box-point",         "box-directional", "box-69k",
                                                 "box-1m",    "box-low-roughness", "box-glass",       "box-glossy",
                                                 "highlight", "sponza-dabrovic",   "breakfast-room",  "courtyard"};
  return names;
}

const std::vector<std::string>& default_mode_scenes() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = study_scenes();
    for (const char* name : {"cornell", "covered", "glass", "cornell-glossy", "veach-plates"}) all.push_back(name);
    return all;
  }();
  return names;
}

}  // namespace helio::bench
