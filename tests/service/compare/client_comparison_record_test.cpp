// The record of a comparison: its text, what a further call adds to it, and what it refuses.
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "client/comparison/comparison_csv.h"
#include "client/comparison/comparison_folder.h"
#include "client/comparison/comparison_record.h"
#include "process.h"
#include "renderer/codec/checksum.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {
namespace {

namespace pb = heliograph::v1;
using google::protobuf::util::MessageDifferencer;

pb::CompareMode mode(const std::string& name, int max_segments = 10) {
  pb::CompareMode mode;
  mode.set_name(name);
  mode.mutable_settings()->set_width(4);
  mode.mutable_settings()->set_height(3);
  mode.mutable_settings()->set_mode(pb::MODE_PT);
  mode.mutable_settings()->set_max_segments(max_segments);
  return mode;
}

ComparisonCall call(const std::vector<std::string>& modes, const std::vector<std::uint32_t>& samples,
                    std::uint32_t seeds) {
  ComparisonCall call;
  call.scene_name = "room";
  call.scene_file = "room.gltf";
  call.version = "0.1.0";
  call.build = "g++";
  call.isa = "avx2";
  call.threads = 2;
  call.request.set_scene_id("5ce0e");
  for (const std::string& name : modes) *call.request.add_modes() = mode(name);
  call.request.add_views()->mutable_position()->set_z(3);
  call.request.set_seeds(seeds);
  for (const std::uint32_t count : samples) call.request.add_samples(count);
  call.request.mutable_reference()->mutable_rendered()->set_error(0.01);
  return call;
}

pb::CompareUnit unit(const std::string& mode, std::uint32_t seed, std::uint32_t budget, double relmse = 0.1) {
  pb::CompareUnit unit;
  unit.set_mode(mode);
  unit.set_seed_number(seed);
  unit.set_budget(budget);
  unit.set_seed(9007199254740991u);
  unit.set_seconds(0.1);
  unit.set_rays(18446744073709551615u);
  pb::CompareValue& value = *unit.add_values();
  value.set_measure(pb::COMPARE_MEASURE_RELMSE);
  value.set_value(relmse);
  return unit;
}

// Two modes, two budgets, one seed, of which three of four pictures are there.
pb::CompareRecord record() {
  pb::CompareRecord record;
  extend_record(record, call({"pt", "combined"}, {4, 16}, 1), {});
  *record.add_units() = unit("combined", 1, 1);
  *record.add_units() = unit("pt", 1, 1);
  *record.add_units() = unit("pt", 1, 0, 1 / 3.0);
  return record;
}

bool contains(const std::vector<std::string>& lines, const std::string& part) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

TEST(ComparisonRecord, ComesBackFromItsText) {
  pb::CompareRecord written = record();
  written.mutable_calls(0)->set_command_line("heliograph compare 'a b' \"c\"\n\xc3\xa9");
  const auto text = comparison_json(written);
  ASSERT_TRUE(text) << text.error().to_string();
  const auto read = parse_comparison(*text, "comparison.json");
  ASSERT_TRUE(read) << read.error().to_string();
  EXPECT_TRUE(MessageDifferencer::Equals(*read, written));
  EXPECT_EQ(read->units(0).rays(), 18446744073709551615u) << "64 bits survive";
  EXPECT_EQ(read->units(2).values(0).value(), 1 / 3.0) << "and so does each bit of a double";
}

TEST(ComparisonRecord, RefusesWhatIsNone) {
  const auto problem = [](const std::string& text) {
    const auto read = parse_comparison(text, "here.json");
    return read ? std::string() : read.error().to_string();
  };
  EXPECT_NE(problem("{").find("here.json: is no record of a comparison"), std::string::npos) << problem("{");
  EXPECT_NE(problem("{}").find("names no format"), std::string::npos);
  EXPECT_NE(problem(R"({"format": 2})").find("is of format 2; this version reads up to 1"), std::string::npos);
  EXPECT_EQ(problem(R"({"format": 1, "keyOfALaterVersion": 3})"), "");

  const auto with_unit = [&](const pb::CompareUnit& wrong) {
    pb::CompareRecord changed = record();
    *changed.add_units() = wrong;
    return problem(*comparison_json(changed));
  };
  EXPECT_NE(with_unit(unit("bdpt", 1, 0)).find("units/3/mode: 'bdpt'"), std::string::npos);
  EXPECT_NE(with_unit(unit("combined", 2, 0)).find("units/3/seedNumber: 2 is not in [1, 1]"), std::string::npos);
  EXPECT_NE(with_unit(unit("combined", 1, 2)).find("units/3/budget: 2 is not below 2"), std::string::npos);
  EXPECT_NE(with_unit(unit("pt", 1, 1)).find("units/3 is there twice"), std::string::npos);
}

TEST(ComparisonRecord, GrowsByModesSeedsAndBudgets) {
  pb::CompareRecord grown = record();
  grown.mutable_table()->add_sentences("old");
  const ComparisonCall more = call({"bdpt", "pt"}, {1, 16, 64}, 3);
  const ComparisonDifferences found = compare_with_record(grown, more);
  EXPECT_TRUE(found.of_shape.empty()) << found.of_shape.front();
  EXPECT_TRUE(found.of_values.empty()) << found.of_values.front();
  extend_record(grown, more, {});

  const pb::CompareRequest request = request_of(grown);
  ASSERT_EQ(request.modes_size(), 3);
  EXPECT_EQ(request.modes(0).name(), "bdpt") << "the newest call says what the others are compared with";
  EXPECT_EQ(request.modes(1).name(), "pt");
  EXPECT_EQ(request.modes(2).name(), "combined");
  EXPECT_EQ(budgets_of(request), (std::vector<double>{1, 4, 16, 64}));
  EXPECT_EQ(request.seeds(), 3u);
  EXPECT_EQ(unit_count(request), 36u);
  ASSERT_EQ(request.done_size(), 3);
  // Budgets 4 and 16 are the second and third now; in the order of modes, then budgets.
  EXPECT_EQ(request.done(0).mode(), "pt");
  EXPECT_EQ(request.done(0).budget(), 1u);
  EXPECT_EQ(request.done(0).values(0).value(), 1 / 3.0);
  EXPECT_EQ(request.done(1).budget(), 2u);
  EXPECT_EQ(request.done(2).mode(), "combined");
  EXPECT_EQ(request.done(2).budget(), 2u);
  EXPECT_FALSE(grown.has_table());
  EXPECT_EQ(grown.calls_size(), 2);

  // Fewer of everything takes nothing away.
  extend_record(grown, call({"pt"}, {16}, 1), {});
  EXPECT_EQ(unit_count(grown.request()), 36u);
  EXPECT_EQ(grown.units_size(), 3);
}

pb::CompareRecord::Picture reference_picture() {
  pb::CompareRecord::Picture picture;
  picture.set_reference(true);
  picture.set_file(picture_file(picture));
  return picture;
}

TEST(ComparisonRecord, ReferencesGoOnWhereTheyAreTheSame) {
  pb::CompareRecord begun = record();
  begun.clear_units();
  begun.add_references()->set_reference_id("r");
  *begun.add_pictures() = reference_picture();
  begun.add_pictures()->set_mode("pt");
  pb::CompareRecord grown = begun;
  extend_record(grown, call({"bdpt"}, {2}, 3), {});
  EXPECT_EQ(grown.references_size(), 1) << "rendering it may have taken most of the time before the interruption";
  EXPECT_EQ(grown.pictures_size(), 1) << "the reference's alone: there is no unit";
  EXPECT_EQ(grown.calls_size(), 1);

  ComparisonCall other = call({"pt"}, {4, 16}, 1);
  other.isa = "sse2";
  grown = begun;
  extend_record(grown, other, {});
  EXPECT_EQ(grown.references_size() + grown.pictures_size(), 0) << "of another build";
  grown = record();
  *grown.mutable_references() = begun.references();
  *grown.mutable_pictures() = begun.pictures();
  extend_record(grown, other, {});
  EXPECT_EQ(grown.references_size(), 1) << "units are compared with it";
  EXPECT_EQ(grown.pictures_size(), 2);
  other.request.mutable_reference()->mutable_rendered()->set_error(0.1);
  extend_record(grown, other, {});
  EXPECT_EQ(grown.references_size(), 0);
  EXPECT_EQ(grown.pictures_size(), 1);
}

TEST(ComparisonRecord, NamesEveryDifference) {
  ComparisonCall other = call({"pt", "combined"}, {4, 16}, 1);
  other.request.set_scene_id("07e5");
  other.request.mutable_modes(1)->mutable_settings()->set_max_segments(5);
  other.request.mutable_views(0)->mutable_position()->set_z(4);
  other.request.mutable_reference()->mutable_rendered()->set_error(0.1);
  other.request.set_common_seeds(true);
  other.build = "clang";
  other.isa = "sse2";
  other.threads = 3;
  const ComparisonDifferences found = compare_with_record(record(), other);
  EXPECT_TRUE(found.of_shape.empty());
  for (const char* part :
       {"scene: room.gltf (5ce0e) -> room.gltf (07e5)", "mode combined settings.max_segments: 10 -> 5",
        "view 0 position.z: 3 -> 4", "reference error: 0.01 -> 0.1", "common seeds: no -> yes", "build: g++ -> clang",
        "instruction set: avx2 -> sse2", "threads: 2 -> 3"})
    EXPECT_TRUE(contains(found.of_values, part)) << part;
  EXPECT_EQ(found.of_values.size(), 8u);

  ComparisonCall unlike = call({"pt"}, {}, 1);
  unlike.request.add_times_s(1);
  unlike.request.add_views()->mutable_position()->set_z(4);
  unlike.request.mutable_modes(0)->mutable_settings()->set_width(5);
  unlike.request.add_measures(pb::COMPARE_MEASURE_MSE);
  unlike.request.add_regions()->set_name("lamp");
  const ComparisonDifferences shape = compare_with_record(record(), unlike);
  for (const char* part : {"picture size: 4x3 -> 5x3", "unit of budgets: samples -> seconds", "number of views: 1 -> 2",
                           "measures: all -> mse", "regions: none -> lamp=0,0,0,0"})
    EXPECT_TRUE(contains(shape.of_shape, part)) << part;
  EXPECT_EQ(shape.of_shape.size(), 5u);

  // Without a picture there is nothing to be mixed with.
  pb::CompareRecord empty = record();
  empty.clear_units();
  EXPECT_TRUE(compare_with_record(empty, unlike).of_shape.empty());
  extend_record(empty, unlike, {});
  EXPECT_EQ(empty.calls_size(), 1);
  EXPECT_EQ(budgets_of(empty.request()), std::vector<double>{1});
}

// A gaze is of modes with foveation: calls without one go with any, and leave that of the record.
TEST(ComparisonRecord, KeepsAGazeThatOthersDoNotAskFor) {
  const auto look = [](pb::CompareRequest& request, double x) {
    pb::CompareMode& seen = *request.add_modes() = mode("seen");
    seen.mutable_settings()->set_foveation(pb::FOVEATION_PAPER);
    request.mutable_gaze()->set_x(x);
    request.mutable_gaze()->set_y(1.5);
  };
  const ComparisonCall unseeing = call({"pt", "combined"}, {4, 16}, 1);
  ComparisonCall first = unseeing, second = unseeing;
  look(first.request, 2);
  look(second.request, 3);
  EXPECT_TRUE(compare_with_record(record(), first).of_values.empty());
  pb::CompareRecord grown = record();
  extend_record(grown, first, {});
  EXPECT_EQ(compare_with_record(grown, second).of_values, std::vector<std::string>{"gaze: 2,1.5 -> 3,1.5"});
  EXPECT_TRUE(compare_with_record(grown, unseeing).of_values.empty());
  extend_record(grown, unseeing, {});
  EXPECT_EQ(grown.request().gaze().x(), 2);
  EXPECT_EQ(grown.request().modes_size(), 3);
}

TEST(ComparisonCsv, IsRfc4180InFullPrecision) {
  pb::CompareRecord full = record();
  pb::CompareValue& dark = *full.mutable_units(0)->add_values();
  dark.set_measure(pb::COMPARE_MEASURE_MSE);
  dark.set_region("a, \"b\"");
  dark.set_value(0.1);
  const std::string csv = units_csv(full);
  EXPECT_EQ(csv.substr(0, csv.find("\r\n")),
            "mode,seed_number,seed,budget_samples,view,seconds,samples,rays,paths,invalid_samples,reuse_share,"
            "others_share,disturbed,\"mse a, \"\"b\"\"\",relmse");
  EXPECT_NE(csv.find("\r\ncombined,1,9007199254740991,16,0,0.1,0,18446744073709551615,0,0,0,0,0,0.1,0.1\r\n"),
            std::string::npos)
      << csv;
  EXPECT_NE(csv.find(",0,,0.3333333333333333\r\n"), std::string::npos) << csv;

  pb::ComparePoint& point = *full.mutable_table()->add_points();
  point.set_mode("pt");
  point.set_all_views(true);
  point.set_seeds(5);
  pb::ComparePoint::Value& value = *point.add_values();
  value.set_measure(pb::COMPARE_MEASURE_DISTANCE_VARIANCE);
  value.mutable_value()->set_mean(0.25);
  EXPECT_NE(points_csv(full).find("\r\npt,4,all,5,0,,,0,distance-variance,,0.25,,,0,0\r\n"), std::string::npos)
      << points_csv(full);
  pb::CompareRatio& ratio = *full.mutable_table()->add_ratios();
  ratio.set_kind(pb::CompareRatio::KIND_EQUAL_ERROR);
  ratio.set_mode("combined");
  ratio.set_baseline("pt");
  ratio.set_measure(pb::COMPARE_MEASURE_RELMSE);
  ratio.set_at(0.5);
  ratio.mutable_ratio()->set_mean(2);
  ratio.mutable_ratio()->set_low(1.5);
  ratio.mutable_ratio()->set_high(2.5);
  ratio.mutable_ratio()->set_known(true);
  ratio.set_verdict(pb::COMPARE_VERDICT_BETTER);
  EXPECT_NE(ratios_csv(full).find("\r\nequal-error,combined,pt,relmse,,0.5,2,1.5,2.5,better,0,0\r\n"),
            std::string::npos);
  ratio.set_verdict(pb::COMPARE_VERDICT_UNDECIDED);
  ratio.set_different_calls(true);
  EXPECT_NE(ratios_csv(full).find(",undecided,0,1\r\n"), std::string::npos);
}

pb::CompareResponse::Picture picture_of(float radiance) {
  const std::vector<float> plane(12, radiance);
  const TileChannel channels[] = {{"R", plane.data(), true}, {"G", plane.data(), true}, {"B", plane.data(), true}};
  const auto exr = encode_tile({{0, 0, 4, 3}, 4, 3}, channels, {TilePixelType::float32, TileCompression::none});
  pb::CompareResponse::Picture picture;
  picture.set_mode("pt");
  picture.set_seed_number(1);
  picture.set_budget(1);
  pb::Tile& tile = *picture.mutable_tile();
  tile.mutable_window()->set_x1(4);
  tile.mutable_window()->set_y1(3);
  tile.set_exr(exr->data(), exr->size());
  tile.set_crc32(crc32_of(exr->data(), exr->size()));
  tile.set_final(true);
  picture.set_last(true);
  return picture;
}

pb::CompareResponse::Accepted accepted() {
  pb::CompareResponse::Accepted accepted;
  accepted.set_threads(7);
  accepted.add_notices("wider than the camera");
  return accepted;
}

TEST(ComparisonFolder, KeepsWhatCame) {
  const TemporaryFolder temporary;
  const std::filesystem::path path = temporary / "kept";
  EXPECT_FALSE(read_comparison_folder(path)->has_value());
  CallControl control;
  pb::CompareRecord begun = record();
  begun.clear_units();
  ComparisonFolder folder(path, begun, control);
  EXPECT_FALSE(std::filesystem::exists(path)) << "a call that is refused leaves nothing";
  folder.accepted(accepted());
  EXPECT_TRUE(std::filesystem::exists(path));
  pb::CompareResponse::Reference reference;
  reference.set_view(0);
  reference.set_error(0.5);
  folder.reference(reference);
  reference.set_error(0.25);
  folder.reference(reference);
  folder.unit(unit("pt", 1, 1));
  folder.picture(picture_of(0.75f));
  ASSERT_TRUE(folder.interrupted());

  const auto kept = read_comparison_folder(path);
  ASSERT_TRUE(kept && kept->has_value());
  const pb::CompareRecord& record = **kept;
  EXPECT_EQ(record.units_size(), 1);
  EXPECT_EQ(record.calls(0).units(), 1u);
  EXPECT_EQ(record.calls(0).threads(), 7);
  EXPECT_EQ(record.notices_size(), 1);
  EXPECT_FALSE(record.calls(0).ended());
  ASSERT_EQ(record.references_size(), 1) << "the newest of a view";
  EXPECT_EQ(record.references(0).error(), 0.25);
  ASSERT_EQ(record.pictures_size(), 1);
  EXPECT_EQ(record.pictures(0).file(), "pictures/pt.view0.exr");
  const auto picture = read_exr((path / record.pictures(0).file()).string(), 100);
  ASSERT_TRUE(picture) << picture.error().to_string();
  EXPECT_EQ((*picture->find("G"))[11], 0.75f);
  EXPECT_FALSE(std::filesystem::exists(path / "units.csv"));

  pb::CompareResponse::Result result;
  result.mutable_table()->add_sentences("pt is best");
  ASSERT_TRUE(folder.finish(result));
  EXPECT_TRUE((*read_comparison_folder(path))->calls(0).ended());
  EXPECT_TRUE(std::filesystem::exists(path / "units.csv"));
  EXPECT_FALSE(folder.failure().has_value());
  EXPECT_FALSE(control.cancelled());
}

float green_of(const std::filesystem::path& file) {
  const auto picture = read_exr(file.string(), 100);
  return picture ? (*picture->find("G"))[11] : -1;
}

TEST(ComparisonFolder, APictureStaysWithItsUnit) {
  const TemporaryFolder temporary;
  const std::filesystem::path path = temporary / "kept", file = path / "pictures/pt.view0.exr";
  CallControl control;
  pb::CompareRecord begun = record();
  begun.clear_units();
  begun.mutable_request()->set_send_pictures(true);
  begun.mutable_request()->mutable_modes()->RemoveLast();  // pt alone
  ComparisonFolder first(path, begun, control);
  first.accepted(accepted());
  auto reference = picture_of(1);
  reference.set_reference(true);
  first.picture(reference);
  first.picture(picture_of(0.75f));
  EXPECT_TRUE(first.request().send_pictures()) << "an interruption here leaves a picture without a unit";
  first.picture(picture_of(0.5f));
  EXPECT_EQ(green_of(file), 0.5f);
  first.unit(unit("pt", 1, 1));
  EXPECT_FALSE(first.request().send_pictures()) << "none is missing";
  ASSERT_TRUE(first.interrupted());

  ComparisonFolder second(path, **read_comparison_folder(path), control);
  EXPECT_FALSE(second.request().send_pictures());
  second.accepted(accepted());
  second.picture(picture_of(0.25f));
  EXPECT_EQ(green_of(file), 0.5f) << "that was measured";
  std::filesystem::remove(file);
  ComparisonFolder third(path, **read_comparison_folder(path), control);
  EXPECT_TRUE(third.request().send_pictures());
  third.accepted(accepted());
  third.picture(picture_of(0.25f));
  EXPECT_EQ(green_of(file), 0.25f) << "better than none";
  EXPECT_FALSE(control.cancelled());

  pb::CompareRecord longer = **read_comparison_folder(path);
  extend_record(longer, call({"pt"}, {4, 16, 64}, 1), {});
  longer.mutable_request()->set_send_pictures(true);
  EXPECT_TRUE(ComparisonFolder(path, longer, control).request().send_pictures()) << "of the new last budget";
}

TEST(ComparisonFolder, AsksForMissingPicturesAlone) {
  const TemporaryFolder temporary;
  const std::filesystem::path path = temporary / "kept";
  CallControl control;
  pb::CompareRecord begun = record();
  begun.clear_units();
  begun.mutable_request()->set_send_pictures(true);
  ASSERT_EQ(begun.request().modes_size(), 2);
  const std::string other = begun.request().modes(1).name();
  ComparisonFolder folder(path, begun, control);
  folder.accepted(accepted());
  auto reference = picture_of(1);
  reference.set_reference(true);
  folder.picture(reference);
  folder.picture(picture_of(0.5f));
  const auto done = [&] {
    std::vector<std::string> names;
    const pb::CompareRequest request = folder.request();
    EXPECT_TRUE(request.send_pictures());
    for (const auto& name : request.pictures_done()) {
      EXPECT_EQ(name.view(), 0u);
      EXPECT_EQ(name.reference(), name.mode().empty());
      names.push_back(name.reference() ? "reference" : name.mode());
    }
    return names;
  };
  EXPECT_EQ(done(), std::vector<std::string>{"reference"}) << "the unit of pt's picture is not there";
  folder.unit(unit("pt", 1, 1));
  EXPECT_EQ(done(), (std::vector<std::string>{"reference", "pt"}));
  auto second = picture_of(0.5f);
  second.set_mode(other);
  folder.picture(second);
  folder.unit(unit(other, 1, 1));
  EXPECT_FALSE(folder.request().send_pictures());
  EXPECT_TRUE(folder.request().pictures_done().empty()) << "no picture is asked for";
  EXPECT_TRUE(folder.record().request().pictures_done().empty());
  EXPECT_FALSE(control.cancelled());
}

TEST(ComparisonFolder, ItsOwnReferencesKeepTheirNames) {
  const TemporaryFolder temporary;
  CallControl control;
  pb::CompareRecord begun = record();
  pb::CompareResponse::Reference& rendered = *begun.add_references();
  rendered.set_reference_id("rendered");
  rendered.set_samples(512);
  rendered.set_noise(pb::CompareResponse::Reference::NOISE_HALVES);
  *begun.add_pictures() = reference_picture();
  const std::string file = temporary / "pictures/reference.view0.exr";
  std::filesystem::create_directory(temporary / "pictures");
  const std::vector<float> plane(12, 0.5f);
  std::vector<TileChannel> channels{{"R", plane.data(), true}, {"G", plane.data(), true}, {"B", plane.data(), true}};
  const auto files = [&] {
    EXPECT_TRUE(write_exr(file, {{0, 0, 4, 3}, 4, 3}, channels, {TilePixelType::float32, TileCompression::none}));
    return ComparisonFolder(temporary.path(), begun, control).rendered_reference_files();
  };
  EXPECT_TRUE(files().empty()) << "without variance its noise would be lost";
  for (const char* name : {"variance.R", "variance.G", "variance.B"}) channels.push_back({name, plane.data(), true});
  EXPECT_EQ(files(), std::vector<std::string>{file});

  ComparisonFolder folder(temporary.path(), begun, control);
  EXPECT_EQ(folder.rendered_reference_ids(), std::vector<std::string>{"rendered"});
  folder.use_reference_files();
  pb::CompareResponse::Reference loaded;
  loaded.set_reference_id("file");
  loaded.set_noise(pb::CompareResponse::Reference::NOISE_VARIANCE);
  folder.reference(loaded);
  EXPECT_EQ(folder.record().references(0).reference_id(), "rendered");
  EXPECT_EQ(folder.record().references(0).samples(), 512u);
  EXPECT_EQ(folder.record().references(0).noise(), pb::CompareResponse::Reference::NOISE_VARIANCE);

  begun.mutable_request()->add_views();
  EXPECT_TRUE(ComparisonFolder(temporary.path(), begun, control).rendered_reference_ids().empty())
      << "of one view only";
}

TEST(ComparisonLock, KeepsOthersOut) {
  const TemporaryFolder temporary;
  const std::filesystem::path path = temporary / "kept";
  {
    const auto first = ComparisonLock::take(path);
    ASSERT_TRUE(first) << first.error().to_string();
    EXPECT_TRUE(first->effective());
    const auto second = ComparisonLock::take(path);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::failed_precondition);
    EXPECT_NE(second.error().message.find("is in use: process " + std::to_string(::getpid())), std::string::npos)
        << second.error().message;
  }
  EXPECT_FALSE(std::filesystem::exists(path)) << "it was made for the lock alone";
  std::filesystem::create_directory(path);
  write_file((path / "comparison.lock").string(), "process 1 that was killed");
  EXPECT_TRUE(ComparisonLock::take(path));
  EXPECT_TRUE(std::filesystem::is_empty(path));
  EXPECT_FALSE(ComparisonLock::take(temporary / "none/here"));
}

TEST(ComparisonFolder, KeepsThePartialTableOfACallThatWasAccepted) {
  const TemporaryFolder temporary;
  CallControl control;
  pb::CompareTable partial;
  partial.set_partial(true);
  ComparisonFolder refused(temporary / "refused", record(), control);
  ASSERT_TRUE(refused.interrupted(partial));
  EXPECT_FALSE(std::filesystem::exists(temporary / "refused"));
  ComparisonFolder folder(temporary / "kept", record(), control);
  folder.accepted(accepted());
  ASSERT_TRUE(folder.interrupted(partial));
  EXPECT_TRUE((*read_comparison_folder(temporary / "kept"))->table().partial());
  EXPECT_FALSE((*read_comparison_folder(temporary / "kept"))->calls(0).ended());
  for (const char* file : {"units.csv", "points.csv", "ratios.csv"})
    EXPECT_TRUE(std::filesystem::exists(temporary / ("kept/" + std::string(file)))) << file;
}

TEST(ComparisonFolder, ABrokenTileEndsTheCall) {
  const TemporaryFolder temporary;
  CallControl control;
  ComparisonFolder folder(temporary / "kept", record(), control);
  folder.accepted(accepted());
  auto broken = picture_of(1);
  broken.mutable_tile()->set_crc32(broken.tile().crc32() + 1);
  folder.picture(broken);
  ASSERT_TRUE(folder.failure().has_value());
  EXPECT_TRUE(control.cancelled());
  ASSERT_TRUE(folder.interrupted());
  EXPECT_EQ((*read_comparison_folder(temporary / "kept"))->units_size(), 3);
}

}  // namespace
}  // namespace helio::test
