#include <algorithm>
#include <cmath>
#include <string>
#include <thread>

#include "cli_test.h"
#include "daemon_process.h"
#include "renderer/base/srgb.h"
#include "renderer/codec/display_image.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/scene/images/image_decoder.h"

namespace helio::test {
namespace {

using CliRender = CliTest;

constexpr std::uint64_t kMaxPixels = 1 << 20;

TEST_F(CliRender, TheJsonHasWhatScriptsReadAndThePictureIsRight) {
  const auto json = heliograph_json({"render", "quad.gltf", "--environment", "0,0,0", "--size", "40x30", "--samples",
                                     "8", "--output", "q.exr", "--png", "q.png", "--heatmap", "h.png"});
  for (const char* key : {"samples", "load_seconds", "render_seconds", "rays", "rays_per_path", "estimated_rmse",
                          "estimated_relmse", "invalid_samples"}) {
    ASSERT_TRUE(json.contains(key)) << key;
    EXPECT_TRUE(json[key].is_number()) << key << ": " << json[key];
  }
  EXPECT_EQ(json["samples"], 8);
  EXPECT_EQ(json["ended_by"], "samples");
  EXPECT_EQ(json["invalid_samples"], 0);
  EXPECT_EQ(json["partial"], false);
  EXPECT_EQ(json["paths"], 8 * 40 * 30);

  const auto picture = read_exr(folder_ / "q.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  EXPECT_EQ(picture->header.data_window, (PixelRect{0, 0, 40, 30}));
  for (const char* name : {"R", "G", "B", "variance.R", "variance.G", "variance.B", "samples"}) {
    ASSERT_TRUE(picture->find(name)) << name;
  }
  // The square emits 2 and fills the middle; the corner sees the black environment.
  EXPECT_EQ((*picture->find("R"))[15 * 40 + 20], 2);
  EXPECT_EQ((*picture->find("R"))[0], 0);
  EXPECT_EQ((*picture->find("samples"))[0], 8);
  EXPECT_EQ(read_file(folder_ / "q.png").substr(1, 3), "PNG");
  EXPECT_EQ(read_file(folder_ / "h.png").substr(1, 3), "PNG");
}

TEST_F(CliRender, ThePngShowsTheLayerDisplayOrTheFilmAsItIs) {
  const std::vector<std::string> line = {
      "render",    std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf",
      "--size",    "48x48",
      "--samples", "4",
      "--output",  "q.exr",
      "--png",     "q.png"};
  auto json = heliograph_json(line);
  EXPECT_EQ(json["png_layer"], "display");
  const std::string filtered = read_file(folder_ / "q.png");
  EXPECT_NE(filtered.find("display"), std::string::npos);  // its description
  const auto picture = read_exr(folder_ / "q.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  for (const char* name : {"display.R", "display.G", "display.B", "display.error"}) {
    ASSERT_TRUE(picture->find(name)) << name;
  }
  EXPECT_NE(*picture->find("display.R"), *picture->find("R"));

  std::vector<std::string> as_it_is = line;
  as_it_is.push_back("--raw");
  json = heliograph_json(as_it_is);
  EXPECT_EQ(json["png_layer"], "radiance");
  const std::string unfiltered = read_file(folder_ / "q.png");
  EXPECT_NE(unfiltered, filtered);
  EXPECT_EQ(unfiltered.find("display"), std::string::npos);
  EXPECT_NE(unfiltered.find("radiance"), std::string::npos);
  const auto raw = read_exr(folder_ / "q.exr", kMaxPixels);
  ASSERT_TRUE(raw) << raw.error().to_string();
  EXPECT_FALSE(raw->find("display.R"));
  EXPECT_EQ(*raw->find("R"), *picture->find("R"));
}

// The throughput is below its root, so that paths are shorter by that rule.
TEST_F(CliRender, TheRouletteRuleIsTheOneAskedFor) {
  const std::string scene = std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf";
  const auto rays = [&](std::vector<std::string> rule) {
    std::vector<std::string> line = {"render", scene,      "--size", "16x16",           "--samples",
                                     "4",      "--output", "c.exr",  "--roulette-from", "1"};
    line.insert(line.end(), rule.begin(), rule.end());
    return heliograph_json(line)["rays"].get<double>();
  };
  const double root = rays({}), named = rays({"--roulette", "root"}), throughput = rays({"--roulette", "throughput"});
  EXPECT_EQ(root, named);
  EXPECT_LT(throughput, 0.9 * root);
}

// The square (2 x 2, seen from 3 away) fills all of a picture of its camera's aspect and nothing of what a picture of
// another aspect has besides: by a job, by name and along a path.
TEST_F(CliRender, PicturesOfAnotherAspectThanTheCamerasShowMoreAndSaySo) {
  auto gltf = nlohmann::json::parse(quad_gltf(2));
  gltf["cameras"][0]["perspective"]["aspectRatio"] = 2;
  gltf["cameras"][0]["perspective"]["yfov"] = 2 * std::atan(0.5 / 3);  // sees 2 x 1 of the square's plane
  write_file(folder_ / "wide.gltf", gltf.dump());
  const auto lit_rows = [&](const std::string& name) {  // in the middle column, by the green channel
    const auto picture = read_exr(folder_ / name, kMaxPixels);
    EXPECT_TRUE(picture) << picture.error().to_string();
    const PixelRect window = picture->header.data_window;
    int rows = 0;
    for (int y = 0; y < window.height(); ++y)
      rows += (*picture->find("G"))[std::size_t(y * window.width() + window.width() / 2)] > 1;
    return rows;
  };
  const std::vector<std::string> common = {"--environment", "0,0,0", "--samples", "1"};
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), common.begin(), common.end());
    return heliograph_json(arguments);
  };
  auto json = with({"render", "wide.gltf", "--size", "64x32", "--output", "own.exr"});
  EXPECT_EQ(lit_rows("own.exr"), 32);
  EXPECT_EQ(json["notices"].dump().find("aspect"), std::string::npos);
  // As wide as the square: it is as high, 32 of the 64 rows.
  json = with({"render", "wide.gltf", "--size", "32x64", "--output", "narrow.exr", "--camera", "front"});
  EXPECT_EQ(lit_rows("narrow.exr"), 32);
  EXPECT_NE(json["notices"].dump().find("aspect (width / height) of 2, the picture has 0.5"), std::string::npos)
      << json["notices"];
  write_file(folder_ / "path.json", R"({"views": [{"camera": "front"}, {"move": [0, 0, 0]}]})");
  json = with({"move", "wide.gltf", "--size", "32x64", "--path", "path.json", "--output", "m.#.exr"});
  ASSERT_EQ(json["frames"].size(), 2u);
  for (const auto& frame : json["frames"]) {
    EXPECT_EQ(lit_rows(frame["output"].get<std::string>()), 32);
    EXPECT_NE(frame["notices"].dump().find("aspect"), std::string::npos);
  }
}

TEST_F(CliRender, StrictAndAnimationReachTheLoader) {
  auto gltf = nlohmann::json::parse(quad_gltf(2));
  gltf["nodes"][0]["children"] = nlohmann::json::array();
  const auto none = nlohmann::json::array();
  gltf["animations"] = {{{"name", "Take 001"}, {"channels", none}, {"samplers", none}}};
  write_file(folder_ / "slips.gltf", gltf.dump());
  const auto json = heliograph_json({"scene", "inspect", "slips.gltf"});
  EXPECT_EQ(json["warnings_total"], 3);
  EXPECT_EQ(json["animations"], nlohmann::json({"Take 001"}));
  const auto refused = heliograph({"scene", "inspect", "slips.gltf", "--strict"});
  EXPECT_EQ(refused.exit_code, 3);
  for (const char* place : {"/nodes/0/children", "/animations/0/channels", "/animations/0/samplers"})
    EXPECT_NE(refused.err.find(place), std::string::npos) << refused.err;
  const auto unknown = heliograph({"render", "slips.gltf", "--animation", "Walk"});
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_NE(unknown.err.find("\"Take 001\""), std::string::npos) << unknown.err;
}

// An answer has room for 256 cameras; the last of these is beyond.
TEST_F(CliRender, CamerasBeyondTheListCanBeChosen) {
  auto gltf = nlohmann::json::parse(quad_gltf(2));
  for (int i = 0; i < 300; ++i) {
    gltf["nodes"].push_back({{"camera", 0}, {"name", "c" + std::to_string(i)}, {"translation", {i, 0, 3}}});
    gltf["scenes"][0]["nodes"].push_back(gltf["nodes"].size() - 1);
  }
  write_file(folder_ / "many.gltf", gltf.dump());
  const auto report = heliograph_json({"scene", "inspect", "many.gltf"});
  ASSERT_EQ(report["cameras"].size(), 301u);
  EXPECT_EQ(report["cameras"][300]["name"], "c299");
  const auto json = heliograph_json({"render", "many.gltf", "--camera", "c299", "--size", "8x8", "--samples", "1"});
  EXPECT_EQ(json["camera"], "c299");
  const auto unknown = heliograph({"render", "many.gltf", "--camera", "c300"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("'c14' and 285 more"), std::string::npos) << unknown.err;
}

TEST_F(CliRender, DefaultsToNameExrSixtyFourSamplesAnd720Rows) {
  const auto json = heliograph_json({"render", "quad.gltf", "--region", "0,0,8,8", "--threads", "1"});
  EXPECT_EQ(json["samples"], 64);
  EXPECT_EQ(json["width"], 1280);
  EXPECT_EQ(json["height"], 720);
  EXPECT_EQ(json["output"], "quad.exr");
  EXPECT_TRUE(exists("quad.exr"));
}

TEST_F(CliRender, AMitsubaFileSaysItsSizeCropAndDepth) {
  write_file(
      folder_ / "lamp.xml",
      "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='1'/></integrator>"
      "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='48'/><integer name='height' "
      "value='32'/><integer name='crop_offset_y' value='16'/><integer name='crop_height' value='8'/></film></sensor>"
      "<emitter type='constant'><rgb name='radiance' value='1'/></emitter><shape type='sphere'><point name='center' "
      "x='0' y='0' z='4'/></shape></scene>");
  auto json = heliograph_json({"render", "lamp.xml", "--samples", "2", "--output", "lamp.exr"});
  EXPECT_EQ(json["width"], 48);
  EXPECT_EQ(json["height"], 32);
  EXPECT_EQ(json["rays_per_path"], 1);  // no segment after the camera's
  const auto picture = read_exr(folder_ / "lamp.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  EXPECT_EQ(picture->header.data_window, (PixelRect{0, 16, 48, 24}));
  json = heliograph_json({"render", "lamp.xml", "--samples", "2", "--size", "20x10", "--max-segments", "4"});
  EXPECT_EQ(json["width"], 20);
  EXPECT_GT(json["rays_per_path"], 1);
}

// The walls keep a path going for some twenty segments, of which nothing cuts it off; integrators with light paths cut
// it at the longest that they can join.
TEST_F(CliRender, AMitsubaFileThatLimitsNoPathIsNotCut) {
  write_file(folder_ / "room.xml",
             "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'><film type='hdrfilm'>"
             "<integer name='width' value='16'/><integer name='height' value='16'/></film></sensor><shape type='cube'>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0.99'/></bsdf></bsdf></shape>"
             "<shape type='sphere'><float name='radius' value='0.05'/><point name='center' x='0' y='0' z='-0.9'/>"
             "<emitter type='area'/></shape></scene>");
  const auto json = heliograph_json({"render", "room.xml", "--samples", "4", "--output", "room.exr"});
  const auto cut = heliograph_json({"render", "room.xml", "--samples", "4", "--max-segments", "10"});
  EXPECT_GT(json["rays_per_path"], 1.5 * double(cut["rays_per_path"]));
  for (const char* integrator : {"bdpt", "pt+bdpt", "pt-bdpt"}) {  // the last as earlier versions spelled it
    const auto joined = heliograph_json({"render", "room.xml", "--samples", "1", "--integrator", integrator});
    EXPECT_EQ(joined["ended_by"], "samples") << integrator;
  }
}

TEST_F(CliRender, AdaptiveCountsDifferAndTheirMeanIsTheBudget) {
  const auto json = heliograph_json({"render", "quad.gltf", "--environment", "0.1,0.1,0.1", "--size", "64x48", "--mode",
                                     "adaptive", "--samples", "64", "--output", "a.exr"});
  const auto picture = read_exr(folder_ / "a.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  const std::vector<float>& samples = *picture->find("samples");
  double sum = 0;
  for (const float n : samples) sum += n;
  const double mean = sum / double(samples.size());
  EXPECT_EQ(json["samples"], int(mean + 0.5));
  EXPECT_NEAR(mean, 64, 3);
  // Only the square's edges vary: its inside and the sky are one value each.
  EXPECT_EQ(*std::min_element(samples.begin(), samples.end()), 16);
  EXPECT_GT(*std::max_element(samples.begin(), samples.end()), 128);
  const auto paper = heliograph_json({"render", "quad.gltf", "--size", "32x24", "--mode", "adaptive", "--variant",
                                      "paper", "--adaptive-min", "2", "--samples", "6", "--output", "p.exr"});
  EXPECT_EQ(paper["ended_by"], "samples");
}

TEST_F(CliRender, ARegionIsTheSamePixelsAsTheWhole) {
  heliograph_json({"render", "quad.gltf", "--size", "40x30", "--samples", "4", "--output", "whole.exr"});
  heliograph_json(
      {"render", "quad.gltf", "--size", "40x30", "--samples", "4", "--region", "10,5,30,25", "--output", "part.exr"});
  const auto whole = read_exr(folder_ / "whole.exr", kMaxPixels), part = read_exr(folder_ / "part.exr", kMaxPixels);
  ASSERT_TRUE(whole && part);
  EXPECT_EQ(part->header.data_window, (PixelRect{10, 5, 30, 25}));
  EXPECT_EQ(part->header.frame_width, 40);
  for (int y = 5; y < 25; ++y) {
    for (int x = 10; x < 30; ++x) {
      ASSERT_EQ((*part->find("G"))[(y - 5) * 20 + x - 10], (*whole->find("G"))[y * 40 + x]) << x << "," << y;
    }
  }
}

// The square's sides are inside one column each. The box greys these two at most, a wide Gaussian many around them, and
// tent:0.001, which sees pixels' centres alone, none.
TEST_F(CliRender, AFilterSpreadsEdges) {
  const auto grey_columns = [&](const char* filter) {
    heliograph_json({"render", "quad.gltf", "--environment", "0,0,0", "--size", "41x31", "--samples", "64", "--filter",
                     filter, "--output", "f.exr"});
    const auto picture = read_exr(folder_ / "f.exr", kMaxPixels);
    EXPECT_TRUE(picture) << filter;
    int grey = 0;
    for (int x = 0; picture && x < 41; ++x) {
      const float value = (*picture->find("R"))[15 * 41 + x];
      grey += value > 0 && value < 2;
    }
    return grey;
  };
  EXPECT_EQ(grey_columns("tent:0.001"), 0);
  EXPECT_LE(grey_columns("box"), 2);
  EXPECT_GE(grey_columns("gaussian:1.5"), 8);
  EXPECT_GE(grey_columns("tent"), 2);
}

TEST_F(CliRender, LayersAreAddedOnRequest) {
  heliograph_json({"render", "quad.gltf", "--environment", "0,0,0", "--size", "16x16", "--samples", "4", "--layers",
                   "alpha,depth,normal,albedo", "--output", "q.exr"});
  const auto picture = read_exr(folder_ / "q.exr", kMaxPixels);
  ASSERT_TRUE(picture);
  for (const char* name : {"A", "Z", "N.x", "N.y", "N.z", "albedo.r", "albedo.g", "albedo.b"}) {
    EXPECT_TRUE(picture->find(name)) << name;
  }
  // 3 units from the camera, facing it.
  EXPECT_NEAR((*picture->find("Z"))[8 * 16 + 8], 3, 0.05);
  EXPECT_NEAR((*picture->find("N.z"))[8 * 16 + 8], 1, 1e-3);
}

TEST_F(CliRender, TimeEndsARenderAndIsNamed) {
  const auto json = heliograph_json({"render", "quad.gltf", "--size", "64x64", "--time", "0.3"});
  EXPECT_EQ(json["ended_by"], "time");
}

TEST_F(CliRender, AReachedErrorEndsARenderAndIsNamed) {
  const auto json = heliograph_json({"render", "quad.gltf", "--size", "32x32", "--error", "0.5", "--time", "60"});
  EXPECT_EQ(json["ended_by"], "error");
  EXPECT_LE(json["estimated_rmse"], 0.5);
}

TEST_F(CliRender, ADaemonGivesTheSameBits) {
  const DaemonProcess daemon({"--render-threads", "1"});
  ASSERT_NE(daemon.address(), "");
  const std::vector<std::string> common = {"render", "quad.gltf", "--size", "40x30", "--samples", "4", "--seed", "7"};
  auto here = common, there = common;
  here.insert(here.end(), {"--output", "here.exr"});
  there.insert(there.end(), {"--output", "there.exr", "--server", daemon.address(), "--compression", "zip"});
  heliograph_json(here);
  heliograph_json(there);
  const auto a = read_exr(folder_ / "here.exr", kMaxPixels), b = read_exr(folder_ / "there.exr", kMaxPixels);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->names, b->names);
  EXPECT_EQ(a->channels, b->channels);
}

TEST_F(CliRender, WhatIsNotSampledIsSaidAndLeftInTheFile) {
  write_file(folder_ / "mirror.gltf", spotlit_mirror_gltf());
  const std::vector<std::string> arguments = {"render", "mirror.gltf", "--size", "16x16", "--samples", "2"};
  const auto json = heliograph_json(arguments);
  ASSERT_GT(json["unsampled"].size(), 0u);
  const std::string text = json["unsampled"][0];
  EXPECT_EQ(text.rfind("missing: ", 0), 0u) << text;
  const auto picture = read_exr(folder_ / "mirror.exr", kMaxPixels);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->header.comments.substr(0, text.size()), text);
  const ProcessResult result = heliograph(arguments);
  EXPECT_NE(result.out.find("notice: " + text), std::string::npos) << result.out;
  const auto moved = heliograph_json({"move", "mirror.gltf", "--turn", "5", "--steps", "1", "--size", "16x16",
                                      "--samples", "2", "--output", "m.#.exr"});
  for (const auto& frame : moved["frames"]) EXPECT_EQ(frame["unsampled"], json["unsampled"]);
  EXPECT_EQ(heliograph_json({"render", "quad.gltf", "--size", "16x16", "--samples", "2"})["unsampled"],
            nlohmann::json::array());
}

TEST_F(CliRender, WithoutJsonItSaysWhereThePictureIs) {
  const ProcessResult result = heliograph({"render", "quad.gltf", "--size", "16x16", "--samples", "2"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.out.find("quad.exr: 16x16, 2 samples"), std::string::npos) << result.out;
  EXPECT_EQ(result.err, "");  // no progress where nobody watches
}

TEST_F(CliRender, MoreThreadsThanCoresAreNoReasonToComplain) {
  const std::string threads = std::to_string(4 * std::max(1u, std::thread::hardware_concurrency()));
  const ProcessResult result =
      heliograph({"render", "quad.gltf", "--size", "16x16", "--samples", "1", "--threads", threads});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
}

TEST_F(CliRender, ProgressIsShownOnATerminalOnly) {
  const auto errors = [&](const std::string& when, Process::Stderr where) {
    Process process(HELIOGRAPH_PROGRAM, {"render", "quad.gltf", "--size", "64x64", "--time", "1", "--progress", when},
                    folder_.path(), where);
    const ProcessResult result = process.wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  EXPECT_EQ(errors("auto", Process::Stderr::file), "");
  if (!has_pseudo_terminals()) GTEST_SKIP() << "skipped: no pseudo-terminal on this machine";
  const std::string shown = errors("auto", Process::Stderr::terminal);
  EXPECT_NE(shown.find("samples/s"), std::string::npos) << shown;
  EXPECT_NE(shown.find(" %  "), std::string::npos) << shown;
  EXPECT_EQ(errors("never", Process::Stderr::terminal), "");
}

using CliMove = CliTest;

TEST_F(CliMove, AnOrbitWritesOnePictureAView) {
  const auto json =
      heliograph_json({"move", "quad.gltf", "--environment", "0,0,0", "--orbit", "180", "--pivot", "0,0,0", "--steps",
                       "2", "--size", "40x30", "--samples", "4", "--output", "o.##.exr", "--png", "o.png"});
  ASSERT_EQ(json["frames"].size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(json["frames"][i]["samples"], 4);
    EXPECT_EQ(json["frames"][i]["ended_by"], "samples");
    EXPECT_GT(json["frames"][i]["first_tile_seconds"], 0);
    EXPECT_EQ(json["frames"][i]["output"], "o.0" + std::to_string(i) + ".exr");
    EXPECT_TRUE(exists("o.000" + std::to_string(i) + ".png"));
  }
  // From the front the square emits 2; edge-on it is not seen; from behind it emits nothing.
  const float wanted[] = {2, 0, 0};
  for (int i = 0; i < 3; ++i) {
    const auto picture = read_exr(folder_ / ("o.0" + std::to_string(i) + ".exr"), kMaxPixels);
    ASSERT_TRUE(picture);
    EXPECT_EQ((*picture->find("R"))[15 * 40 + 10], wanted[i]) << "view " << i;
  }
}

TEST_F(CliMove, PlayingInRealTimeTellsWhatWasShown) {
  const auto json = heliograph_json({"move",           "quad.gltf", "--environment", "0,0,0", "--turn",           "2",
                                     "--steps",        "8",         "--play",        "40",    "--preview-budget", "5",
                                     "--preview-jpeg", "80",        "--size",        "40x30", "--samples",        "4",
                                     "--output",       "p.##.exr",  "--png",         "p.png"});
  const auto& play = json["play"];
  EXPECT_EQ(play["views"], 8);
  EXPECT_GE(play["previews"], 2) << "the first view's and the last one's";
  EXPECT_GE(play["whole_pictures"].get<int>() + play["skipped_views"].get<int>(), 6) << "at most two come late";
  EXPECT_GT(play["last_preview_whole_ms"], 0);
  EXPECT_GE(play["last_film_first_tile_ms"], play["last_preview_whole_ms"]) << "the preview goes first";
  EXPECT_GE(play["last_film_whole_ms"], play["last_film_first_tile_ms"]);
  EXPECT_TRUE(play.contains("age_p50_ms") && play.contains("age_p95_ms"));
  ASSERT_EQ(json["frames"].size(), 1u) << "the last view's film";
  EXPECT_EQ(json["frames"][0]["view"], 8);
  EXPECT_EQ(json["frames"][0]["ended_by"], "samples");
  EXPECT_EQ(json["frames"][0]["output"], "p.08.exr");
  EXPECT_TRUE(exists("p.0008.png"));
  const auto picture = read_exr(folder_ / "p.08.exr", kMaxPixels);
  ASSERT_TRUE(picture);
  EXPECT_TRUE(picture->find("R") && picture->find("variance.R")) << "previews have neither";
}

TEST_F(CliMove, PlayingWhereCombinedDoesNotGoSaysSo) {
  write_file(folder_ / "broken.gltf", "{");
  const ProcessResult lvc = heliograph({"move", "broken.gltf", "--turn", "5", "--play", "20", "--integrator", "lvc"});
  EXPECT_NE((lvc.out + lvc.err).find("which does not go with these settings: mode is pt, with previews"),
            std::string::npos)
      << lvc.out << lvc.err;
  const ProcessResult still = heliograph({"move", "broken.gltf", "--turn", "5", "--integrator", "lvc"});
  EXPECT_NE((still.out + still.err).find("mode is pt\n"), std::string::npos) << still.out << still.err;
  const ProcessResult path = heliograph({"move", "broken.gltf", "--turn", "5", "--play", "20"});
  EXPECT_EQ((path.out + path.err).find("mode is pt"), std::string::npos);
}

TEST_F(CliMove, KeepsWhatIsTrueUnlessToldOtherwise) {
  std::vector<std::string> line = {"move",     "quad.gltf", "--environment", "0.1,0.1,0.1", "--move",    "0.05,0,0",
                                   "--steps",  "1",         "--size",        "40x30",       "--samples", "16",
                                   "--output", "k.#.exr"};
  EXPECT_GT(heliograph_json(line)["frames"][1]["reuse_share"], 0.1);
  // Options that go with the mode need not name it.
  line.insert(line.end(), {"--adaptive-min", "8"});
  EXPECT_GT(heliograph_json(line)["frames"][1]["reuse_share"], 0.1);
  line.resize(line.size() - 2);
  line.insert(line.end(), {"--mode", "pt"});
  EXPECT_EQ(heliograph_json(line)["frames"][1]["reuse_share"], 0);
}

TEST_F(CliMove, APathByNameEndsAtTheCamerasOwnView) {
  const auto json = heliograph_json({"move", "quad.gltf", "--environment", "0,0,0", "--path", "turn", "--step", "90",
                                     "--steps", "2", "--size", "40x30", "--samples", "4", "--output", "t.#.exr"});
  ASSERT_EQ(json["frames"].size(), 3u);
  const float wanted[] = {0, 0, 2};  // the square is behind, beside and in front
  for (int i = 0; i < 3; ++i) {
    const auto picture = read_exr(folder_ / ("t." + std::to_string(i) + ".exr"), kMaxPixels);
    ASSERT_TRUE(picture);
    EXPECT_EQ((*picture->find("R"))[15 * 40 + 10], wanted[i]) << "view " << i;
  }
}

// Of the pixel that sees the square's middle, and of the corner, which sees the environment.
TEST_F(CliMove, HeatMapsShowErrorProbabilityAndReuse) {
  const auto json = heliograph_json({"move", "quad.gltf", "--environment", "0.1,0.1,0.1", "--move", "0.2,0,0",
                                     "--steps", "1", "--size", "80x60", "--samples", "32", "--mode", "combined",
                                     "--output", "c.#.exr", "--heatmap", "c.#.png"});
  ASSERT_EQ(json["frames"].size(), 2u);
  const auto& first = json["frames"][0];
  const auto& second = json["frames"][1];
  EXPECT_EQ(first["reuse_share"], 0);
  EXPECT_GT(second["reuse_share"], 0.1);
  EXPECT_LT(second["reuse_share"], 1);
  EXPECT_GT(second["verification_rays"], 0);
  for (const char* pass : {"integrate", "measure", "resolve", "publish", "allocate", "reproject"})
    EXPECT_GE(second["pass_seconds"][pass], 0) << pass;
  EXPECT_EQ(second["heatmap"], "c.1.png");
  EXPECT_EQ(second["density_map"], "c.1.density.png");
  EXPECT_EQ(second["density_map_range"], nlohmann::json({0.0625, 16}));
  EXPECT_EQ(second["reuse_map"], "c.1.reuse.png");
  EXPECT_EQ(second["reuse_map_range"], nlohmann::json({0, 1}));

  const auto picture = read_exr(folder_ / "c.1.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  const auto expect_colours = [&](const std::string& file, const std::vector<float>& values, const HeatRange& range) {
    const std::string bytes = read_file(folder_ / file);
    const auto png = decode_image({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, file, 1 << 24);
    ASSERT_TRUE(png) << png.error().to_string();
    ASSERT_EQ(png->width, 80);
    ASSERT_EQ(png->height, 60);
    ASSERT_EQ(png->texels.size(), 80u * 60 * 3);
    for (std::size_t i = 0; i < values.size(); i += 7) {
      const Rgb colour = heat_color(range.position(values[i]));
      for (std::size_t c = 0; c < 3; ++c) {
        const double shown = 255.0 * double(encode_srgb(colour[int(c)]));
        ASSERT_NEAR(png->texels[3 * i + c], shown, 2) << file << " pixel " << i;
      }
    }
  };
  expect_colours("c.1.reuse.png", *picture->find("history.weight"), {0, 1, false});
  expect_colours("c.1.density.png", *picture->find("samples.density"), {1.0f / 16, 16, true});
  std::vector<float> errors(80 * 60);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    double mean = 0, variance = 0;
    for (const char* c : {"R", "G", "B"}) mean += (*picture->find(c))[i] / 3.0;
    for (const char* c : {"variance.R", "variance.G", "variance.B"}) variance += (*picture->find(c))[i] / 3.0;
    errors[i] = float(std::sqrt(variance) / mean);
  }
  expect_colours("c.1.png", errors, {1e-4f, 1, true});
  const std::vector<float>& weight = *picture->find("history.weight");
  EXPECT_GT(*std::max_element(weight.begin(), weight.end()), 0.3f);
}

// Black without variance is the low end, black with some (here: of a single sample, unknown) the high end.
TEST_F(CliRender, TheErrorMapOfBlackIsDarkUnlessNothingIsKnown) {
  for (const char* samples : {"1", "4"}) {
    heliograph_json({"render", "quad.gltf", "--environment", "0,0,0", "--size", "20x16", "--samples", samples,
                     "--output", "b.exr", "--heatmap", "b.png"});
    EXPECT_FALSE(exists("b.reuse.png"));
    const std::string bytes = read_file(folder_ / "b.png");
    const auto png =
        decode_image({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "b.png", 1 << 24);
    ASSERT_TRUE(png) << png.error().to_string();
    const Rgb expected = heat_color(samples == std::string("1") ? 1.0f : 0.0f);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(png->texels[std::size_t(c)], 255.0 * double(encode_srgb(expected[c])), 1) << samples;
    }
  }
}

TEST_F(CliMove, PlaysAPathFileWithItsBudgets) {
  write_file(folder_ / "path.json",
             R"({"views": [{"samples": 8}, {"turn_degrees": 90}, {"camera": "front", "samples": 2}]})");
  const DaemonProcess daemon({"--render-threads", "1"});
  const auto json = heliograph_json({"move", "quad.gltf", "--environment", "0,0,0", "--path", "path.json", "--size",
                                     "40x30", "--samples", "4", "--server", daemon.address()});
  ASSERT_EQ(json["frames"].size(), 3u);
  EXPECT_EQ(json["frames"][0]["samples"], 8);
  EXPECT_EQ(json["frames"][1]["samples"], 4);
  EXPECT_EQ(json["frames"][2]["samples"], 2);
  const auto aside = read_exr(folder_ / "quad.0001.exr", kMaxPixels),
             back = read_exr(folder_ / "quad.0002.exr", kMaxPixels);
  ASSERT_TRUE(aside && back);
  EXPECT_EQ((*aside->find("R"))[15 * 40 + 20], 0);
  EXPECT_EQ((*back->find("R"))[15 * 40 + 20], 2);
}

using CliOther = CliTest;

TEST_F(CliOther, InfoTellsLimitsAndModes) {
  const auto json = heliograph_json({"info"});
  EXPECT_GT(json["limits"]["max_film_side"], 0);
  EXPECT_EQ(json["modes"][0], "pt");
  EXPECT_EQ(json["integrators"].get<std::vector<std::string>>(),
            (std::vector<std::string>{"path", "light", "bdpt", "pt+bdpt", "lvc", "vcm", "photon"}));
  EXPECT_EQ(heliograph({"info"}).exit_code, 0);
}

TEST_F(CliOther, InspectTellsWhatIsThere) {
  const auto json = heliograph_json({"scene", "inspect", "quad.gltf"});
  EXPECT_EQ(json["triangles"], 2);
  EXPECT_EQ(json["cameras"][0]["name"], "front");
  EXPECT_EQ(json["bounds_max"], nlohmann::json({1, 1, 0}));
}

TEST_F(CliOther, HelpHoldsTheExitCodes) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"--help"},
                                                  {"render", "--help"},
                                                  {"move", "--help"},
                                                  {"info", "--help"},
                                                  {"scene", "inspect", "--help"}}) {
    const ProcessResult result = heliograph(command);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("4 server unreachable"), std::string::npos) << command.front();
  }
  EXPECT_NE(heliograph({"serve", "--help"}).out.find("--max-sessions"), std::string::npos);
}

TEST_F(CliOther, ServeIsTheDaemon) {
  Process serve(HELIOGRAPH_PROGRAM, {"serve", "--render-threads", "1"}, folder_.path());
  ASSERT_TRUE(serve.wait_for_output("listening on "));
  ASSERT_TRUE(serve.wait_for_output("\n"));
  const std::string line = serve.output();
  const std::size_t at = line.find("listening on ") + 13;
  const std::string address = line.substr(at, line.find_first_of(" \n", at) - at);
  EXPECT_EQ(heliograph_json({"info", "--server", address})["server"], address);
  serve.send_signal(SIGTERM);
  EXPECT_EQ(serve.wait().exit_code, 0);
}

}  // namespace
}  // namespace helio::test
