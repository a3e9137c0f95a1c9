#include "renderer/frame/render_settings.h"

#include <gtest/gtest.h>

#include <limits>

namespace helio {
namespace {

std::string problems_of(const RenderSettings& settings, const RenderLimits& limits = {}) {
  Problems problems;
  validate(settings, limits, "settings", problems);
  return problems.empty() ? "" : problems.to_error().to_string();
}

std::string problems_of(const Budget& budget) {
  Problems problems;
  validate(budget, "budget", problems);
  return problems.empty() ? "" : problems.to_error().to_string();
}

TEST(RenderSettings, DefaultsAndLimitsAreValid) {
  EXPECT_EQ(problems_of(RenderSettings{}), "");
  RenderSettings s;
  s.width = s.height = 1;
  s.max_segments = s.roulette_from = 65535;
  s.region = PixelRect{0, 0, 1, 1};
  EXPECT_EQ(problems_of(s), "");
  s.width = 65536;
  s.height = 1024;  // exactly 64 Mi pixels
  EXPECT_EQ(problems_of(s), "");
}

TEST(RenderSettings, EveryProblemIsReportedWithFieldValueAndRange) {
  RenderSettings s;
  s.width = 0;
  s.height = 65537;
  s.max_segments = 0;
  s.roulette_from = 65536;
  EXPECT_EQ(problems_of(s),
            "settings.width: 0; allowed: [1, 65536]; settings.height: 65537; allowed: [1, 65536]; "
            "settings.max_segments: 0; allowed: [1, 65535]; settings.roulette_from: 65536; allowed: [1, 65535]");
}

TEST(RenderSettings, PixelsAreLimitedWithoutOverflow) {
  RenderSettings s;
  s.width = s.height = 65536;
  EXPECT_EQ(problems_of(s), "settings.width x height: 65536 x 65536 = 4294967296 pixels; allowed: [1, 67108864]");
}

// Hard case 8: nothing is allocated for looking at them.
TEST(RenderSettings, TheLargestFilmIsAllowedAndOnePixelMoreIsNot) {
  RenderSettings s;
  s.width = s.height = 8192;
  EXPECT_EQ(problems_of(s), "");
  s.width = 65536;
  s.height = 1024;
  EXPECT_EQ(problems_of(s), "");
  s.width = 41605;
  s.height = 1613;
  EXPECT_EQ(problems_of(s), "settings.width x height: 41605 x 1613 = 67108865 pixels; allowed: [1, 67108864]");
}

TEST(RenderSettings, RegionMustLieInTheFilm) {
  RenderSettings s;
  s.width = 100;
  s.height = 50;
  s.region = PixelRect{10, 10, 10, 20};
  EXPECT_EQ(problems_of(s), "settings.region: [10, 10) x [10, 20) is empty; x0 < x1 and y0 < y1 are needed");
  s.region = PixelRect{-1, 0, 101, 50};
  EXPECT_EQ(problems_of(s), "settings.region: [-1, 101) x [0, 50) is not inside the film [0, 100) x [0, 50)");
  s.region = PixelRect{99, 49, 100, 50};
  EXPECT_EQ(problems_of(s), "");
}

TEST(RenderSettings, LightPathsNeedAModeThatTakesThem) {
  RenderSettings s;
  for (const Integrator integrator : kEveryIntegrator) {
    if (caches_light_vertices(integrator)) continue;
    s.integrator = integrator;
    for (const RenderMode mode : kEveryRenderMode) {
      s.mode = mode;
      s.variant = ModeVariant::bounded;
      EXPECT_EQ(problems_of(s).empty(), integrator != Integrator::light || !reuses(mode)) << to_string(mode);
      s.variant = ModeVariant::paper;
      EXPECT_EQ(problems_of(s).empty(), integrator == Integrator::path || mode == RenderMode::pt) << to_string(mode);
    }
  }
  const std::string allowed =
      "; allowed there: path; light in mode pt, and adaptive with variant bounded; bdpt and pt+bdpt in mode pt, and "
      "all "
      "others with variant bounded";
  s.integrator = Integrator::light;
  s.mode = RenderMode::combined;
  s.variant = ModeVariant::bounded;
  EXPECT_EQ(problems_of(s), "settings.integrator: light in mode combined (variant bounded)" + allowed);
  s.integrator = Integrator::bdpt;
  s.variant = ModeVariant::paper;
  EXPECT_EQ(problems_of(s), "settings.integrator: bdpt in mode combined (variant paper)" + allowed);
  s.mode = RenderMode::pt;
  s.max_segments = 257;
  EXPECT_EQ(problems_of(s), "settings.integrator: bdpt with max_segments 257; allowed there: [1, 256]");
  s.integrator = Integrator::path;
  EXPECT_EQ(problems_of(s), "");
}

TEST(RenderSettings, LightVerticesAreCachedInModePtAlone) {
  RenderSettings s;
  for (const Integrator integrator : {Integrator::lvc, Integrator::vcm, Integrator::photon}) {
    s = {};
    s.integrator = integrator;
    EXPECT_EQ(problems_of(s), "");
    for (const RenderMode mode : {RenderMode::adaptive, RenderMode::reproject, RenderMode::combined}) {
      s.mode = mode;
      EXPECT_EQ(problems_of(s), "settings.integrator: " + std::string(to_string(integrator)) + " in mode " +
                                    to_string(mode) + "; allowed there: path" +
                                    (mode == RenderMode::adaptive ? ", light" : "") + ", bdpt, pt+bdpt; " +
                                    to_string(integrator) + " needs mode pt");
    }
  }
  s.mode = RenderMode::pt;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  s.integrator = Integrator::vcm;
  s.light_cache = {0, 0};
  const std::string connections = "settings.light_cache.connections: 0; allowed: [1, 64]";
  const std::string radius = "settings.light_cache.radius: 0; allowed: [1e-06, 0.1]";
  EXPECT_EQ(problems_of(s), connections + "; " + radius);
  s.integrator = Integrator::lvc;
  EXPECT_EQ(problems_of(s), connections) << "it does not merge";
  s.integrator = Integrator::photon;
  EXPECT_EQ(problems_of(s), radius) << "it does not connect";
  s.light_cache = {64, nan};
  EXPECT_EQ(problems_of(s), "settings.light_cache.radius: nan; allowed: [1e-06, 0.1]");
  s.light_cache = {64, 0.1};
  EXPECT_EQ(problems_of(s), "");
}

TEST(RenderSettings, TechniquesAreThoseOfTheLongestPath) {
  RenderSettings s;
  s.integrator = Integrator::bdpt;
  s.max_segments = 4;
  for (const Technique technique : {Technique{0, 2}, {1, 2}, {2, 1}, {0, 5}, {4, 1}, {2, 3, true}}) {
    s.technique = technique;
    EXPECT_EQ(problems_of(s), "") << technique.light_vertices << ", " << technique.camera_vertices;
  }
  const std::pair<Technique, std::string> refused[] = {
      {{1, 1},
       "settings.technique: light_vertices 1 with camera_vertices 1: lights seen directly come from light_vertices 0 "
       "with camera_vertices 2"},
      {{0, 1}, "settings.technique: light_vertices 0 with camera_vertices 1 is no path; allowed: at least 2 in all"},
      {{-1, 0},
       "settings.technique.light_vertices: -1; allowed: [0, 4]; settings.technique.camera_vertices: 0; allowed: [1, "
       "5]"},
      {{5, 6},
       "settings.technique.light_vertices: 5; allowed: [0, 4]; settings.technique.camera_vertices: 6; allowed: [1, 5]"},
      {{3, 3},
       "settings.technique: light_vertices 3 with camera_vertices 3 is 5 segments; allowed: [1, max_segments = 4]"}};
  for (const auto& [technique, problem] : refused) {
    s.technique = technique;
    EXPECT_EQ(problems_of(s), problem);
  }
  s.technique = Technique{1, 2};
  for (const Integrator integrator : {Integrator::path, Integrator::light, Integrator::pt_bdpt}) {
    s.integrator = integrator;
    EXPECT_EQ(problems_of(s), std::string("settings.technique: integrator ") + to_string(integrator) +
                                  " in mode pt; allowed: integrator bdpt in mode pt");
  }
  s.integrator = Integrator::bdpt;
  s.mode = RenderMode::adaptive;
  EXPECT_EQ(problems_of(s),
            "settings.technique: integrator bdpt in mode adaptive; allowed: integrator bdpt in mode pt");
}

TEST(RenderSettings, FilterScalesAreChecked) {
  RenderSettings s;
  s.filter.scale = -1;  // the box has none
  EXPECT_EQ(problems_of(s), "");
  for (const PixelFilterKind kind : {PixelFilterKind::tent, PixelFilterKind::gaussian}) {
    s.filter.kind = kind;
    for (const double scale : {16.0, 0.5, std::numeric_limits<double>::denorm_min()}) {
      s.filter.scale = scale;
      EXPECT_EQ(problems_of(s), "");
    }
    for (const auto& [scale, shown] : {std::pair(0.0, "0"),
                                       {-2.5, "-2.5"},
                                       {16.01, "16.01"},
                                       {std::numeric_limits<double>::infinity(), "inf"},
                                       {std::numeric_limits<double>::quiet_NaN(), "nan"}}) {
      s.filter.scale = scale;
      EXPECT_EQ(problems_of(s), std::string("settings.filter_scale: ") + shown + "; allowed: (0, 16]");
    }
  }
}

TEST(RenderSettings, AdaptiveCountsAreChecked) {
  RenderSettings s;
  s.adaptive.min_samples = 1;  // of no meaning in mode pt
  EXPECT_EQ(problems_of(s), "");
  s.mode = RenderMode::adaptive;
  EXPECT_EQ(problems_of(s),
            "settings.adaptive.min_samples: 1; allowed: [4, 65536]; settings.adaptive.min_samples: 1 is odd; allowed: "
            "even numbers, half of the samples for each of two halves");
  s.adaptive.min_samples = 2;
  s.variant = ModeVariant::paper;
  EXPECT_EQ(problems_of(s), "");
  s.adaptive.max_samples = 2;
  EXPECT_EQ(problems_of(s), "settings.adaptive.max_samples: 2; allowed: [3, 1048576]");
  s.adaptive = {64, 64};
  EXPECT_EQ(problems_of(s), "settings.adaptive.max_samples: 64; allowed: more than min_samples = 64");
  s.adaptive = {2, 3};
  EXPECT_EQ(problems_of(s), "");
  s.variant = ModeVariant::bounded;
  EXPECT_EQ(problems_of(s), "settings.adaptive.min_samples: 2; allowed: [4, 65536]");
}

TEST(RenderSettings, ReprojectionIsCheckedWhereItIsUsed) {
  RenderSettings s;
  s.reprojection = {2, 0};
  s.mode = RenderMode::reproject;
  EXPECT_EQ(problems_of(s), "");  // hits and the error are of no meaning in our variant
  s.variant = ModeVariant::paper;
  EXPECT_EQ(problems_of(s),
            "settings.reprojection.max_error: 0; allowed: (0, 1000000]; settings.reprojection.stored_hits: 2; allowed: "
            "1, 4");
  s.reprojection = {1, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(problems_of(s), "settings.reprojection.max_error: nan; allowed: (0, 1000000]");
  s.reprojection = {4, 1e6};
  s.mode = RenderMode::combined;
  s.adaptive.min_samples = 2;
  EXPECT_EQ(problems_of(s), "");
}

// The command line takes its ranges from here.
TEST(RenderSettings, RowsOfAPathExcludeEachOther) {
  for (const RenderMode mode : kEveryRenderMode) {
    for (const ModeVariant variant : {ModeVariant::bounded, ModeVariant::paper}) {
      RenderSettings s;
      s.mode = mode;
      s.variant = variant;
      for (const auto& field : settings_fields()) {
        EXPECT_TRUE(field.use.words || !field.use.by) << field.path;
        int rows = 0;
        for (const auto& other : settings_fields()) rows += std::string(other.path) == field.path && other.use.holds(s);
        EXPECT_LE(rows, 1) << field.path;
      }
      const auto* least = find_field("adaptive.min_samples", s);
      ASSERT_NE(least, nullptr);
      EXPECT_EQ(least->range.low, allocates(mode) && variant == ModeVariant::paper ? 2 : 4);
    }
  }
  EXPECT_EQ(find_field("adaptive", {}), nullptr);
}

TEST(Budget, EveryProblemIsReported) {
  EXPECT_EQ(problems_of(Budget{}), "");
  Budget b;
  b.time_s = 0;
  b.samples = 0;
  b.error = -1;
  b.bytes_per_second = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(problems_of(b),
            "budget.time_s: 0; allowed: (0, inf); budget.samples: 0; allowed: [1, 1073741824]; "
            "budget.error: -1; allowed: (0, inf); budget.bytes_per_second: nan; allowed: (0, inf)");
  b = {};
  b.samples = (1u << 30) + 1;
  b.time_s = std::numeric_limits<double>::infinity();
  EXPECT_EQ(problems_of(b),
            "budget.time_s: inf; allowed: (0, inf); budget.samples: 1073741825; allowed: [1, 1073741824]");
}

TEST(View, TimeAndExposureAreChecked) {
  View view;
  Problems none;
  validate(view, "view", none);
  EXPECT_TRUE(none.empty());
  view.time_s = std::numeric_limits<double>::infinity();
  view.exposure = std::numeric_limits<double>::quiet_NaN();
  view.camera.position.x = std::numeric_limits<double>::quiet_NaN();
  Problems problems;
  validate(view, "view", problems);
  const std::string all = problems.to_error().to_string();
  EXPECT_NE(all.find("view.camera.position"), std::string::npos) << all;
  EXPECT_NE(all.find("view.time_s: inf; allowed: (-inf, inf)"), std::string::npos) << all;
  EXPECT_NE(all.find("view.exposure: nan; allowed: [-64, 64]"), std::string::npos) << all;
}

}  // namespace
}  // namespace helio
