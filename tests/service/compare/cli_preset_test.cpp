// heliograph compare --preset: the paper's figures beside ours, what is missing, and what is refused.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <sstream>

#include "cli_test.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;
using Json = nlohmann::json;

// The header, and one chunk.
std::string glb_of(std::string json) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb = "glTF";
  const auto add = [&](std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) glb += char(value >> shift & 0xff);
  };
  add(2);
  add(std::uint32_t(12 + 8 + json.size()));
  add(std::uint32_t(json.size()));
  return glb + "JSON" + json;
}

class CliPreset : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    fs::create_directories(folder_ / "scenes/deeper");
    write_file(folder_ / "scenes/deeper/cornell-teapot.glb", glb_of(quad_gltf(2)));
    write_file(folder_ / "scenes/sponza-dabrovic.glb", glb_of(quad_gltf(2)));
  }
  Words line(const std::string& preset, const Words& more) {
    Words words{"compare", "--preset",          preset, "--scenes", "scenes", "--size", "16x16", "--seeds",
                "1",       "--reference-error", "0.5",  "--output", "kept"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  void expect_refused(const Words& words, const Words& parts) {
    const ProcessResult result = heliograph(words);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    expect_one_line(result.err);
    for (const std::string& part : parts)
      EXPECT_NE(result.err.find(part), std::string::npos) << part << "\n" << result.err;
    EXPECT_FALSE(fs::exists(folder_ / "kept"));
  }
};

const Json* find_row(const Json& experiment, const std::string& mode, int samples, const std::string& measure) {
  for (const Json& row : experiment["rows"])
    if (row["mode"] == mode && row["samples"] == samples && row["measure"] == measure) return &row;
  return nullptr;
}

TEST_F(CliPreset, PutsPublishedFiguresBesideOurs) {
  const Words words = line("soares", {"--only", "teapot-cornell-box,japanese-classroom", "--samples", "1,4,16"});
  const Json json = heliograph_json(words);
  ASSERT_EQ(json["experiments"].size(), 2u);
  EXPECT_NE(json["hardware"].get<std::string>().find("RTX 2070"), std::string::npos);
  const Json& teapot = json["experiments"][0];
  EXPECT_EQ(teapot["found"], "scenes/deeper/cornell-teapot.glb");
  EXPECT_EQ(teapot["problem"], nullptr);

  // Table B.1: after 0.078 s BDPT has 4 samples, and PT 16.
  const Json* const row = find_row(teapot, "BDPT", 4, "dssim");
  ASSERT_TRUE(row);
  EXPECT_EQ((*row)["published"], 0.39809779);
  EXPECT_EQ((*row)["published_seconds"], 0.078);
  EXPECT_EQ((*row)["place"], "table B.1");
  EXPECT_EQ((*row)["baseline_samples"], 16);
  EXPECT_NEAR((*row)["published_ratio"].get<double>(), 0.39809779 / 0.23111120, 1e-9);
  EXPECT_EQ((*row)["published_seconds_ratio"], 1);
  EXPECT_EQ((*row)["remark"], "");
  const Json* const base = find_row(teapot, "PT", 16, "dssim");
  ASSERT_TRUE(base);
  EXPECT_EQ((*base)["ratio"]["mean"], 1);
  EXPECT_NEAR((*row)["seconds_ratio"]["mean"].get<double>(),
              (*row)["seconds"]["mean"].get<double>() / (*base)["seconds"]["mean"].get<double>(), 1e-9);
  EXPECT_EQ((*row)["ours"]["low"], nullptr);  // one seed

  // Frames a second are of one sample; denoised pictures are no mode of ours; other budgets were not asked for.
  const Json* const frames = find_row(teapot, "PT", 1, "frames-per-second");
  ASSERT_TRUE(frames);
  EXPECT_EQ((*frames)["published"], 416.2);
  EXPECT_NEAR((*frames)["ours"]["mean"].get<double>() * (*frames)["seconds"]["mean"].get<double>(), 1, 1e-9);
  const Json* const denoised = find_row(teapot, "PT + OptiX denoiser", 16, "dssim");
  ASSERT_TRUE(denoised);
  EXPECT_EQ((*denoised)["our_mode"], nullptr);
  EXPECT_NE((*denoised)["remark"].get<std::string>().find("missing mode"), std::string::npos);
  EXPECT_EQ((*find_row(teapot, "PT", 64, "dssim"))["ours"], nullptr);
  EXPECT_NE(find_row(teapot, "pt+bdpt", 16, "relmse"), nullptr);

  // The scene that is not there keeps the paper's figures.
  const Json& classroom = json["experiments"][1];
  EXPECT_EQ(classroom["found"], nullptr);
  EXPECT_NE(classroom["problem"].get<std::string>().find("no file 'japanese-classroom.glb'"), std::string::npos);
  EXPECT_EQ((*find_row(classroom, "BDPT", 405, "dssim"))["published"], 0.37519143);
  EXPECT_EQ((*find_row(classroom, "BDPT", 405, "dssim"))["remark"], classroom["problem"]);

  EXPECT_TRUE(exists("kept/teapot-cornell-box/report.html"));
  const std::string page = read_file(folder_ / "kept/preset.html"), csv = read_file(folder_ / "kept/preset.csv");
  for (const std::string part : {"0.398", "RTX 2070", "no file &#39;japanese-classroom.glb&#39;", "missing mode",
                                 "in place of the paper&#39;s scene", "teapot-cornell-box/report.html"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_NE(csv.find(",0.39809779,0.078,"), std::string::npos);
  std::size_t rows = 0;
  for (const Json& experiment : json["experiments"]) rows += experiment["rows"].size();
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), std::ptrdiff_t(1 + rows));

  // Each experiment is an ordinary comparison: it has all there is, and refuses other settings.
  const ProcessResult other = heliograph([&] {
    Words changed = words;
    changed[6] = "8x8";
    return changed;
  }());
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("the folder's comparison differs in"), std::string::npos) << other.err;
  EXPECT_EQ(read_file(folder_ / "kept/preset.csv"), csv);
}

TEST_F(CliPreset, MeasuresTheLastViewOfATurn) {
  const Json json = heliograph_json(line("schalk", {"--only", "sponza-turn-20,san-miguel", "--samples", "1"}));
  const Json& turn = json["experiments"][1];
  EXPECT_EQ(json["experiments"][0]["rows"].size(), 1u);
  EXPECT_NE(json["experiments"][0]["rows"][0]["remark"].get<std::string>().find("missing scene"), std::string::npos);
  const Json* const frame = find_row(turn, "reprojection, one hit", 1, "seconds");
  ASSERT_TRUE(frame);
  EXPECT_NEAR((*frame)["published_ratio"].get<double>(), 31.64 / 25.99, 1e-9);
  EXPECT_GT((*frame)["ratio"]["mean"], 0);
  const Json* const error = find_row(turn, "reproject-4", 1, "mse");
  ASSERT_TRUE(error);
  EXPECT_EQ((*error)["published"], nullptr);
  const std::string points = read_file(folder_ / "kept/sponza-turn-20/points.csv");
  EXPECT_NE(points.find("reproject-4,1,5,"), std::string::npos);  // six views: a turn of 100 degrees in steps of 20
  EXPECT_EQ(points.find("reproject-4,1,6,"), std::string::npos);
}

// Of a CSV file without quotes: cells by the names of the first line.
std::vector<std::map<std::string, std::string>> read_csv(const std::string& text) {
  std::vector<std::map<std::string, std::string>> rows;
  Words head;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    Words cells;
    std::istringstream parts(line);
    for (std::string cell; std::getline(parts, cell, ',');) cells.push_back(cell);
    if (head.empty()) {
      head = cells;
      continue;
    }
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < cells.size() && i < head.size(); ++i) row[head[i]] = cells[i];
  }
  return rows;
}

TEST_F(CliPreset, RendersStandInsAndTakesTheRatiosOfCompare) {
  write_file(folder_ / "scenes/box-directional.glb",
             glb_of(read_file(fs::path(HELIO_SOURCE_DIR) / "scenes/cornell-glossy/cornell-glossy.gltf")));
  Words words = line("schalk", {"--only", "directional-light,point-light", "--samples", "4,16"});
  words[8] = "5";  // seeds, so that there are intervals
  const Json json = heliograph_json(words);
  const Json &sun = json["experiments"][0], &lamp = json["experiments"][1];
  EXPECT_EQ(sun["file"], "box-directional.glb");
  EXPECT_NE(sun["stand_in"], "");
  EXPECT_EQ(lamp["file"], nullptr);
  EXPECT_EQ(lamp["files"], Json({"cornell-point.glb", "box-point.glb"}));
  int compared = 0;
  for (const auto& row : read_csv(read_file(folder_ / "kept/directional-light/ratios.csv"))) {
    if (row.at("region") != "" || row.at("mode") == "pt") continue;
    const std::string kind = row.at("kind");
    if (kind != "equal-samples" && kind != "speed") continue;
    const std::string measure = kind == "speed" ? "mse" : row.at("measure");
    const Json* const found = find_row(sun, row.at("mode"), std::stoi(row.at("at")), measure);
    ASSERT_TRUE(found) << row.at("mode") << " " << measure;
    const Json& ratio = (*found)[kind == "speed" ? "seconds_ratio" : "ratio"];
    ASSERT_FALSE(ratio.is_null());
    for (const auto& [part, column] :
         {std::pair("mean", "ratio"), std::pair("low", "low"), std::pair("high", "high")}) {
      const double expected = std::stod(row.at(column));
      EXPECT_NEAR(ratio[part].get<double>(), expected, 1e-9 * expected) << kind << " " << part;
    }
    ++compared;
  }
  EXPECT_EQ(compared, 2 * 2 * 4);  // modes, budgets, three measures and the speed

  const std::string page = read_file(folder_ / "kept/preset.html");
  EXPECT_NE(page.find("Rendered: box-directional.glb, in place of the paper&#39;s scene"), std::string::npos);
  EXPECT_NE(page.find("Not rendered: none of the files &#39;cornell-point.glb&#39;, &#39;box-point.glb&#39;."),
            std::string::npos);
  EXPECT_EQ(page.find("whose name is not known"), std::string::npos) << "this process knows its processor";
}

TEST_F(CliPreset, TellsWhatSpeaksAgainstItsFigures) {
  write_file(folder_ / "scenes/box-directional.glb",
             glb_of(read_file(fs::path(HELIO_SOURCE_DIR) / "scenes/cornell-glossy/cornell-glossy.gltf")));
  const Words words = line("schalk", {"--only", "directional-light", "--samples", "4"});
  heliograph_json(words);
  const std::string file = folder_ / "kept/directional-light/comparison.json";
  Json record = Json::parse(read_file(file));
  // Of other programs on this machine, too.
  for (Json& unit : record["units"]) unit.erase("disturbed");
  record["units"][0]["disturbed"] = true;
  for (Json& point : record["table"]["points"]) {
    const bool first = point["mode"] == "pt";
    point["disturbed"] = first ? 1 : 0;
    for (Json& value : point["values"])
      if (!first && value["measure"] == "COMPARE_MEASURE_MSE") value["fewPixelsDecide"] = true;
  }
  write_file(file, record.dump());
  const Json json = heliograph_json(words);
  const Json& sun = json["experiments"][0];
  EXPECT_EQ(sun["disturbed"], 1);
  const Json *const error = find_row(sun, "adaptive-2-32", 4, "mse"), *const base = find_row(sun, "pt", 4, "mse");
  ASSERT_TRUE(error && base);
  EXPECT_EQ((*error)["few_pixels_decide"], true);
  EXPECT_EQ((*error)["ratio_few_pixels_decide"], true);
  EXPECT_EQ((*error)["disturbed"], false);
  EXPECT_EQ((*error)["ratio_disturbed"], true) << "its baseline's time was";
  EXPECT_EQ((*base)["disturbed"], true);
  const std::string page = read_file(folder_ / "kept/preset.html");
  const std::string head = page.substr(0, page.find("</header>"));
  EXPECT_NE(head.find("<strong>Disturbed.</strong> While 1 of 3 pictures"), std::string::npos);
  for (const char* part : {"<sup>p</sup>", "<sup>d</sup>", "p: a few pixels decide", "d: disturbed."})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  const ProcessResult lines = heliograph(words);
  for (const char* part : {"disturbed: while 1 of 3 pictures were rendered", " (p)", "(p): a few pixels decide"})
    EXPECT_NE((lines.out + lines.err).find(part), std::string::npos) << part << lines.out << lines.err;
}

// The published modes, ours, and the region that somebody looks at, of pictures of any size.
TEST_F(CliPreset, MradsViewsAreDragsUnderAGaze) {
  const Words words = line("mrad", {"--only", "sponza-overview,sun-temple-statue"});
  const Json json = heliograph_json(words);
  const Json& overview = json["experiments"][0];
  EXPECT_EQ(overview["problem"], nullptr) << overview["problem"];
  for (const auto& [mode, ours, value] : {std::tuple("foveated", "foveated", 0.187),
                                          {"foveated + DLSS", "upscaled", 0.221},
                                          {"foveated + DLSS + TAA", "antialiased", 0.220}}) {
    const Json* const row = find_row(overview, mode, 1, "flip-median");
    ASSERT_TRUE(row) << mode;
    EXPECT_EQ((*row)["our_mode"], ours);
    EXPECT_EQ((*row)["published"], value);
    EXPECT_EQ((*row)["remark"], "");
  }
  for (const char* mode : {"foveated", "upscaled", "antialiased", "mended", "ours", "ours-without-gaze"}) {
    for (const char* measure : {"flip@fovea", "flicker@periphery"}) {
      const Json* const row = find_row(overview, mode, 1, measure);
      ASSERT_TRUE(row) << mode << " " << measure;
      EXPECT_GT((*row)["ours"]["mean"], 0) << mode << " " << measure;
    }
  }
  const Json* const frames = find_row(overview, "foveated + DLSS", 1, "frames-per-second");
  ASSERT_TRUE(frames);
  EXPECT_NEAR((*frames)["published"].get<double>(), 1 / 0.005193, 1e-6);
  EXPECT_GT((*frames)["ours"]["mean"], 0);
  EXPECT_TRUE(find_row(overview, "ours", 1, "frames-per-second"));
  const std::string record = read_file(folder_ / "kept/sponza-overview/comparison.json");
  EXPECT_NE(record.find("FOVEATION_PAPER"), std::string::npos);
  EXPECT_NE(json["experiments"][1]["problem"].get<std::string>().find("sun-temple.glb"), std::string::npos);
}

TEST_F(CliPreset, NamesEveryProblemBeforeItRenders) {
  expect_refused({"compare", "--preset", "best", "--seeds", "0", "--output", "kept"},
                 {"--preset: 'best' is", "schalk, soares, mrad", "--scenes: is missing", "--seeds: '0'"});
  expect_refused(line("mrad", {"--modes", "pt", "--only", "box", "--measures", "mse"}),
                 {"--modes: does not go with --preset", "--measures: does not go with --preset",
                  "--only: 'box' is none", "sun-temple"});
  expect_refused({"compare", "quad.gltf", "--scenes", "scenes", "--output", "kept"},
                 {"--scenes: is only valid with --preset"});
}

}  // namespace
}  // namespace helio::test
