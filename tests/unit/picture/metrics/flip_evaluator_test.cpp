// FLIP beside the evaluator of its authors, in every pixel: flip-evaluator of PyPI, where HELIO_FLIP_PYTHON (else
// /usr/bin/python3) has it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "renderer/metrics/flip.h"
#include "tests/support/tier.h"
#include "tests/unit/picture/metrics/flip_pairs.h"
#include "tests/unit/picture/temporary_folder.h"

namespace helio {
namespace {

using test::FlipPair;

std::string python() {
  const char* const named = std::getenv("HELIO_FLIP_PYTHON");
  return named ? named : "/usr/bin/python3";
}

// evaluate.py WIDTH HEIGHT LDR|HDR TONE_MAPPER PIXELS_PER_DEGREE NAME: reads picture.raw and reference.raw, planar
// floats; writes map.raw; prints the row of flip_test.cpp.
const char kEvaluate[] = R"(
import sys
import numpy as np
import flip_evaluator
width, height = int(sys.argv[1]), int(sys.argv[2])
def read(name):
    planes = np.fromfile(name, np.float32).reshape(3, height, width)
    return np.ascontiguousarray(planes.transpose(1, 2, 0).clip(0, 1 if sys.argv[3] == "LDR" else None))
settings = {"ppd": float(sys.argv[5])}
if sys.argv[3] == "HDR":
    settings["tonemapper"] = sys.argv[4]
error, mean, used = flip_evaluator.evaluate(read("reference.raw"), read("picture.raw"), sys.argv[3], False, False, True,
                                            settings)
error = np.ascontiguousarray(np.squeeze(error), np.float32)
error.tofile("map.raw")
ordered = np.sort(error.ravel().astype(np.float64))
sums = np.cumsum(ordered)
print('{"%s", %.6f, %.6f, %d, {%s}},' % (sys.argv[6], mean, ordered[np.searchsorted(sums, sums[-1] / 2)],
      max(used["numExposures"], 0), ", ".join("%.6f" % e for e in error.ravel()[::500])))
)";

void write_planes(const std::filesystem::path& file, const test::Picture& picture) {
  std::ofstream out(file, std::ios::binary);
  for (const auto& channel : picture.channels)
    out.write(reinterpret_cast<const char*>(channel.data()), std::streamsize(channel.size() * sizeof(float)));
}

TEST(FlipEvaluator, GivesTheSameMaps) {
  HELIO_FULL_TIER_ONLY();
  if (std::system((python() + " -c 'import numpy, flip_evaluator' >/dev/null 2>&1").c_str()) != 0)
    GTEST_SKIP() << python() << " has no package flip-evaluator; HELIO_FLIP_PYTHON names one that has";
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "evaluate.py") << kEvaluate;
  const char* const kToneMappers[] = {"aces", "hable", "reinhard"};
  for (const FlipPair& pair : test::flip_pairs()) {
    write_planes(folder.path() / "picture.raw", pair.picture);
    write_planes(folder.path() / "reference.raw", pair.reference);
    for (int mapper = 0; mapper < (pair.hdr ? 3 : 1); ++mapper) {
      for (const double pixels_per_degree : {kFlipPixelsPerDegree, 25.0}) {
        const std::string settings =
            std::string(pair.hdr ? "HDR " : "LDR ") + kToneMappers[mapper] + " " + std::to_string(pixels_per_degree);
        SCOPED_TRACE(pair.name + ", " + settings);
        const std::string command = "cd '" + folder.path().string() + "' && " + python() + " evaluate.py " +
                                    std::to_string(pair.picture.width) + " " + std::to_string(pair.picture.height) +
                                    " " + settings + " '" + pair.name + "'";
        ASSERT_EQ(std::system(command.c_str()), 0);
        std::vector<float> map(pair.picture.view().pixels());
        std::ifstream(folder.path() / "map.raw", std::ios::binary)
            .read(reinterpret_cast<char*>(map.data()), std::streamsize(map.size() * sizeof(float)));
        const FlipOptions options{pixels_per_degree, FlipToneMapper(mapper)};
        const Flip flip = (pair.hdr ? hdr_flip(pair.picture.view(), pair.reference.view(), options)
                                    : ldr_flip(pair.picture.view(), pair.reference.view(), options))
                              .value();
        double mean = 0, worst = 0;
        for (std::size_t i = 0; i < map.size(); ++i) {
          mean += map[i] / double(map.size());
          worst = std::max(worst, std::abs(double(map[i]) - flip.error[i]));
        }
        EXPECT_NEAR(flip.mean, mean, 1e-4);
        // Around fireflies on flat grey the tails of the filters are seen: differences of the last digits of floats,
        // to the power 0.7. There the same formulas in double precision are within 1e-4 of ours (ACES, 67 pixels a
        // degree), and 2e-4 from the evaluator's.
        EXPECT_LT(worst, pair.name == "fireflies in the dark" ? 1e-3 : 1e-4);
      }
    }
  }
}

}  // namespace
}  // namespace helio
