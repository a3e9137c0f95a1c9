// The receiver of these tests against packets that another program makes: the Python package tevclient.
#include <gtest/gtest.h>

#include <cstdlib>

#include "process.h"
#include "tests/support/tev_receiver.h"

namespace helio::test {
namespace {

std::string python() {
  const char* const named = std::getenv("HELIO_TEVCLIENT_PYTHON");
  return named ? named : "/usr/bin/python3";
}

TEST(Tevclient, ItsPacketsAreReadAsItMeansThem) {
  const TemporaryFolder folder;
  if (run_program(python(), {"-c", "import tevclient"}, folder.path()).exit_code != 0)
    GTEST_SKIP() << python() << " has no package tevclient; HELIO_TEVCLIENT_PYTHON names one that has";
  TevReceiver receiver;
  write_file(folder / "show.py", R"(
import sys
import numpy as np
import tevclient as tev
with tev.Ipc("127.0.0.1", int(sys.argv[1])) as viewer:
    viewer.create_image("first", 5, 4, ["R", "G", "B"])
    pixels = np.arange(3 * 2 * 3, dtype=np.float32).reshape(2, 3, 3)
    viewer.update_image("first", pixels, ["R", "G", "B"], x=1, y=2)
    viewer.update_image("first", np.full((1, 5), 9, np.float32), ["G"])
    viewer.update_vector_graphics("first", [
        tev.vg_begin_path(), tev.vg_rect(1, 2, 3, 2), tev.vg_stroke_color(1, 0.5, 0, 1), tev.vg_stroke_width(2),
        tev.vg_stroke(), tev.vg_font_face("sans"), tev.vg_font_size(12), tev.vg_text(1, 1, "tile")])
    viewer.create_image("second", 2, 2, ["Y"])
    viewer.close_image("second")
    viewer.create_image("last", 1, 1, ["Y"])
)");
  const ProcessResult result = run_program(python(), {"show.py", std::to_string(receiver.port())}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  ASSERT_TRUE(receiver.wait_for([](const auto& images) { return images.count("last") == 1; }));
  EXPECT_EQ(receiver.errors(), std::vector<std::string>{});
  const auto images = receiver.images();
  EXPECT_EQ(images.count("second"), 0u);
  const TevReceivedImage& first = images.at("first");
  EXPECT_TRUE(first.grabbed);
  EXPECT_EQ(first.width, 5);
  EXPECT_EQ(first.height, 4);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      const std::size_t at = std::size_t((y + 2) * 5 + x + 1);
      const float value = float((y * 3 + x) * 3);
      EXPECT_EQ(first.plane("R")[at], value);
      EXPECT_EQ(first.plane("G")[at], value + 1);
      EXPECT_EQ(first.plane("B")[at], value + 2);
    }
  }
  for (int x = 0; x < 5; ++x) EXPECT_EQ(first.plane("G")[std::size_t(x)], 9);
  ASSERT_EQ(first.drawn.size(), 8u);
  EXPECT_EQ(first.drawn[1].numbers, (std::vector<float>{1, 2, 3, 2}));
  EXPECT_EQ(first.drawn[7].text, "tile");
}

}  // namespace
}  // namespace helio::test
