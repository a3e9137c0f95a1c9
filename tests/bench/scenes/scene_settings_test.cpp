// That benches render a file as it says, and as the command would.
#include "tests/bench/scenes/scene_settings.h"

#include <gtest/gtest.h>

#include "renderer/scene/load/scene_loader.h"
#include "tests/bench/render_modes.h"

namespace helio::bench {
namespace {

RenderSettings settings_of(const std::string& integrator, const std::string& film) {
  const std::string xml = "<scene version='3.0.0'>" + integrator + "<sensor type='perspective'><film type='hdrfilm'>" +
                          film + "</film></sensor><shape type='cube'/></scene>";
  const auto scene = load_scene(*make_memory_source({{"s.xml", {xml.begin(), xml.end()}}}), "s.xml", {});
  EXPECT_TRUE(scene.ok());
  return scene.ok() ? scene_settings(*scene, scene->cameras.at(0)) : RenderSettings{};
}

TEST(SceneSettings, AreWhatTheFileSays) {
  const RenderSettings s = settings_of(
      "<integrator type='path'><integer name='max_depth' value='7'/><integer name='rr_depth' value='4'/></integrator>",
      "<rfilter type='tent'><float name='radius' value='2'/></rfilter><integer name='crop_width' value='9'/>");
  EXPECT_EQ(s.max_segments, 7);
  EXPECT_EQ(s.roulette_from, 4);
  EXPECT_EQ(s.filter, (PixelFilter{PixelFilterKind::tent, 2}));
  EXPECT_FALSE(s.region);
  const RenderSettings silent = settings_of("", "<rfilter type='box'/>");
  EXPECT_EQ(silent.max_segments, RenderSettings().max_segments);
  EXPECT_EQ(silent.roulette_from, RenderSettings().roulette_from);
}

TEST(SceneSettings, OfPathsWithoutEndAreAllowedInEveryMode) {
  const RenderSettings endless = settings_of("<integrator type='path'/>", "");
  EXPECT_EQ(endless.max_segments, 256);
  for (const ComparedMode& mode : kRenderModes) {
    RenderSettings settings = endless;
    mode.choose_in(settings);
    Problems problems;
    validate(settings, {}, "settings", problems);
    EXPECT_TRUE(problems.empty()) << mode.name;
  }
}

}  // namespace
}  // namespace helio::bench
