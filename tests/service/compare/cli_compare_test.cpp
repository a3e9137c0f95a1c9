// heliograph compare: modes and other flags, the folder, what goes on in it, and what is refused.
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "cli_test.h"
#include "client/comparison/comparison_folder.h"
#include "client/comparison/comparison_record.h"
#include "daemon_process.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

const std::string kBox = std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf";

class CliCompare : public CliTest {
 protected:
  // A small comparison of the box, with more words behind.
  Words line(const Words& more) {
    Words words{"compare", kBox, "--size", "16x16", "--reference-error", "0.3", "--output", "kept"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  pb::CompareRecord record(const std::string& name = "kept") {
    const auto record = read_comparison_folder(folder_ / name);
    if (!record || !*record) {
      ADD_FAILURE() << (record ? "no record" : record.error().to_string());
      return {};
    }
    return **record;
  }
  // One line with all the parts, and nothing on the disk.
  void expect_refused(const Words& words, const Words& parts, int exit_code = 2) {
    const ProcessResult result = heliograph(words);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    expect_one_line(result.err);
    for (const std::string& part : parts)
      EXPECT_NE(result.err.find(part), std::string::npos) << part << "\n" << result.err;
  }
  void write_reference(const std::string& name, int width, float value) {
    const std::vector<float> plane(std::size_t(width) * 16, value);
    const TileChannel channels[] = {{"R", plane.data(), true}, {"G", plane.data(), true}, {"B", plane.data(), true}};
    ASSERT_TRUE(write_exr(folder_ / name, {{0, 0, width, 16}, width, 16}, channels,
                          {TilePixelType::float32, TileCompression::none}));
  }
};

TEST_F(CliCompare, KeepsEveryPictureAndGoesOn) {
  const auto first = heliograph_json(line({"--modes", "pt,bdpt", "--samples", "2,4", "--seeds", "2"}));
  EXPECT_EQ(first["units"], 8);
  EXPECT_EQ(first["units_rendered"], 8);
  EXPECT_EQ(first["partial"], false);
  EXPECT_EQ(first["modes"], nlohmann::json({"pt", "bdpt"}));
  EXPECT_GT(first["references"][0]["error"], 0);
  EXPECT_LE(first["references"][0]["error"], 0.31);
  for (const char* file : {"comparison.json", "units.csv", "points.csv", "ratios.csv", "report.html",
                           "pictures/pt.view0.exr", "pictures/bdpt.view0.exr", "pictures/reference.view0.exr"})
    EXPECT_TRUE(exists(std::string("kept/") + file)) << file;
  const std::string units = read_file(folder_ / "kept/units.csv");
  EXPECT_EQ(std::count(units.begin(), units.end(), '\n'), 1 + 8);
  const auto picture = read_exr(folder_ / "kept/pictures/pt.view0.exr", 1 << 20);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->names, (Words{"B", "G", "R", "variance.B", "variance.G", "variance.R"}));
  EXPECT_EQ(record().pictures_size(), 3);

  // A call with the same arguments renders nothing; one with more of everything renders what is missing.
  EXPECT_EQ(heliograph_json(line({"--modes", "pt,bdpt", "--samples", "2,4", "--seeds", "2"}))["units_rendered"], 0);
  const auto more = heliograph_json(line({"--modes", "adaptive,pt", "--samples", "1..4", "--seeds", "3"}));
  EXPECT_EQ(more["modes"], nlohmann::json({"adaptive", "pt", "bdpt"}));
  EXPECT_EQ(more["budgets"], nlohmann::json({1.0, 2.0, 4.0}));
  EXPECT_EQ(more["units"], 27);
  EXPECT_EQ(more["units_rendered"], 27 - 8);
  const pb::CompareRecord kept = record();
  EXPECT_EQ(kept.calls_size(), 2);
  EXPECT_EQ(kept.calls(1).differences_size(), 0);
  EXPECT_NE(kept.calls(0).command_line().find(" --modes pt,bdpt "), std::string::npos);
  EXPECT_EQ(kept.table().points_size(), 9);
}

TEST_F(CliCompare, RefusesToMixAndSaysWhatItMixed) {
  heliograph_json(line({"--modes", "pt", "--samples", "2", "--seeds", "1", "--threads", "1"}));
  const Words other = line({"--modes", "pt:max-segments=3", "--mode", "pt=pt:max-segments=3", "--samples", "2",
                            "--seeds", "2", "--threads", "2", "--common-seeds"});
  const std::string before = read_file(folder_ / "kept/comparison.json");
  expect_refused(other, {"--output: the folder's comparison differs in mode pt settings.max_segments: 10 -> 3",
                         "differs in common seeds: no -> yes", "differs in threads: 1 -> 2",
                         "differs in reference settings.max_segments: 10 -> 3", "or --mix"});
  EXPECT_EQ(read_file(folder_ / "kept/comparison.json"), before);
  Words mixed = other;
  mixed.emplace_back("--mix");
  const auto json = heliograph_json(mixed);
  EXPECT_EQ(json["differences"].size(), 4u);
  EXPECT_EQ(record().calls(1).differences_size(), 4);

  Words unlike = line({"--modes", "pt", "--time", "0.01", "--measures", "mse", "--mix"});
  expect_refused(unlike, {"unit of budgets: samples -> seconds", "measures: all -> mse", "no table could hold both"});
}

TEST_F(CliCompare, RefusesToMixInstructionSetsOfEmbree) {
  const auto words = [&](const std::string& seeds, const std::string& address) {
    return line({"--modes", "pt", "--samples", "1", "--seeds", seeds, "--server", address});
  };
  std::string before;
  {
    const DaemonProcess daemon({"--render-threads", "1", "--isa", "sse4.2"});
    heliograph_json(words("1", daemon.address()));
    before = record().calls(0).isa();
    EXPECT_NE(before.find(", traversal by sse4.2"), std::string::npos) << before;
    EXPECT_NE(read_file(folder_ / "kept/report.html").find("traversal by sse4.2"), std::string::npos);
  }
  const DaemonProcess daemon({"--render-threads", "1", "--isa", "sse2"});
  expect_refused(words("2", daemon.address()), {"differs in", "traversal by sse4.2 -> ", "traversal by sse2", "--mix"});
}

TEST_F(CliCompare, ModesTakeTheOptionsOfRender) {
  heliograph_json(
      line({"--modes", "pt:roulette-from=8,combined:integrator=bdpt:adaptive-min=6,paper-adaptive,lvc,display",
            "--mode", "one=bdpt:technique=2,1", "--max-segments", "4", "--mode", "long=pt:max-segments=6", "--samples",
            "1", "--seeds", "1", "--seed", "7", "--filter", "tent:0.75"}));
  const pb::CompareRequest request = record().request();
  ASSERT_EQ(request.modes_size(), 7);
  const auto mode = [&](int i) { return request.modes(i); };
  EXPECT_EQ(mode(0).name(), "pt-roulette-from-8");
  EXPECT_EQ(mode(0).settings().roulette_from(), 8);
  EXPECT_EQ(mode(0).settings().max_segments(), 4);
  EXPECT_EQ(mode(1).name(), "combined-integrator-bdpt-adaptive-min-6");
  EXPECT_EQ(mode(1).settings().mode(), pb::MODE_COMBINED);
  EXPECT_EQ(mode(1).settings().integrator(), pb::INTEGRATOR_BDPT);
  EXPECT_EQ(mode(1).settings().adaptive().min_samples(), 6u);
  EXPECT_EQ(mode(2).settings().variant(), pb::VARIANT_PAPER);
  EXPECT_EQ(mode(2).settings().mode(), pb::MODE_ADAPTIVE);
  EXPECT_EQ(mode(3).settings().integrator(), pb::INTEGRATOR_LVC);
  EXPECT_EQ(mode(4).picture(), pb::COMPARED_PICTURE_DISPLAY);
  EXPECT_EQ(mode(5).settings().technique().light_vertices(), 2);
  EXPECT_EQ(mode(6).name(), "long");
  EXPECT_EQ(mode(6).settings().max_segments(), 6);
  EXPECT_EQ(request.first_seed(), 7u);
  for (const auto& each : request.modes()) EXPECT_EQ(each.settings().filter_scale(), 0.75);
  EXPECT_EQ(request.reference().rendered().settings().integrator(), pb::INTEGRATOR_PATH);
}

TEST_F(CliCompare, NamesEveryProblemAtOnce) {
  expect_refused({"compare",
                  kBox,
                  "--size",
                  "16x16",
                  "--modes",
                  "pt,best,bdpt:mode=combined:adaptive-min=3,preview,display:x=3,pt:size=3,light:connections=2,vcm:max-"
                  "segments=300,"
                  "pt,pt:roulette-from,combined:mode=pt",
                  "--mode",
                  "x",
                  "--mode",
                  "a b=pt",
                  "--mode",
                  "z=paper-combined:denoiser=own",
                  "--seeds",
                  "0",
                  "--samples",
                  "4,2,x",
                  "--measures",
                  "flicker,nice",
                  "--region",
                  "a=1,2,3",
                  "--region",
                  "dark half=0,0,1,1",
                  "--region",
                  "big=0,0,17,3",
                  "--reference",
                  "no.exr",
                  "--reference-samples",
                  "3",
                  "--worst-pixels",
                  "65",
                  "--output",
                  "none/here",
                  "--bogus"},
                 {"--bogus: is not an option of compare",
                  "--modes: 'best' is none of pt, adaptive,",
                  "--modes bdpt:adaptive-min: '3' is not an integer in [4, 65536]",
                  "--modes: 'preview' shows previews along a path",
                  "--modes display: 'x' is no option of a mode: adaptive-max,",
                  "'size' is the same for all modes: --size gives it",
                  "--modes light:connections: is only valid with",
                  "vcm with max_segments 300; allowed there: [1, 256]",
                  "--modes: 'pt' is there twice",
                  "'roulette-from' has no value",
                  "--modes combined:mode: 'pt' is chosen by the word 'combined' already",
                  "--mode: 'x' is not NAME=WORD",
                  "--mode: 'a b' is no name of a mode",
                  "--mode z:denoiser: is only valid",
                  "--seeds: '0' is not an integer in [1, 1000]",
                  "--samples: '2' stands behind 4; allowed: rising ones",
                  "--samples: 'x' is no integer",
                  "--measures: 'flicker' compares views of a path",
                  "--measures: 'nice' is none of mse, relmse",
                  "--region: 'a=1,2,3' is not NAME=x0,y0,x1,y1",
                  "--region: 'dark half' is a region that every comparison has",
                  "--region: 'big=0,0,17,3' reaches out",
                  "--reference: 'no.exr' is no file",
                  "--reference-samples: is only valid with --reference auto",
                  "--worst-pixels: '65'",
                  "--output: the folder 'none' does not exist"});
  expect_refused({"compare"}, {"FILE: is missing", "--output: is missing"});
  // Files and folders are looked at even if other things are wrong.
  expect_refused({"compare", "none.gltf", "--modes", "pt,zz", "--seeds", "0", "--output", "/proc/compared"},
                 {"FILE: ", "none.gltf", "--modes: 'zz' is none of", "--seeds: '0'",
                  "--output: the folder '/proc/compared' cannot be made"});
  expect_refused({"compare", "none.gltf", "--output", "kept"}, {"none.gltf"}, 3);
  expect_refused(line({"--samples", "1", "--time", "1"}), {"--time: does not go with --samples"});
  expect_refused(line({"--time", "0.0001..1"}), {"--time: '0.0001..1' is no number in [0.001, 86400]"});
  expect_refused(line({"--reference-samples", "7", "--mode", "reference:x=pt"}),
                 {"--reference-samples: '7' is odd", "--mode: 'reference:x=pt' is not NAME=WORD"});
  // The common ones are told once, not of each mode.
  const ProcessResult common = heliograph(line({"--max-segments", "0"}));
  EXPECT_EQ(common.err, "heliograph: --max-segments: '0' is not an integer in [1, 65535]\n");
  expect_refused({"compare", kBox, "--output", "/proc/compared"},
                 {"--output: the folder '/proc/compared' cannot be made"});
  fs::create_directory(folder_ / "kept");
  write_file(folder_ / "kept/comparison.json", "{}");
  expect_refused(line({}), {"kept/comparison.json: is no record of a comparison"});
  EXPECT_EQ(read_file(folder_ / "kept/comparison.json"), "{}");
}

TEST_F(CliCompare, ReferencesAreCheckedBeforeAnythingIsRendered) {
  write_reference("wide.exr", 20, 0.5f);
  expect_refused(line({"--reference", "wide.exr"}), {"--reference-error: is only valid with --reference auto",
                                                     "'wide.exr' has 20x16 pixels; allowed: 16x16"});
  const auto other = [&](const std::string& name) {
    return Words{"compare",   kBox, "--modes",  "pt",   "--seeds",     "1",
                 "--samples", "1",  "--output", "kept", "--reference", name};
  };
  write_reference("nan.exr", 16, std::numeric_limits<float>::quiet_NaN());
  expect_refused(other("nan.exr"), {"'nan.exr' has R nan at (0, 0); allowed: finite values"});
  write_file(folder_ / "text.exr", "not a picture");
  expect_refused(other("text.exr"), {"--reference: 'text.exr' cannot be read"});
  Words path = other("wide.exr");
  path.insert(path.end(), {"--path", "translate"});
  expect_refused(path, {"'wide.exr' is one file; of several views a folder, or a name with ####"});
  EXPECT_FALSE(fs::exists(folder_ / "kept"));

  // The size is the reference's.
  const auto json = heliograph_json(other("wide.exr"));
  EXPECT_EQ(json["width"], 20);
  EXPECT_EQ(json["height"], 16);
  EXPECT_EQ(json["references"][0]["noise"], nullptr) << "a file without variance";
  EXPECT_EQ(json["notices"].dump().find("its own noise stays in mse and relmse") == std::string::npos, false);
  EXPECT_EQ(record().reference_files_size(), 1);
  // A picture of it, written where the reference is read, would not be the reference any more.
  fs::create_directories(folder_ / "own/pictures");
  fs::copy(folder_ / "wide.exr", folder_ / "own/pictures/reference.view0.exr");
  Words onto = other("own/pictures");
  onto[9] = "own";
  expect_refused(onto, {"is a reference, which must not be overwritten"});
}

TEST_F(CliCompare, ALostReferenceIsSentAgain) {
  write_reference("flat.exr", 16, 0.5f);
  const auto words = [&](const std::string& address, const std::string& seeds) {
    return Words{"compare", kBox,       "--modes", "pt",          "--seeds",  seeds,      "--samples",
                 "1",       "--output", "kept",    "--reference", "flat.exr", "--server", address};
  };
  std::string id;
  {
    const DaemonProcess daemon({"--render-threads", "1"});
    heliograph_json(words(daemon.address(), "1"));
    id = record().request().reference().loaded().reference_ids(0);
    heliograph_json(words(daemon.address(), "2"));
    EXPECT_EQ(record().request().reference().loaded().reference_ids(0), id);
  }
  const DaemonProcess daemon({"--render-threads", "1"});
  EXPECT_EQ(heliograph_json(words(daemon.address(), "3"))["units_rendered"], 1);
}

TEST_F(CliCompare, RenderedReferencesAreUsedAgain) {
  const auto seeds = [&](const std::string& count, const std::string& address) {
    Words words = line({"--modes", "pt", "--samples", "1", "--seeds", count});
    if (!address.empty()) words.insert(words.end(), {"--server", address});
    return heliograph_json(words);
  };
  const auto uploaded = [](const nlohmann::json& json) {
    return json["notices"].dump().find("used instead of rendering them again") != std::string::npos;
  };
  std::string id;
  std::uint32_t samples = 0;
  {
    const DaemonProcess daemon({"--render-threads", "1"});
    EXPECT_EQ(seeds("1", daemon.address())["references"][0]["noise"], "halves");
    id = record().references(0).reference_id();
    samples = record().references(0).samples();
    const auto json = seeds("2", daemon.address());
    EXPECT_FALSE(uploaded(json)) << "the daemon has it";
    EXPECT_EQ(json["references"][0]["noise"], "halves");
    EXPECT_TRUE(record().references(0).kept());
  }
  const std::string before = read_file(folder_ / "kept/pictures/reference.view0.exr");
  const DaemonProcess daemon({"--render-threads", "1"});
  const auto json = seeds("3", daemon.address());
  EXPECT_TRUE(uploaded(json)) << json["notices"];
  EXPECT_EQ(json["units_rendered"], 1);
  EXPECT_EQ(json["references"][0]["noise"], "variance");
  EXPECT_EQ(json["references"][0]["samples"], samples);
  EXPECT_TRUE(json["differences"].empty());
  EXPECT_EQ(record().references(0).reference_id(), id);
  EXPECT_FALSE(record().request().reference().has_loaded()) << "asked for is still a rendered one";
  EXPECT_EQ(read_file(folder_ / "kept/pictures/reference.view0.exr"), before);
  EXPECT_EQ(seeds("4", daemon.address())["units_rendered"], 1) << "and nothing is refused";

  // Units of the resumed comparison are those of a single call, which takes the noise off by the halves.
  const auto whole =
      heliograph_json({"compare", kBox, "--size", "16x16", "--reference-error", "0.3", "--output", "whole", "--modes",
                       "pt", "--samples", "1", "--seeds", "4", "--server", daemon.address()});
  EXPECT_EQ(whole["references"][0]["noise"], "halves");
  const pb::CompareRecord resumed = record(), single = record("whole");
  ASSERT_EQ(resumed.units_size(), 4);
  ASSERT_EQ(single.units_size(), 4);
  for (int u = 0; u < 4; ++u) {
    const pb::CompareUnit &a = resumed.units(u), &b = single.units(u);
    ASSERT_EQ(a.seed(), b.seed());
    ASSERT_EQ(a.values_size(), b.values_size());
    for (int i = 0; i < a.values_size(); ++i) {
      EXPECT_EQ(a.values(i).measure(), b.values(i).measure());
      EXPECT_NEAR(a.values(i).value(), b.values(i).value(), 1e-6 * std::max(1e-3, std::abs(b.values(i).value())))
          << "seed " << u + 1 << ", " << pb::CompareMeasure_Name(a.values(i).measure()) << " " << a.values(i).region();
    }
  }

  // In another comparison its noise is taken off, too.
  const auto other = heliograph_json({"compare", kBox, "--modes", "bdpt", "--samples", "1", "--seeds", "1", "--output",
                                      "other", "--reference", "kept/pictures"});
  EXPECT_EQ(other["references"][0]["noise"], "variance");
}

TEST_F(CliCompare, NoPictureIsReplacedWhoseUnitStays) {
  const auto seeds = [&](const std::string& count) {
    return heliograph_json(line({"--modes", "pt", "--time", "0.01", "--seeds", count}));
  };
  seeds("1");
  const std::string picture = folder_ / "kept/pictures/pt.view0.exr", before = read_file(picture);
  fs::remove(folder_ / "kept/pictures/reference.view0.exr");
  EXPECT_EQ(seeds("2")["units_rendered"], 1);
  EXPECT_TRUE(exists("kept/pictures/reference.view0.exr"));
  EXPECT_EQ(read_file(picture), before);
}

TEST_F(CliCompare, AMissingPictureIsRenderedAgainAlone) {
  const Words words = line({"--modes", "pt,bdpt", "--samples", "1,4", "--seeds", "2"});
  heliograph_json(words);
  const std::string lost = folder_ / "kept/pictures/bdpt.view0.exr", before = read_file(lost);
  const auto written = [&](const char* file) {
    return fs::last_write_time(folder_ / "kept/pictures/" + file).time_since_epoch().count();
  };
  const auto reference = written("reference.view0.exr"), other = written("pt.view0.exr");
  fs::remove(lost);
  EXPECT_EQ(heliograph_json(words)["units_rendered"], 0);
  EXPECT_EQ(read_file(lost), before);
  EXPECT_EQ(written("reference.view0.exr"), reference);
  EXPECT_EQ(written("pt.view0.exr"), other);
  EXPECT_EQ(heliograph_json(words)["rendering_seconds"], 0.0) << "nothing is missing any more";
}

TEST_F(CliCompare, TwoCommandsDoNotShareAFolder) {
  const Words words = line({"--modes", "pt", "--samples", "1,1000000000", "--seeds", "1", "--progress", "always"});
  Process first(HELIOGRAPH_PROGRAM, words, folder_.path());
  ASSERT_TRUE(first.wait_for_errors("1 of 2 units")) << first.errors();
  const Words second = line({"--modes", "pt", "--samples", "1", "--seeds", "1"});
  expect_refused(second, {"--output: the folder 'kept' is in use: process ", "is writing a comparison into it"});
  first.send_signal(SIGINT);
  EXPECT_EQ(first.wait(30).exit_code, 130);
  EXPECT_FALSE(fs::exists(folder_ / "kept/comparison.lock"));
  EXPECT_EQ(record().units_size(), 1);
}

TEST_F(CliCompare, ADaemonThatDrainsLeavesTheUnits) {
  DaemonProcess daemon({"--render-threads", "1", "--drain-grace", "0"});
  const Words words = line({"--modes", "pt", "--samples", "1,1000000000", "--seeds", "1", "--progress", "always",
                            "--server", daemon.address()});
  Process process(HELIOGRAPH_PROGRAM, words, folder_.path());
  ASSERT_TRUE(process.wait_for_errors("1 of 2 units")) << process.errors();
  daemon.signal(SIGTERM);
  const ProcessResult result = process.wait(30);
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_NE(result.err.find("1 of 2 pictures are measured in kept, and the same command goes on"), std::string::npos)
      << result.err;
  EXPECT_EQ(record().units_size(), 1);
}

TEST_F(CliCompare, PathsShowPreviewsAndFlicker) {
  const auto json =
      heliograph_json(line({"--path", "translate", "--modes", "combined,preview", "--samples", "4", "--seeds", "1",
                            "--measures", "relmse,flicker", "--region", "left=0,0,8,16"}));
  EXPECT_EQ(json["views"], 2);
  EXPECT_EQ(json["units"], 4);
  EXPECT_EQ(json["references"].size(), 2u);
  bool flicker = false, left = false;
  for (const auto& point : json["points"]) {
    for (const auto& value : point["values"]) {
      flicker |= value["measure"] == "flicker";
      left |= value["region"] == "left";
    }
  }
  EXPECT_TRUE(flicker);
  EXPECT_TRUE(left);
  for (const char* file : {"preview.view0.exr", "preview.view1.exr", "reference.view1.exr"})
    EXPECT_TRUE(exists(std::string("kept/pictures/") + file)) << file;
  write_file(folder_ / "path.json", R"({"views": [{"samples": 4}, {"turn_degrees": 5}]})");
  expect_refused(line({"--path", "path.json"}), {"view 0 has a budget of its own"});
}

TEST_F(CliCompare, CtrlCKeepsWhatIsMeasured) {
  Words words =
      line({"--modes", "pt", "--samples", "1,2,1000000000", "--seeds", "2", "--json", "--progress", "always"});
  Process process(HELIOGRAPH_PROGRAM, words, folder_.path());
  ASSERT_TRUE(process.wait_for_errors("2 of 6 units")) << process.errors();
  EXPECT_NE(process.errors().find("reference: "), std::string::npos) << process.errors();
  process.send_signal(SIGINT);
  const ProcessResult result = process.wait(30);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_NE(result.err.find("interrupted; 2 of 6 pictures are measured in kept, and the same command goes on"),
            std::string::npos)
      << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["partial"], true);
  EXPECT_EQ(json["units"], 2);
  EXPECT_EQ(record().units_size(), 2);
  EXPECT_FALSE(record().calls(0).ended());

  // The tables and the report are of those, and say so.
  EXPECT_TRUE(record().table().partial());
  EXPECT_EQ(record().table().points_size(), 2);
  EXPECT_NE(record().table().sentences(0).find("Partial: the comparison was interrupted or failed after 2 of 6"),
            std::string::npos);
  EXPECT_EQ(json["points"].size(), 2u);
  EXPECT_EQ(json["report"], "kept/report.html");
  const std::string page = read_file(folder_ / "kept/report.html"), points = read_file(folder_ / "kept/points.csv");
  const std::string head = page.substr(0, page.find("</header>"));
  EXPECT_NE(head.find("<p class=\"answer\">Partial: the comparison was interrupted"), std::string::npos);
  EXPECT_NE(head.find("(partial)</title>"), std::string::npos);
  EXPECT_GT(std::count(points.begin(), points.end(), '\n'), 2) << points;

  // What goes on with it is whole again.
  pb::CompareRecord kept = record();
  kept.mutable_request()->set_samples(2, 4);
  write_file(folder_ / "kept/comparison.json", *comparison_json(kept));
  EXPECT_EQ(heliograph_json(line({"--modes", "pt", "--samples", "1,2,4", "--seeds", "2"}))["partial"], false);
  EXPECT_FALSE(record().table().partial());
  EXPECT_EQ(read_file(folder_ / "kept/report.html").find("(partial)"), std::string::npos);
}

}  // namespace
}  // namespace helio::test
